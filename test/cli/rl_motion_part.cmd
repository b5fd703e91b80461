# omentum rl demo --begin, --end: a part of a recording is the same part of its table; what is refused.

write lift.csv
    time,x,y,z
    100.0,-0.05,0.004,0.04
    100.1,-0.049600000000000005,0.0037,0.0382
    100.2,-0.0492,0.0034000000000000002,0.0364
    100.3,-0.0488,0.0031000000000000003,0.0346
    100.4,-0.0484,0.0028,0.032799999999999996
    100.5,-0.048,0.0025,0.031
    100.6,-0.0476,0.0022,0.0292
    100.7,-0.0472,0.0019000000000000002,0.0274
    100.8,-0.0468,0.0015999999999999999,0.025599999999999998
    100.9,-0.0464,0.0013,0.023799999999999998
    101.0,-0.046,0.001,0.022
    101.1,-0.0434,0.0011,0.027299999999999998
    101.2,-0.0408,0.0012000000000000001,0.0326
    101.3,-0.0382,0.0013,0.037899999999999996
    101.4,-0.0356,0.0014,0.0432
    101.5,-0.033,0.0015,0.0485
    101.6,-0.0304,0.0015999999999999999,0.053799999999999994
    101.7,-0.027800000000000002,0.0017000000000000001,0.05909999999999999
    101.8,-0.0252,0.0018,0.0644
    101.9,-0.0226,0.0019000000000000002,0.0697
    102.0,-0.02,0.002,0.075
    102.1,-0.018000000000000002,0.0018,0.077
    102.2,-0.016,0.0016,0.079
    102.3,-0.014,0.0014000000000000002,0.081
    102.4,-0.012,0.0012000000000000001,0.083
    102.5,-0.01,0.001,0.08499999999999999
    102.6,-0.008,0.0008000000000000001,0.087
    102.7,-0.006000000000000002,0.0006000000000000001,0.089
    102.8,-0.004,0.00039999999999999996,0.091
    102.9,-0.0019999999999999983,0.00019999999999999987,0.093
    103.0,0.0,0.0,0.095
$ omentum rl demo -t retract -s move_mm=2 --from $ROOT/fuzz/corpus/dds_motion/lift.mcap --arm PSM2 --begin 0.5 --end 2.95 --deviation 3 --least-score 0 -o part.hdf5
exit 0
out lift.mcap: \d+ steps
$ omentum rl demo -t retract -s move_mm=2 --from lift.csv --begin 0.5 --end 2.95 --deviation 3 --least-score 0 -q -o part_of_table.hdf5
exit 0
$ cmp part.hdf5 part_of_table.hdf5
exit 0
$ omentum rl demo -t retract -s move_mm=2 --from lift.csv --from lift.csv --begin 1 -o none.hdf5
exit 3
err --begin is given 1 times and --from 2 times: give one for each, or none
$ omentum rl demo -t retract -s move_mm=2 --from lift.csv --begin 2 --end 2.05 -o none.hdf5
exit 3
err lift.csv: 1 poses from 2 s to 2.05 s, a path needs at least two; it has 31 in 3.000 s
# numbers are those of the file's messages: the sixth pose is there twice, so the last is message 32
write end.json
    {"frames": [{"name": "task", "position_mm": [0, 0, -15.01], "quaternion_xyzw": [0, 0, 0, 1]}]}
$ omentum rl demo -t retract -s move_mm=2 --from $ROOT/fuzz/corpus/dds_motion/lift.mcap --arm PSM2 --frames end.json -o none.hdf5
exit 3
err lift.mcap: message 32 of /PSM2/measured_cp: the tip at .* is outside the workspace
