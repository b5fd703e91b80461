# omentum model --sheet: a sheet over an organ.
$ (printf 'NRRD0004\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: 24 24 24\nspace directions: (3,0,0) (0,3,0) (0,0,3)\nspace origin: (-80,-35,-35)\nencoding: ascii\n\n'; awk 'BEGIN { for (k = 0; k < 24; k++) for (j = 0; j < 24; j++) for (i = 0; i < 24; i++) print ((i-11.5)^2 + (j-11.5)^2 + (k-11.5)^2 < 80) ? 7 : 0 }') > ball.nrrd
exit 0

$ omentum model --no-bending ball.nrrd -l 7 -e 7 -q -o ball
exit 0

# The sheet, over the model that is there; two runs write the same bytes.
$ omentum model --no-bending ball.nrrd -l 7 -e 9 --sheet thickness=8,side=anterior --attach "border:medial 25%" --attach "underside:random 10% seed 3" --tumour radius=10,height=2 -q -o ball
exit 0
out sets: underside \d+, top \d+, border \d+, attachment \d+ vertices; region of interest: 200 points
file ball/organ.ply
$ ls -A | grep '^\.'
exit 1
$ omentum model --no-bending ball.nrrd -l 7 -e 9 --sheet thickness=8,side=anterior --attach "border:medial 25%" --attach "underside:random 10% seed 3" --tumour radius=10,height=2 -q --threads 1 -o again && cmp ball/tissue.vtu again/tissue.vtu && cmp ball/patient.yaml again/patient.yaml && cmp ball/organ.ply again/organ.ply
exit 0

# A ready surface, through its distance field; its unit is metres.
$ omentum model --no-bending ball/organ.ply --unit m --edge 6 -q -o surface
exit 0
file surface/tissue.vtu

$ omentum model --no-bending --list ball/tissue.vtu
exit 0
out ^ball/tissue\.vtu: \d+ tetrahedra, \d+ vertices
out ^unit 1000 mm \(stated by the file\), RAS \(stated by the file\)
out ^ +0 +\d+ +\d+\.\d+|^ +7 +\d+ +\d+\.\d+
out ^set underside: \d+ vertices
$ omentum model --no-bending --list ball/organ.ply --unit cm --space lps
exit 0
out triangles, \d+ vertices in 1 part, closed
out ^unit 10 mm \(as was told\), LPS \(as was told\)
