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


# bad input
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
