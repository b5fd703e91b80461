# omentum study attachments --part simulated: the quick study, resumed, and one sentence for each mistake. Whether the
# goal is met on two samples is not tested.
$ omentum study attachments --part simulated --quick --workers 1 -q -o out; code=$?; test $code -le 1
exit 0
out ^Test \(a\), exact displacements, 2 samples
out ^  Same +2: DSC 1\.00, TPR 100 %, AVE +[0-9.]+ mm
out ^report: out/report.html
no-err
file out/report.html
file out/study.json
file out/samples.csv
file out/sample-camera-0002.bin

# Medians of study.json, computed anew from samples.csv.
$ python3 -B $ROOT/test/study/check_match.py simulated out
exit 0
out every number agrees

# Resumed: the same table.
$ cp out/samples.csv first.csv; rm -f out/base-two-0001.bin out/sample-exact-0002.bin; omentum study attachments --part simulated --quick -q -o out > said; cmp first.csv out/samples.csv
exit 0

$ omentum study attachments --part simulate -o out
exit 2
err --part: "simulate" is none of layouts, simulated, phantoms, kidney

$ omentum study attachments --part simulated --samples 0 -o out
exit 2
err --samples

$ omentum study attachments --part layouts --quick -q -o out
exit 3
err out holds
