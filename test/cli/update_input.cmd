# omentum update: every bad input has a sentence. A twin of few elements.
copy small.yaml
write lift.yaml
    cloud: bump.csv
    unit: mm
    tools:
      - arm: psm1
        grasp: {position_mm: [-50, 0, 5]}
        now: {position_mm: [-50, 0, 35]}
        radius_mm: 15

# A bump of 30 mm around the grasp.
$ awk 'BEGIN { print "x,y,z"; for (i = -58; i <= 58; i += 4) for (j = -58; j <= 58; j += 4) print i "," j "," 5 + 30 * exp(-((i + 50)^2 + j^2) / 1600) }' > bump.csv
exit 0

# Clouds that cannot be used.
$ sed 's/unit: mm/unit: m/' lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err a\.yaml: the scan is 9[0-9]* times larger than the model
err-lines 1
$ echo x,y,z > empty.csv; sed s/bump/empty/ lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err a\.yaml: cloud: .*empty\.csv: the file has no points
$ printf 'x,y,z\nnan,0,0\n0,nan,0\n' > nan.csv; sed s/bump/nan/ lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err none of its 2 points is finite
$ awk -F, 'NR == 1 { print; next } { print $1 + 900 "," $2 "," $3 }' bump.csv > far.csv; sed s/bump/far/ lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err the scan lies 782\.0 mm away from the model
$ sed s/bump/none/ lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err a\.yaml: cloud: .*none\.csv: cannot open

# Files that cannot be used.
$ sed 's/unit: mm/units: mm/' lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err a\.yaml:2: acquisition: unknown key "units"; did you mean "unit"
$ grep -v -E 'tools|arm|grasp|now|radius' lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err a\.yaml: tools: no tool holds the tissue
$ sed 's/\[-50, 0, 5\]/[-500, 0, 5]/' lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err no vertex of the twin within 15\.0 mm of the grasp
$ echo 'mesh: none.vtu' > p.yaml; omentum update p.yaml lift.yaml -q -o a
exit 3
err p\.yaml:1: patient: "name" is missing
$ omentum update none.yaml lift.yaml -q -o a
exit 3
err none\.yaml: cannot open

# The command line.
$ omentum update small.yaml -o a
exit 2
err at least one acquisition
$ omentum update small.yaml lift.yaml
exit 2
err add -o DIR
$ omentum update small.yaml lift.yaml --outptu a
exit 2
err did you mean --output
$ omentum update small.yaml lift.yaml -q -o .
exit 3
$ omentum update --example
exit 0
out ^cloud: lift\.ply
out ^registered: yes
out position_mm
no-err
