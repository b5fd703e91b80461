# The quick study with all methods on its three meshes: every path to its end, every number computed anew.
$ omentum study contact --quick --lesions-used 1 --truth 1000 --workers 1 -q -o quick | tee said; cp said said1; exit ${PIPESTATUS[0]}
exit 0
out ^9 runs \(9 new\): 9 completed the path; the worst reached 100 %
out ^all criteria are met by 9 of 9 combinations
no-err
$ python3 -B $ROOT/test/study/check_study.py contact quick said
exit 0
out every number agrees

# A mesh of 3,000 elements that finds the lesion 20 mm off is more than 0.3 mm worse than the finest: a criterion is missed.
$ first=$(ls quick/runs/penalty-*-01.json | head -1); python3 -B $ROOT/test/study/edit_run.py $first elements 3000; python3 -B $ROOT/test/study/edit_run.py $first move 0 0 20; omentum study contact --quick --lesions-used 1 --truth 1000 --workers 1 -q -o quick > said; code=$?; cat said; python3 -B $ROOT/test/study/check_study.py contact quick said || exit 9; exit $code
exit 1
out ^9 runs \(0 new\): 9 completed the path
out ^all criteria are met by 8 of 9 combinations
out every number agrees
