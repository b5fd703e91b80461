# omentum update: attachments of a twin from clouds; every bad input has a sentence.
write small.yaml
    name: small
    tissue:
      source: sheet
      cells: [8, 8, 1]
      world_cells: [12, 12, 1]
    attachments:
      kind: box
      lo_mm: [10, -100, -1]
      hi_mm: [100, 100, 1]
    roi:
      random: false
      center_mm: [-40, -30, 0]
write lift.yaml
    cloud: bump.csv
    unit: mm
    tools:
      - arm: psm1
        grasp: {position_mm: [-50, 0, 5]}
        now: {position_mm: [-50, 0, 35]}
        radius_mm: 11

# What a run recorded: tissue held on one side is lifted on the other. A twin that believes in no attachment finds some,
# by physics alone.
$ (cat small.yaml; echo 'believed_attachments: {kind: none}'; echo 'task: {max_actions: 5, grasp_radius_mm: 11}') > free.yaml; $OMENTUM retract free.yaml --record-acquisitions -q -o run > /dev/null; $OMENTUM update free.yaml run/acquisitions/001.yaml --network none -q -o out
exit 0
out free\.yaml: the twin takes the new attachments$
out cloud to twin: median [0-9.]+ mm before, [0-9.]+ mm after; 90 % [0-9.]+ mm before, [0-9.]+ mm after$
out report: out/report\.html$
no-err
$ ls out && grep -c '"is_accepted": true' out/update.json && grep -o 'Name="[a-z]*"' out/attachments.vtu | sort | uniq -c
exit 0
out ^attachments\.vtu$
out ^report\.html$
out ^update\.json$
out ^1$
out Name="probability"
out Name="uncertainty"
out Name="stiffness"
out Name="attached"
out Name="displacement"
$ grep -c 'The twin takes the new attachments' out/report.html
exit 0
$ grep -E '"attached_vertices": [1-3][0-9],' out/update.json
exit 0

# The network that comes along is used, and attaches more than physics does. How near to the truth is held by
# test_banet_update: on this mesh, three times coarser than the bodies of training, both estimates fail.
$ omentum update free.yaml run/acquisitions/001.yaml -q -o net
exit 0
out free\.yaml: the twin takes the new attachments$
out network: 1 of 1 acquisitions; the attachments are those of
no-err
$ n() { sed -n 's/.*"attached_vertices": \([0-9]*\),/\1/p' $1/update.json; }; test $(n net) -gt $(n out) && test $(n net) -le 36
exit 0
$ omentum update free.yaml run/acquisitions/000.yaml run/acquisitions/001.yaml --json -q -o out
exit 0
out "acquisitions": 2,
out "accepted": 1,

# A twin that believes rightly keeps its attachments.
$ sed 's/kind: none/kind: same/' free.yaml > right.yaml; $OMENTUM update right.yaml run/acquisitions/001.yaml -q -o right
exit 1
out right\.yaml: the twin keeps its attachments: the updated twin is no closer to the scan

# A bump of 30 mm around the grasp.
$ awk 'BEGIN { print "x,y,z"; for (i = -58; i <= 58; i += 4) for (j = -58; j <= 58; j += 4) print i "," j "," 5 + 30 * exp(-((i + 50)^2 + j^2) / 1600) }' > bump.csv
exit 0

# The same bytes again, and with two workers, but for the times.
$ for n in 1 2; do $OMENTUM update free.yaml run/acquisitions/001.yaml --workers $n -q -o w$n > /dev/null; done; cmp w1/attachments.vtu w2/attachments.vtu && echo same
exit 0
out ^same$

# The tool did not move: the twin keeps its attachments.
$ sed 's/, 35\]/, 5]/' lift.yaml > still.yaml; omentum update small.yaml still.yaml -q -o still
exit 1
out the twin keeps its attachments: the grasp moved by 0\.0 mm only
no-err
$ cat still/update.json
exit 0
out "is_accepted": false
out "reason": "the grasp moved

# Another organ, which no registration fits.
$ awk 'BEGIN { print "x,y,z"; for (k = 0; k < 600; k++) { z = 1 - (2 * k + 1) / 600; r = sqrt(1 - z * z); a = k * 2.39996; print 40 * r * cos(a) "," 30 * r * sin(a) "," 30 * z } }' > ball.csv; (sed s/bump/ball/ lift.yaml; echo 'registered: no') > ball.yaml; omentum update small.yaml ball.yaml -q -o ball
exit 1
out the twin keeps its attachments: ball\.yaml cannot be registered
$ ls ball
exit 0
out ^report\.html$

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

# Every point twice is no error.
$ sed 1d bump.csv | cat bump.csv - > twice.csv; sed s/bump/twice/ lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 1

# Files that cannot be used.
$ sed 's/unit: mm/units: mm/' lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err a\.yaml:2: acquisition: unknown key "units"; did you mean "unit"
$ grep -v -E 'tools|arm|grasp|now|radius' lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err a\.yaml: tools: no tool holds the tissue
$ sed 's/\[-50, 0, 5\]/[-500, 0, 5]/' lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 3
err no vertex of the twin within 11\.0 mm of the grasp
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
