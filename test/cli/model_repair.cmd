# omentum model: damaged surfaces are mended with one meaning, each with a note; see model_input.cmd for refusals.
copy make_surfaces.py
$ python3 make_surfaces.py
exit 0

# Each defect alone.
$ omentum model --no-bending --edge 6 inward.stl -q -o inward
exit 0
out volume 3[23]\.\d+ mL
out note: the surface has 1 part inside out \(its triangles face inwards\), at \(.*\) mm: it is turned
$ omentum model --no-bending --edge 6 mixed.stl -q -o mixed
exit 0
out volume 3[23]\.\d+ mL
out note: the surface has 30 triangles wound against their neighbours, the first at \(.*\) mm: they are turned
$ omentum model --no-bending --edge 6 again.stl -q -o again
exit 0
out volume 3[23]\.\d+ mL
out note: the surface has 30 triangles that occur again, the first at \(.*\) mm: they are dropped
$ omentum model --no-bending --edge 6 hole.stl -q -o hole
exit 0
out volume 3[23]\.\d+ mL
out note: the surface has 1 hole, at \(.*\) mm: it is filled, the largest \d\.\d+ mm across
$ omentum model --no-bending --edge 6 flat.stl -q -o flat
exit 0
out note: the surface has 1 triangle that names a vertex twice, at \(.*\) mm: it is dropped

# Few triangles, one too many: above a tenth of them only --repair mends; a hole as large as the body likewise.
$ printf 'OFF\n5 5 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n40 40 40\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n3 0 1 4\n' > fin.off; omentum model --no-bending --repair fin.off -q -o fin
exit 0
out volume 4\.\d+ mL
out note: the surface has 1 triangle of a fin or an inner wall
$ printf 'OFF\n4 3 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n3 0 2 1\n3 0 1 3\n3 0 3 2\n' > open.off; omentum model --no-bending --repair open.off -q -o open
exit 0
out volume 4\.\d+ mL
