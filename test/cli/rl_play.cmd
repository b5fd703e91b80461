# omentum rl play: a person drives by keys; here the keys come from a pipe.

# Down, grasp, up and away: the tumour is seen. The same input gives the same bytes.
write lift.keys
    # down
    8m
    # up, then away from the camera, and stay
    34o
    20i
    20 
$ $OMENTUM rl play -t retract -s move_mm=2 --start 38 -p play.html --size 64 -o person.hdf5 < lift.keys && $OMENTUM rl play -t retract -s move_mm=2 --start 38 -o again.hdf5 < lift.keys && cmp person.hdf5 again.hdf5 && echo same
exit 0
out ^episode 1, ended: [67]\d steps, return [0-9.]+, exposure 1, grasped 1, .*; demonstration 1 of person.hdf5$
out ^same$
no-err
file play.png
$ grep -c 'src="play.png"' play.html; od -A n -t x1 -j 16 -N 8 play.png
exit 0
out ^1$
out 00 00 00 40 00 00 00 40
# A second run appends.
$ $OMENTUM rl play -t retract -s move_mm=2 --start 38 -o person.hdf5 --json < lift.keys
exit 0
out "recorded": 1$
err demonstration 2 of person.hdf5

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
$ (printf '3af3af'; sleep 60) | $OMENTUM rl play -t reach -o killed.hdf5 > log & while ! grep -qs 'demonstration 2' log; do sleep 0.05; done; kill -9 $!; sleep 0.1; printf '3af' | $OMENTUM rl play -t reach -o killed.hdf5; ls
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
$ omentum rl play -t reach -o person.hdf5
exit 3
err person.hdf5: the demonstrations are of task retract, not of reach
$ omentum rl play -t reach -o lift.keys
exit 3
err lift.keys
$ omentum rl play -t reach -p lift.keys
exit 3
err name it FILE.png, or FILE.html
$ cp lift.keys mine.png; $OMENTUM rl play -t reach -p mine.png
exit 3
err mine.png
$ omentum rl play -t reach --start 27
exit 3
err task reach has no start 27; its starts are 0 to 26
$ omentum rl play -t reach --rate 5
exit 2
err --rate needs --real-time
$ omentum rl play -t reach --least-score 5
exit 2
err --least-score needs --record
