# omentum dvrk: what it refuses, a field that ends by itself, and a robot that is not there.
copy small.yaml
$ omentum dvrk
exit 2
err no scene is given

$ omentum dvrk small.yaml --domain 233
exit 2
err --domain

$ omentum dvrk small.yaml --network '"/>'
exit 3
err is no interface

$ omentum dvrk small.yaml --domain 91 --time 0.1 --rate 50 --json
exit 0
out "time_s": 0\.1
err PSM1 and PSM2 on domain 91

$ omentum dvrk small.yaml --domain 91 --time 0.1 --rate 50 --record run.mcap
exit 0
file run.mcap

$ omentum dvrk small.yaml --domain 91 --time 0.1 --rate 50 --record run.mcap
exit 3
err a recording needs a new file

$ omentum dvrk small.yaml --domain 91 --time 0.1 --arms PSM2,PSM3
exit 0
out small, layout 1: PSM2 and PSM3 on domain 91

$ omentum dvrk small.yaml --domain 91 --time 0.1 --arms PSM2
exit 3
err --arms "PSM2": give two names with a comma

$ omentum dvrk small.yaml --domain 91 --time 0.1 --arms PSM2,PSM2
exit 3
err "PSM2", as another arm

$ omentum retract small.yaml --depth kinect -o out
exit 3
err option --depth needs --world dds

$ omentum retract small.yaml --world dds --domain 92 --arms 'PSM2,a b' -o out
exit 3
err arm\[1\] is no name

$ omentum retract small.yaml --world mars -o out
exit 3
err it is simulated or dds

$ omentum retract small.yaml --domain 3 -o out
exit 3
err option --domain needs --world dds

# before the plan, which takes a minute
$ omentum retract small.yaml --world dds --domain 92 --defras -o out
exit 3
err nothing usable on topic /PSM1/measured_cp of domain 92
no-file out
