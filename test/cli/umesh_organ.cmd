# omentum umesh generate: an organ of one's own; folders that are not replaced.
# A closed surface.
$ printf 'v 0 0 0\nv 60 0 0\nv 0 60 0\nv 0 0 60\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n' > a.obj; omentum umesh generate --model a.obj --up superior --elements 150 -n 1 -q -o own
exit 0
out ^1 samples

# A second run in the same folder, and a folder of the user's.
$ (flock -x 9; omentum umesh generate --model a.obj --up superior --elements 150 -n 1 -q -o own) 9< own
exit 3
err own: another run of omentum writes into it

$ mkdir mine && echo 1 > mine/summary.json && omentum umesh generate --elements 200 --points 4x4x4 -n 5 -q -o mine; code=$?; cat mine/summary.json; exit $code
exit 3
out ^1$
err mine holds summary\.json and no list
$ omentum umesh generate --model mine -n 1 -q -o mine
exit 3
err mine is an input and cannot be the output too

# Another seed is another set.
$ omentum umesh generate --model a.obj --up superior --elements 150 -n 1 --seed 2 -q -o own
exit 3
err another seed
err-lines 1
