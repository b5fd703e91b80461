# omentum study correspondence: the quick study, resumed, and one sentence for each mistake. Whether the goal is met on
# coarse sheets is not tested.
$ omentum study correspondence --quick --workers 1 -q -o out; code=$?; test $code -le 1
exit 0
out ^4 cases, points that moved by 5 mm or more:
out ^nearest, rest shape +median +[0-9.]+ mm, 90 % +[0-9.]+ mm
out ^the goal of 2 mm, 90 % within 5 mm, 80 % answered and 60 ms is (met|missed)
no-err
file out/report.html
file out/study.json
file out/errors.csv
file out/truth-quick-135.bin

# Every number, computed anew from the errors of the points.
$ python3 -B $ROOT/test/study/check_match.py correspondence out
exit 0
out every number agrees

# Resumed: a lost case is computed again from its truth, with the same errors.
$ cp out/errors.csv first.csv; rm out/case-quick-02.bin; omentum study correspondence --quick -q -o out > said; cmp first.csv out/errors.csv
exit 0

$ omentum study correspondence
exit 2
err add -o DIR

$ omentum study correspondence -o out --spacing 1
exit 2
err --spacing

$ mkdir mine && echo 1 > mine/notes.txt && omentum study correspondence --quick -q -o mine; code=$?; ls -A mine; exit $code
exit 3
out ^notes\.txt$
err mine holds notes\.txt and no list
