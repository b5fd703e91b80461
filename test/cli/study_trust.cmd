# omentum study trust: one lifted sheet, resumed, and a judged draw in its table. Whether the goal is met on a coarse
# sheet is not tested.
$ omentum study trust --quick --truths 1 --workers 1 -q -o out; code=$?; test $code -le 1
exit 0
out ^right data: [0-9]+ of 5 refused, median Dice 0\.[0-9]+
out ^shift +[0-9]+ cases: +[0-9]+ accepted, +[0-9]+ corrected, +[0-9]+ refused
out ^wrong data: [0-9]+ of 5 bad
out ^with a right one: other tissue left out or refused in [0-9]+ of 4
out ^the goal of 2 bad of 500, 1 % refused and a calibration error of 0.05 is (met|missed)$
no-err
file out/report.html
file out/study.json
file out/cases.csv
file out/truth-001.bin

# Every number, counted anew from the cases.
$ python3 -B $ROOT/test/study/check_match.py trust out
exit 0
out every number agrees

# Resumed: a lost result is made again from its truth.
$ cut -d, -f1-13 out/cases.csv > first.csv; rm out/trust-000.bin; omentum study trust --quick --truths 1 -q -o out > said; cut -d, -f1-13 out/cases.csv | cmp first.csv -
exit 0

# A judged draw of the same number of truths has others, and lines in its table.
$ omentum study trust --quick --truths 1 --seed 0123456789abcdef --draw 2 --draws table.csv -q -o drawn > said; cut -d, -f1-6 table.csv; cmp -s out/truth-000.bin drawn/truth-000.bin
exit 1
out ^trust,right,0123456789abcdef,2,-,0-0 quick$
out ^trust,wrong,0123456789abcdef,2,-,0-0 quick$
out ^trust,probability,0123456789abcdef,2,-,0-0 quick$
