# omentum study calibration: the quick study, every number computed anew, resumed; a bar that is missed.
$ omentum study calibration --quick --truth 2000 --lesions-used 2 --workers 1 -q -o out > said; code=$?; cat said; exit $code
exit 0
out ^gel: spacing [0-9.]+ mm, radius [0-9.]+ mm, stiffness
out ^breast: .* before$
out ^\d+ evaluations \(\d+ new\); criterion: met
no-err
file out/report.html

$ python3 -B $ROOT/test/study/check_study.py calibration out said
exit 0
out every number agrees

# Finite elements that find the unseen lesion within a tenth of a millimetre: particles are more than 1.5 times as far
# off, and a criterion is missed. Searches are not repeated.
$ python3 -B $ROOT/test/study/edit_run.py $(ls out/breast/runs/prescribed-*-02.json) measured out/study.json && omentum study calibration --quick --truth 2000 --lesions-used 2 --workers 1 -q -o out > said; code=$?; cat said; python3 -B $ROOT/test/study/check_study.py calibration out said || exit 9; exit $code
exit 1
out \(0 new\); criterion: missed
out every number agrees
