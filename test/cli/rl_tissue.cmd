# omentum rl on the task retract: tissue that slips, exposure by grasping place.
# What happened to the tissue.
$ omentum rl eval -t retract -s tissue=elements -s max_step=180 -s slip_n=0.05 -n 2 --expert --drawn -q
exit 1
out ^in 2 of 2 episodes the fat slipped out of the jaws, at most [1-9]
$ omentum rl survey -t retract --json
exit 0
out "near": 0,
out "best": 1,
