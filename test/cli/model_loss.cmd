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
out from the surface of the input to the mesh: 0\.\d+ mm \(mean\), 0\.\d+ \(95 %\), \d\.\d+ \(largest
out 1 part, 1 handle, 0 cavities, as the input
out "has_loss": false
out "handles": 1

# A surface: a box of 30 mm with a fin 1 mm thick, thinner than the first distance field can see.
$ awk 'function box(a,b,c,d,e,f) { for (k = 0; k < 8; k++) v[n++] = (k % 2 ? d : a) " " (int(k / 2) % 2 ? e : b) " " (k > 3 ? f : c) } BEGIN { box(0,0,0,30,30,30); box(29,5,14.3,45,25,15.3); print "OFF\n16 24 0"; for (i = 0; i < 16; i++) print v[i]; split("0 2 1 1 2 3 4 5 6 5 7 6 0 1 4 1 5 4 2 6 3 3 6 7 0 4 2 2 4 6 1 3 5 3 7 5", t, " "); for (b = 0; b < 16; b += 8) for (i = 1; i <= 36; i += 3) print 3, t[i] + b, t[i + 1] + b, t[i + 2] + b }' > fin.off; omentum model --no-bending fin.off --edge 5 --no-refine -q -o lost
exit 1
err the mesh is not the surface; 0\.\d+ mL missing at \(4\d\.\d, .*, up to 1\d mm from the mesh's surface; use an edge below 3 mm
$ omentum model --no-bending fin.off --edge 5 -q -o kept
exit 0
out volume 27\.[23]\d* mL
out 1 part, 0 handles, 0 cavities, as the input
