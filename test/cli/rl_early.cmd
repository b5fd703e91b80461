# omentum rl train: a training that stops early, with the best of its policies.
$ omentum rl train -t reach -n 400000 --rate 0.001 --eval-period 8 --eval-stop 2 -q -o early
exit 0
out ^[0-9]{5,6} steps
out ^kept: the policy after [0-9]+ steps; evaluation: score 1.000, lowest 1.000$
$ test $(wc -l < early/metrics.csv) -lt 300 && echo stopped
exit 0
out ^stopped$
