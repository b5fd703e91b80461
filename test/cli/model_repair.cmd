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
