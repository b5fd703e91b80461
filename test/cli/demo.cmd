# omentum demo: from a CT made here to an exposed tumour.
$ omentum demo --quick -q -o demo
exit 0
out ^CT: \d+ x \d+ x \d+ voxels; labels by thresholds, Dice: fat 0\.9\d+, organ 0\.9\d+, tumour 0\.[89]\d+$
out ^model: \d+ tetrahedra, [+-][0-4]\.\d % of the label's volume, held at \d+ vertices
out ^plan before the operation: point
out ^demo: \d+ % of the ROI exposed
out report: demo/report\.html
file demo/report.html
file demo/ct.nrrd
file demo/labels.nrrd
file demo/scene.yaml
file demo/plan.json
file demo/model/report.html
file demo/run/report.html
file demo/run/orbit.png

# the page leads to the run's
$ grep -c 'href="run/report.html"' demo/report.html
exit 0
out ^1$

# the organ that gives way, and what lies on it
$ grep -c 'Pressure of the tissue on the organ at' demo/run/report.html
exit 0
out ^[1-9]

$ grep -A9 '^organ:' demo/scene.yaml
exit 0
out deforms: truth

# Its scenes name data that is there, from another folder and after the demo has moved.
$ mv demo moved && mkdir other && cd other && for f in scene run/scene run/belief; do $OMENTUM retract ../moved/$f.yaml --dry-run -q || exit; done | grep -c 'the scene can be run'
exit 0
out ^3$
no-err

$ omentum demo --slow
exit 2
err-lines 1
