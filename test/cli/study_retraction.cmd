# omentum study retraction: Table 6.4 and one pair, resumed; one sentence for whatever goes wrong.
$ omentum study retraction --quick --part random --workers 2 -q -o out
exit 0
out ^random pairs, DEFRAS: . of 1 exposed, 
out report: out/report.html
no-err
file out/report.html
file out/study.json
file out/runs/pair-1001-fewer-defras/report.html

$ omentum study retraction --quick --part replanning -q -o out
exit 0
out ^a plan on 5 x 5 blocks takes [0-9.]+ ms
out ^1 runs|^[0-9]+ runs \([0-9]+ new\)

$ omentum study retraction --quick --part random --workers 1 -q -o out
exit 0
out \(0 new\)

$ omentum study retraction --part kidney -q -o out
exit 3
err needs data

$ omentum study retraction --part kidneys -o out
exit 2
err did you mean kidney

$ omentum study retraction
exit 2
err add -o DIR

# A judged draw needs the sources and a table; what was run is in it.
$ omentum study retraction --quick --part alarms --seed 0123456789abcdef --draw 3 --draws draws.csv --workers 1 -q -o out && cat draws.csv
exit 0
out ^false alarms: [01] of 1 runs
out ^study,part,hash,draw,commit,cases,result
out ^retraction,alarms,0123456789abcdef,3,-,3001-3001 quick,[01] of 1 warned
file out/alarm-3001-0123456789abcdef-3-defras.bin

$ omentum study retraction --part scenarios --seed development -q -o out
exit 3
err only random pairs, their ablations and alarms have other seeds

$ omentum study retraction --part random --seed HEAD -o out
exit 2
err none of development, here, a commit

$ omentum study retraction --part random --draw 2 -q -o none
exit 2
err --draw and --draws are of cases that are drawn: give --seed here, a commit or a hash, too
err-lines 1
no-file none

$ omentum study retraction --part randon -q -o none
exit 2
err --part "randon" is unknown; did you mean random
