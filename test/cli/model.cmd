# omentum model: from a label map to a patient model; ready meshes, units and spaces.
$ (printf 'NRRD0004\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: 24 24 24\nspace directions: (3,0,0) (0,3,0) (0,0,3)\nspace origin: (-80,-35,-35)\nencoding: ascii\n\n'; awk 'BEGIN { for (k = 0; k < 24; k++) for (j = 0; j < 24; j++) for (i = 0; i < 24; i++) print ((i-11.5)^2 + (j-11.5)^2 + (k-11.5)^2 < 80) ? 7 : 0 }') > ball.nrrd
exit 0

$ omentum model ball.nrrd --label 7 --edge 7 -q -o ball
exit 0
out ^ball: \d+ tetrahedra
out dihedral angles
out ^bending error of this mesh: [0-9.]+ %$
no-err
file ball/patient.yaml
file ball/tissue.vtu
file ball/report.json
file ball/report.html
no-file ball/organ.ply
$ ls -A | grep '^\.'
exit 1

# A ready mesh is used as it is.
$ omentum model --no-bending ball/tissue.vtu --unit m -q -o mesh
exit 0
file mesh/patient.yaml

# ... or meshed anew.
$ omentum model --no-bending ball/tissue.vtu --unit m --remesh --edge 9 -q -o coarse
exit 0
out edges [\d.]+ mm \(smallest\), [78]\.\d+ \(mean\), [\d.]+ \(largest\)$

# Our files state unit and space; a unit that is given is believed, and a size that no organ has is told.
$ omentum model --no-bending mesh/tissue.vtu -q -o stated
exit 0
out volume 8\d\.\d+ mL
$ omentum model --no-bending mesh/tissue.vtu --unit mm -q -o tiny
exit 0
out note: the file says that a unit is 1000 mm, and is read with 1 mm, as was told
out note: the body is 0\.0\d+ mm long and has .* mL: an organ has 10 to 600 mm and 0\.1 to 20000 mL.*; --unit m makes it 5\d\.\d+ mm
file tiny/patient.yaml
