# omentum umesh generate: one sentence for whatever goes wrong.
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
