# omentum umesh generate: files, resuming, organs of one's own, and one sentence for whatever goes wrong.
$ omentum umesh generate --elements 200 --points 4x4x4 -n 5 --shard 3 -q -o out
exit 0
out ^[0-9]+ elements of [0-9.]+ mm, [0-9]+ nodes
out ^5 samples \(5 new,
no-err
file out/samples_000000.h5
file out/samples_000003.h5
file out/summary.json
file out/report.html

# What was changed is not replaced. What is missing is made again, to the same bytes, by any number of workers.
$ cp out/samples_000003.h5 kept.h5; printf 'damaged' > out/samples_000003.h5; omentum umesh generate --elements 200 --points 4x4x4 -n 5 --shard 3 --workers 1 -q -o out
exit 3
err out/samples_000003\.h5 was changed after omentum wrote it: move it away
err-lines 1

$ rm out/samples_000003.h5; omentum umesh generate --elements 200 --points 4x4x4 -n 5 --shard 3 --workers 1 -q -o out && cmp kept.h5 out/samples_000003.h5
exit 0
out ^5 samples \(2 new,
no-err

# Killed at any moment, it goes on to the same files.
$ timeout -s KILL 0.5 omentum umesh generate --elements 200 --points 4x4x4 -n 5 --shard 3 --workers 1 -q -o killed; true
exit 0

$ omentum umesh generate --elements 200 --points 4x4x4 -n 5 --shard 3 -q -o killed && cmp kept.h5 killed/samples_000003.h5 && cmp out/samples_000000.h5 killed/samples_000000.h5
exit 0
no-err
$ ls -A killed | grep part
exit 1

# A second run in the same folder, and a folder of the user's.
$ (flock -x 9; omentum umesh generate --elements 200 --points 4x4x4 -n 5 --shard 3 -q -o out) 9< out
exit 3
err out: another run of omentum writes into it

$ mkdir mine && echo 1 > mine/summary.json && omentum umesh generate --elements 200 --points 4x4x4 -n 5 -q -o mine; code=$?; cat mine/summary.json; exit $code
exit 3
out ^1$
err mine holds summary\.json and no list
$ omentum umesh generate --model mine -n 1 -q -o mine
exit 3
err mine is an input and cannot be the output too

# Another seed is another set.
$ omentum umesh generate --elements 200 --points 4x4x4 -n 5 --shard 3 --seed 2 -q -o out
exit 3
err another seed
err-lines 1

# A closed surface.
$ printf 'v 0 0 0\nv 60 0 0\nv 0 60 0\nv 0 0 60\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n' > a.obj; omentum umesh generate --model a.obj --up superior --elements 150 -n 1 -q -o own
exit 0
out ^1 samples

$ omentum umesh generate --model nowhere -n 1 -q -o own2
exit 3
err nowhere/patient\.yaml
err-lines 1

$ omentum umesh
exit 2
err no name is given; omentum help umesh lists the names: eval generate predict train$

$ omentum umesh genrate
exit 2
err did you mean "generate"

$ omentum umesh --help
exit 0
out generate

$ omentum umesh generate --help
exit 0
out Examples:
out --press-share

$ omentum umesh generate
exit 2
err add -o DIR

$ omentum umesh generate -o out --law rubber
exit 2
err rubber

$ omentum umesh generate -o out --points 3,4,5
exit 2
err --points 3,4,5

$ omentum umesh generate -o out --tilt 100
exit 2
err --tilt

$ touch taken && omentum umesh generate --elements 200 --points 4x4x4 -n 1 -q -o taken/out
exit 3
err taken
err-lines 1

# What would take years is refused before it begins, and nothing is written.
$ omentum umesh generate --elements 30000 -n 10000000 --workers 1 -q -o years
exit 3
err 10000000 samples of [0-9]+ elements would take about .* days, at most 347 are begun
no-file years/summary.json
