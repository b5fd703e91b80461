# omentum model: surfaces of few triangles, of which the damage is a large part.
# Few triangles, one too many: above a tenth of them only --repair mends; a hole as large as the body likewise.
$ printf 'OFF\n5 5 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n40 40 40\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n3 0 1 4\n' > fin.off; omentum model --no-bending --repair fin.off -q -o fin
exit 0
out volume 4\.\d+ mL
out note: the surface has 1 triangle of a fin or an inner wall
$ printf 'OFF\n4 3 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n3 0 2 1\n3 0 1 3\n3 0 3 2\n' > open.off; omentum model --no-bending --repair open.off -q -o open
exit 0
out volume 4\.\d+ mL
