# omentum banet generate: files, resuming, test sets, and one sentence for each mistake.
$ omentum banet generate -n 3 --first 2 --shard 1 --seed 900 --way exact --pictures 0 -q -o part
exit 0
out ^1 samples \(1 new,
out ^0 through a camera
no-err

# The part of a set is taken.
$ omentum banet generate -n 3 --first 1 --shard 1 --seed 900 --way exact --pictures 0 -q -o out --part part && cmp part/samples_000002.h5 out/samples_000002.h5
exit 0
out ^2 samples \(1 new,
file out/samples_000001.h5
file out/summary.json
file out/report.html
$ omentum banet generate -n 2 --part nowhere -q -o out
exit 2
err --part nowhere: there is no such folder

# A missing file is made again, to the same bytes, by any number of workers, also after the program was killed at any moment.
$ cp -r out killed; rm killed/samples_000001.h5; timeout -s KILL 0.3 omentum banet generate -n 3 --first 1 --shard 1 --seed 900 --way exact --pictures 0 -q -o killed; true
exit 0
$ omentum banet generate -n 3 --first 1 --shard 1 --seed 900 --way exact --pictures 0 -q -o killed --workers 1 && cmp out/samples_000001.h5 killed/samples_000001.h5 && cmp out/samples_000002.h5 killed/samples_000002.h5
exit 0
out ^2 samples
$ ls -A killed | grep part
exit 1

# Another seed, and another setting, are another set.
$ omentum banet generate -n 3 --first 1 --shard 1 --seed 901 --way exact -q -o out
exit 3
err another seed or other settings
err-lines 1
$ omentum banet generate -n 3 --first 1 --shard 1 --seed 900 --way exact --law st-venant-kirchhoff -q -o out
exit 3
err another seed or other settings

$ omentum banet generate -n 3 --first 1 --shard 1 --seed 900 --way exact --element linear -q -o out
exit 3
err another seed or other settings

$ omentum banet generate --help
exit 0
out Examples:
out --test NAME

$ omentum banet
exit 2
err omentum help banet lists the names:.* generate

$ omentum banet generate
exit 2
err add -o DIR

$ omentum banet generate --test tests -o x
exit 2
err the test sets are test, test-camera, board and two

$ omentum banet generate --test test --seed 3 -o x
exit 2
err --test test sets --seed itself

$ omentum banet generate --element cubic -o x
exit 2
err --element cubic: it must be linear or quadratic

$ omentum banet generate --way both -o x
exit 2
err --way both: it must be exact, camera or mixed

$ omentum banet generate --first 30 -o x
exit 2
err --first 30 must be a multiple of --shard 50

$ omentum banet generate --side 1 -o x
exit 2
err --side

$ touch taken && omentum banet generate -n 1 --way exact -q -o taken/out
exit 3
err taken
err-lines 1
