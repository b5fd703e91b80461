# omentum update: two acquisitions; a twin that keeps its attachments.
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

# What the run of update.cmd recorded: lifted/.
$ mkdir run && cp -r $ROOT/test/cli/lifted run/acquisitions && (cat small.yaml; echo 'believed_attachments: {kind: none}'; echo 'task: {max_actions: 4, grasp_radius_mm: 11, speed_mm_s: 200}') > free.yaml
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
