# omentum model: a mesh that loses a part of the label ends with exit code 1 and says where; finer edges keep it.
$ (printf 'NRRD0004\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: 36 28 26\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: ascii\n\n'; awk 'BEGIN { for (k = 0; k < 26; k++) for (j = 0; j < 28; j++) for (i = 0; i < 36; i++) { cube = i >= 5 && i < 21 && j >= 5 && j < 21 && k >= 5 && k < 21; handle = k == 12 && i < 30 && ((i >= 21 && (j == 6 || j == 17)) || (i == 29 && j > 5 && j < 18)); print (cube || handle) ? 1 : 0 } }') > handle.nrrd
exit 0
$ omentum model --no-bending handle.nrrd --edge 4 --no-refine -q -o lost
exit 1
err the mesh is not the label; 0\.02\d* mL missing at \(29\.0, 1\d\.0, 12\.0\) mm, up to [89]\S* mm from the mesh's surface; handles: 1 of the label, 0 of the mesh; use an edge below 2\.4 mm, or add --allow-loss
file lost/patient.yaml
file lost/report.html
$ omentum model --no-bending handle.nrrd --edge 4 --no-refine --allow-loss -q -o lost; cat lost/report.json
exit 0
out "has_loss": true
out "kind": "missing"
$ omentum model --no-bending handle.nrrd --edge 4 -q -o kept; cat kept/report.json
exit 0
out from the label's surface to the mesh: 0\.\d+ mm \(mean\), 0\.\d+ \(95 %\), \d\.\d+ \(largest
out 1 part, 1 handle, 0 cavities, as the label
out "has_loss": false
out "handles": 1
