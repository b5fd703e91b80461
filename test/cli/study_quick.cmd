# The quick study with all methods on its three meshes: every path to its end.
$ omentum study contact --quick --lesions-used 1 -q -o quick
exit 0
out ^9 runs \(9 new\): 9 completed the path; the worst reached 100 %
out ^the bar is met by 9 of 9 combinations
no-err
