# omentum study methods with the weights that come along: one lesion, a coarse truth. Whether the bar is met is 0 or 1.
$ omentum study methods --quick --lesions-used 1 -q -o out; test $? -le 1
exit 0
out ^finite elements +[0-9.]+ mm
out ^U-Mesh +[0-9.]+ mm
out ^U-Mesh less finite elements: .* where it is worst
out ^the bar is
file out/report.html
file out/study.json
file out/errors.csv

# The same from a folder where truth and elements are: nothing of them is solved again.
$ omentum study methods --quick --lesions-used 1 -q --truth-from out -o again; cmp out/errors.csv again/errors.csv
exit 0
