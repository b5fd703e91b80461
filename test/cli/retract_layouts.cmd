# omentum layouts, search, calibrate-force, calibrate-mesh: many layouts, and limits found on them.
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
out largest pull of 9 grasps in 1 layouts
out ^force_threshold: \d
out ^force_margin: \d

# How much too stiffly the twin's mesh bends; in the scene the factor lowers the twin's modulus, and no other's.
$ omentum calibrate-mesh small.yaml -q
exit 0
out ^small: under its own weight the twin's mesh of \d+ tetrahedra yields [1-9]\d % as much as the same mesh refined
out ^mesh_factor: 0\.[1-9]\d*  # under

$ sed -e 's/  source: sheet/  source: sheet\n  mesh_factor: 1.5/' small.yaml > factor.yaml && omentum retract factor.yaml -q --dry-run
exit 3
err mesh_factor.*1\.5.*0\.01 to 1
