# omentum layouts, search, calibrate-force: many layouts, and limits found on them.
copy small.yaml

# A coarse grid: few grasping points to try.
$ (cat small.yaml; echo '  grid: 3') > coarse.yaml
exit 0

# Layouts in a row.
$ omentum layouts small.yaml -q --count 2 -o many
exit 0
out ^ 1  exposed
out ^ 2  exposed
out 2 of 2 layouts exposed
file many/layout-01/report.html
file many/layout-02/report.html

# Layouts from another one on; what could expose the ROI at all.
$ omentum layouts small.yaml -q --count 1 --first 18 -o later
exit 0
out ^18  exposed
file later/layout-18/report.html

$ omentum search coarse.yaml -q --layout 2
exit 0
out ^small, layout 2: [1-9]\d* of [1-9]\d* sequences of \d+ grasps expose the ROI; largest visibility: \d+ %, block \(\d,\d\) lifted

$ omentum calibrate-force coarse.yaml -q --count 1
exit 0
out largest pull of 6 grasps of free tissue in 1 layouts: median
out ^3 grasps above attachments
out ^force_threshold: \d
out ^force_margin: \d

$ omentum calibrate-force coarse.yaml -q --count 1 --young 2,0.5
exit 3
err --young: "2,0.5" is not of the form LO,HI

# A key that is gone: the reason and the remedy.
$ sed -e 's/  source: sheet/  source: sheet\n  mesh_factor: 0.5/' small.yaml > factor.yaml && omentum retract factor.yaml -q --dry-run
exit 3
err factor\.yaml:\d+: tissue: mesh_factor is gone: the default `element` bends as the tissue does; delete the line
