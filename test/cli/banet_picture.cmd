# omentum banet generate --pictures: a sample in the report.
$ omentum banet generate -n 1 --seed 905 --way exact --pictures 1 -q -o out && grep -c "<img" out/report.html
exit 0
out ^1 samples \(1 new,
