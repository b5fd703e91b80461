# omentum study sheet-calibration: the quick study, resumed, and one sentence for whatever goes wrong. Coarse
# particles against coarse clouds: the goal is out of reach, whence exit code 1.
$ omentum study sheet-calibration --quick --workers 1 -q -o out > said; code=$?; cat said; exit $code
exit 1
out ^all clouds: [0-9.]+ mm with the thesis's parameters, [0-9.]+ mm with those found
out ^pinch points left out of the search: 
out ^spacing .* mm, radius .* mm, stiffness 
no-err
file out/report.html
file out/study.json
file out/clouds.csv
file out/without-1/calibrated.yaml

# Every number, computed anew from the errors by pinch and lift and from the journal.
$ python3 -B $ROOT/test/study/check_study.py sheet out said
exit 0
out every number agrees

$ omentum study sheet-calibration --quick -q -o out
exit 1
out evaluations \(0 new\)

# What a search did can be done by hand.
$ omentum calibrate out/without-1/lift.yaml -q -o out/without-1
out evaluations \(0 new\)
exit 1

$ omentum study sheet-calibration -q -o out
exit 3
err other settings; choose another folder
err-lines 1

$ mkdir mine && echo 1 > mine/notes.txt && omentum study sheet-calibration --quick -q -o mine; code=$?; ls -A mine; exit $code
exit 3
out ^notes\.txt$
err mine holds notes\.txt and no list

$ omentum study sheet-calibration
exit 2
err add -o DIR

$ omentum study sheet-calibration -o out --leave-one-outt
exit 2
err --leave-one-out
