# omentum rl train: a training that is killed and started again.
# Killed after an iteration and started again: the same policy.
$ ($OMENTUM rl train -t reach -n 40960 -q -o killed & pid=$!; while ! test -e killed/checkpoint.h5 && kill -0 $pid 2> /dev/null; do sleep 0.05; done; kill -9 $pid; wait $pid); $OMENTUM rl train -t reach -n 40960 -q -o killed > /dev/null && $OMENTUM rl train -t reach -n 40960 -q -o whole --workers 1 > /dev/null && tail -c 20000 killed/policy.safetensors | cksum > a && tail -c 20000 whole/policy.safetensors | cksum | cmp - a && echo same
exit 0
out ^same$
$ omentum rl eval -t reach -p whole/policy.safetensors -q -o table.csv
exit 0
out ^27 episodes: reached 1\.000
$ head -2 table.csv
exit 0
out ^episode,return,score,steps,ended,reached$
