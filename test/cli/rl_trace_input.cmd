# omentum rl demo --from: wrong input.
write robot.csv
    # exported
    time,x,y,z
    0,-0.05,0.004,0.04
    1,-0.046,0.001,0.022
    2,-0.02,0.002,0.075
    3,0,0,0.095
write short.csv
    time,x,y,z
    0,-0.05,0.004,0.04
    1,-0.05,0.004,0.06
write broken.csv
    time,x,y,z
    0,-0.05,0.004,0.04
    1,-0.046,none,0.022
$ omentum rl demo -t retract --from broken.csv -o none.hdf5
exit 3
err broken.csv:3: y: "none" is no number
no-file none.hdf5
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
