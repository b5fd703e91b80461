# omentum rl demo --from: paths that do not solve the task, or leave the workspace. To make the task takes 0.5 s each time.
write robot.csv
    # exported
    time,x,y,z
    0,-0.05,0.004,0.04
    1,-0.046,0.001,0.022
    2,-0.02,0.002,0.075
    3,0,0,0.095
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
$ omentum rl demo -t retract -s move_mm=2 --from robot.csv -o none.hdf5
exit 3
err robot.csv:\d+: the tip of task retract is 2\.\d+ mm from the path, at most 2.00 mm: moves of the task are long
no-file none.hdf5
