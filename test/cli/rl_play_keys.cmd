# omentum rl play: keys, episodes, the clock, and what learns from them.
# Episodes: r drops one, f finishes one, the end of the input leaves one.
$ printf '9ar5df3w' | $OMENTUM rl play -t reach --start 0 -o reach.hdf5
exit 0
out ^episode 1 was dropped$
out ^episode 1, finished: 5 steps, .*; demonstration 1 of reach.hdf5$
out ^episode 2, not finished: 3 steps, .*; not recorded \(f finishes an episode\)$
# Arrows and page keys; -n ends; a score that is too low.
$ printf '\033[A\033OB\033[C\033[D\033[5~\033[6~\033[1;5A fff' | $OMENTUM rl play -t reach -n 1 -o reach.hdf5 --least-score 0.5
exit 0
out ^episode 1, finished: 8 steps, .*reached 0; not recorded: its score is below 0.5$
$ printf '?q' | $OMENTUM rl play -t expose
exit 0
err ^  PSM1 away from the camera \(\+x\): up, i$
err ^  PSM2 down \(-z\): c$
# The pole falls. From a pipe each key is a step also in real time; the clock bounds the rate.
$ printf '30d30a' | $OMENTUM rl play -t cart-pole --real-time --rate 100 -n 2 --json | tee cart.json; python3 -c 'import json; f = json.load(open("cart.json"))["figures"]; print("at most 100 a second" if 0 < f["rate"] < 101 else f)'
exit 0
out "episodes": 2,
out ^at most 100 a second$
# Say where the lesion is.
$ printf '4wx' | $OMENTUM rl play -t press --start 12 -n 1 -p press.png
exit 0
out ^episode 1, ended: 5 steps, return [-0-9.]+, found 1, distance 0.004$

# A killed run loses nothing that was finished.
$ (printf '3af3af'; sleep 60) 2> /dev/null | $OMENTUM rl play -t reach -o killed.hdf5 > log & while ! grep -qs 'demonstration 2' log; do sleep 0.05; done; kill -9 $!; sleep 0.1; printf '3af' | $OMENTUM rl play -t reach -o killed.hdf5; ls
exit 0
out demonstration 3 of killed.hdf5$

# Cloning and GAIL learn from what was driven.
$ for k in 0 2 6 8 18 20 24 26; do x=a; y=w; z=e; test $((k % 3)) = 2 && y=s; test $((k / 3 % 3)) = 2 && x=d; test $((k / 9)) = 2 && z=c; printf '10%s10%s10%s' $y $x $z | $OMENTUM rl play -t reach --start $k -o eight.hdf5; done | grep -c 'reached 1'; $OMENTUM rl train -t reach -m clone -d eight.hdf5 --clone-epochs 100 -q -o clone && $OMENTUM rl train -t reach -m gail -d eight.hdf5 -n 1024 --clone-epochs 2 -q -o gail
exit 0
out ^8$
out ^1024 steps

# bad input
$ printf '5a z' | $OMENTUM rl play -t reach
exit 3
err standard input, key 4: task reach has no key "z"; \? prints the keys
$ omentum rl play -t reach --start 27
exit 3
err task reach has no start 27; its starts are 0 to 26
$ omentum rl play -t reach --rate 5
exit 2
err --rate needs --real-time
$ omentum rl play -t reach --least-score 5
exit 2
err --least-score needs --record
