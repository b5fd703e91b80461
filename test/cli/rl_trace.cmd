# omentum rl demo --from: demonstrations from a recorded robot.

write robot.csv
    # exported
    time,x,y,z
    0,-0.05,0.004,0.04
    1,-0.046,0.001,0.022
    2,-0.02,0.002,0.075
    3,0,0,0.095
$ $OMENTUM rl demo -t retract -s move_mm=2 --from robot.csv --from robot.csv --deviation 4 -o robot.hdf5
exit 0
out ^robot.csv: \d+ steps, exposure 1.000, at most [0-3]\.\d\d mm from the path$
out ^2 demonstrations, \d+ steps, mean score 1.000: robot.hdf5$
$ omentum rl train -t retract -s move_mm=2 -m clone -d robot.hdf5 --clone-epochs 2 -q -o robot
exit 0
out ^policy: robot/policy.safetensors$


# bad input
write broken.csv
    time,x,y,z
    0,-0.05,0.004,0.04
    1,-0.046,none,0.022
$ omentum rl demo -t retract --from broken.csv -o none.hdf5
exit 3
err broken.csv:3: y: "none" is no number
no-file none.hdf5
write far.csv
    time,x,y,z
    0,-0.05,0.004,0.04
    1,-0.05,0.004,0.4
$ omentum rl demo -t retract --from robot.csv --from far.csv -o none.hdf5
exit 3
err far.csv:3: the tip at \(-0.05, 0.004, 0.4\) m is outside the workspace
no-file none.hdf5
write short.csv
    time,x,y,z
    0,-0.05,0.004,0.04
    1,-0.05,0.004,0.06
$ omentum rl demo -t retract --from short.csv -o none.hdf5
exit 3
err short.csv: the path does not solve task retract: its score is 0.000, below 0.95 \(exposure 0, grasped 0
no-file none.hdf5
$ omentum rl demo -t retract --from short.csv --least-score 0 -o kept.hdf5
exit 0
out ^1 demonstrations
$ omentum rl demo -t cart-pole --from short.csv -o none.hdf5
exit 3
err task cart-pole has no tip that follows a table
$ omentum rl demo -t retract --from robot.csv -o robot.csv
exit 3
err robot.csv
$ omentum rl demo -t retract --from nowhere.csv -o none.hdf5
exit 3
err nowhere.csv
$ omentum rl demo -t retract --from robot.csv -n 3 -o none.hdf5
exit 2
err --number is of the expert
