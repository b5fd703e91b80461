# omentum dvrk --instrument, --arm: instruments of the dVRK's own form, here of five joints without a jaw
copy small.yaml
write SHORT_HOOK_400999.json
    { // as share/tool/*.json
      "DH": {"convention": "modified", "joints": [
        {"name": "roll", "alpha": 0, "A": 0, "theta": 0, "D": 0.4162, "type": "revolute", "mode": "active", "offset": 0, "qmin": -4.5, "qmax": 4.5},
        {"name": "wrist_pitch", "alpha": -1.5708, "A": 0, "theta": 0, "D": 0, "type": "revolute", "mode": "active", "offset": -1.5708, "qmin": -1.3, "qmax": 1.3}]},
      "tooltip_offset": [[0, 0, 1, 0.01], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]
    }
write snake.json
    {"DH": {"convention": "modified", "joints": [1, 2, 3, 4, 5]}}
$ omentum dvrk small.yaml --domain 93 --time 0.1 --rate 50 --instrument SHORT_HOOK_400999.json
exit 0
out PSM1 and PSM2 on domain 93

$ omentum dvrk small.yaml --domain 93 --time 0.1 --instrument snake.json
exit 3
err snake.json: "joints" has 5 joints; an instrument has roll and at most two of a wrist
$ omentum dvrk small.yaml --domain 93 --time 0.1 --instrument none.json
exit 3
err none.json
