# omentum umesh predict: units and signs of what is asked and answered, by a small network.
$ omentum umesh generate --elements 200 --points 8x8x8 -n 8 --workers 1 -q -o data && $OMENTUM umesh train -d data -o net --levels 1 --epochs 1 --validation 2 -q > /dev/null
exit 0
# The probe is symmetric: half a turn is no turn.
$ P=omentum; for t in 0 180; do $P umesh predict -w net/weights.safetensors --at 20,0,70 --press 10 --tolerance 0.005 --turn $t --point 20,0,60 --workers 1 | grep -v "a prediction" > turn$t.txt || exit 1; done; cmp turn0.txt turn180.txt && cat turn0.txt
exit 0
out ^probe at \(1\d\.\d, -?\d\.\d, [67]\d\.\d\) mm, 10\.0 mm deep
out ^refined by \d+ cycles; about 0\.00[0-4]\d* mm remain to equilibrium
# Pressed in from above, a point some way below goes down, by less than the probe.
out ^point \(20,0,60\) mm moves by \(-?[0-4]\.\d\d, -?[0-3]\.\d\d, -[3-9]\.\d\d\), [3-9]\.\d\d mm$
