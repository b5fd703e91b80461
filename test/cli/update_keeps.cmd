# omentum update: scans after which a twin keeps its attachments.
write small.yaml
    name: small
    tissue:
      source: sheet
      element: linear
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

# Every point twice is no error.
$ sed 1d bump.csv | cat bump.csv - > twice.csv; sed s/bump/twice/ lift.yaml > a.yaml; omentum update small.yaml a.yaml -q -o a
exit 1
