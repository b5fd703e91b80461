# omentum study methods with the weights that come along: one lesion, a coarse truth. The network is nearer to the truth
# than finite elements, which stick to the probe: all criteria are met.
$ omentum study methods --quick --lesions-used 1 --truth 1000 --workers 1 -q -o out > said; code=$?; cat said; exit $code
exit 0
out ^finite elements +[0-9.]+ mm
out ^U-Mesh minus finite elements: at most -[0-9.]+ mm over 5 deformations; 0 of these
out ^criteria: met
no-err
file out/report.html

# Every number of the files, the report and the terminal, computed anew from errors.csv, runs and positions.
$ python3 -B $ROOT/test/study/check_study.py methods out said
exit 0
out every number agrees

# The same from a folder where truth and elements are: nothing of them is solved again. Finite elements that find each
# lesion where it was measured err by nothing; the network is then more than 0.3 mm worse, and a criterion is missed.
$ cp -r out known && python3 -B $ROOT/test/study/edit_run.py known/runs/prescribed-001363-01.json measured out/study.json && omentum study methods --quick --lesions-used 1 --truth 1000 --workers 1 -q --truth-from known -o again > said; code=$?; cat said; cp -r known/runs again && python3 -B $ROOT/test/study/check_study.py methods again said || exit 9; diff <(grep -v ^finite out/errors.csv) <(grep -v ^finite again/errors.csv) || exit 9; exit $code
exit 1
out ^finite elements +0.00 mm
out ^U-Mesh minus finite elements: at most \+[0-9.]+ mm over 5 deformations
out ^criteria: missed
out every number agrees
