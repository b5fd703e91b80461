# omentum umesh generate: files, resuming.
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

# Killed at any moment, it goes on to the same files, and makes what is missing.
$ cp -r out killed; rm killed/samples_000003.h5; timeout -s KILL 0.3 omentum umesh generate --elements 200 --points 4x4x4 -n 5 --shard 3 --workers 1 -q -o killed; true
exit 0

$ omentum umesh generate --elements 200 --points 4x4x4 -n 5 --shard 3 --workers 1 -q -o killed && cmp kept.h5 killed/samples_000003.h5 && cmp out/samples_000000.h5 killed/samples_000000.h5
exit 0
out ^5 samples \([02] new,
no-err
$ ls -A killed | grep part
exit 1
