# A person at the terminal: lines of standard input are commands.
write small.yaml
    name: small
    tissue:
      source: sheet
      cells: [6, 6, 1]
      world_cells: [9, 9, 1]
    attachments:
      kind: box
      lo_mm: [10, -100, -1]
      hi_mm: [100, 100, 1]
    roi:
      random: false
      center_mm: [-40, -30, 0]
    endoscope: {distance_mm: 200, elevation_deg: 45, fov_deg: 60, width: 80, height: 60}
    rgbd: {width: 96, height: 72}
    task:
      force_threshold: 3
      grasp_radius_mm: 15
      speed_mm_s: 50
      visibility: 0.6

# Consent to the second plan; what cannot be understood is answered and changes nothing.
$ printf 'no\nhalt\nforbid 9 9\nyes\n' | omentum retract small.yaml -q -o run --supervise --approve
exit 0
out of the ROI exposed after
err plan 1
err may this plan begin\? yes or no
err plan 2
err "halt" is no command; say pause, go
err forbid needs a block: two numbers from 1 to 5

# Nobody answers: the operation ends, and nothing was done.
$ omentum retract small.yaml -q -o run2 --supervise --approve < /dev/null
exit 1
out aborted after 0 actions
err nobody answers: the operation ends

# A pause waits for go.
$ printf 'pause\ngo\n' | omentum retract small.yaml -q -o run3 --supervise
exit 0
out of the ROI exposed after

$ omentum retract small.yaml -q -o run4 --approve
exit 2
err --approve needs --supervise

# The whole of chapter 6 on one small sheet.
$ omentum retract small.yaml -q -o run5 --defras
exit 0
out ^plan before the operation: point \(\d,\d\), PSM1
out of the ROI exposed after
out ^  twin: at most \d+\.\d mm from the tissue in \d+ frames

# The same plan from a file; the report names where it comes from.
$ omentum preplan small.yaml -q -o before
exit 0
$ omentum retract small.yaml -q -o run6 --plan before/plan.json
exit 0
$ grep -c 'It was made before the operation' run6/report.html
exit 0
out ^1$
