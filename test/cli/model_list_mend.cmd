# omentum model --list: of damaged surfaces and meshes, what a model would mend, in its words, or why it would refuse.
copy make_surfaces.py
$ python3 make_surfaces.py
exit 0
$ omentum model --no-bending --list again.stl
exit 0
out ^again\.stl: \d+ triangles, \d+ vertices in \d+ parts?, mended as the notes say
out A x S\), 3[23]\.\d+ mL
out ^note: the surface has 30 triangles that occur again, the first at \(.*\) mm: they are dropped
$ omentum model --no-bending --list hole.stl
exit 0
out mended as the notes say
out ^note: the surface has 1 hole, at \(.*\) mm: it is filled, the largest \d\.\d+ mm across
$ omentum model --no-bending --list flat.stl
exit 0
out ^note: the surface has 1 triangle that names a vertex twice, at \(.*\) mm: it is dropped
# Closed, and its volume counted once.
$ omentum model --no-bending --list union.stl
exit 0
out in 2 parts, closed
out A x S\), 59\.\d+ mL
out ^note: the surface has \d+ pairs of triangles that cross, .*; 6\.\d+ mL in more than one part count once
# Refused, by default or by --strict.
$ printf 'OFF\n4 3 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n3 0 2 1\n3 0 1 3\n3 0 3 2\n' > open.off; omentum model --no-bending --list open.off
exit 0
out ^open\.off: 3 triangles, 4 vertices in 1 part, not closed
out A x S\)$
out ^note: a model of it is refused: the surface is open: 1 hole larger than
$ omentum model --no-bending --list open.off --repair
exit 0
out mended as the notes say
out A x S\), 4\.\d+ mL
$ omentum model --no-bending --list hole.stl --strict
exit 0
out not closed
out ^note: a model of it is refused: the surface has 1 hole, .*; without --strict it is mended
# Meshes: a tetrahedron inside out; two whose common face has vertices of its own.
$ printf '# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n0 0 0 30 0 0 0 30 0 0 0 30 30 0 0 0 30 0 0 0 30 30 30 30\nCELLS 2 10\n4 0 2 1 3\n4 4 5 6 7\nCELL_TYPES 2\n10 10\n' > two.vtk; omentum model --no-bending --list two.vtk
exit 0
out ^two\.vtk: 2 tetrahedra, 5 vertices
out ^note: 1 tetrahedron is inside out .*: turned by exchanging two vertices
out ^note: 1 pairs of faces lay on each other .*: 3 vertices are welded
$ omentum model --no-bending --list two.vtk --keep-cracks
exit 0
out ^two\.vtk: 2 tetrahedra, 8 vertices
$ omentum model --no-bending --list two.vtk --strict
exit 3
err two\.vtk: tetrahedron 1 is inverted
