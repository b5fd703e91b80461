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
