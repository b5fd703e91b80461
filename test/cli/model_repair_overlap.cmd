# omentum model: surfaces that cross, overlap or lie in each other.
copy make_surfaces.py
$ python3 make_surfaces.py
exit 0

# Two balls that overlap are their union, 60.3 mL of 33.5 and 33.5 (flat triangles lack 1.4 %); not blown up.
$ omentum model --no-bending --edge 8 union.stl -q -o union
exit 0
out volume (57|58|59|60)\.\d+ mL
out note: the surface has \d+ pairs of triangles that cross, the first at \(.*\) mm: the body is the union; 6\.\d+ mL in more than one part count once
$ omentum model --no-bending --strict union.stl -q -o none
exit 3
err union\.stl: the surface has \d+ pairs of triangles that cross, the first at

# A ball in a ball: the same winding is filled, the opposite one a cavity of 4.2 mL.
$ omentum model --no-bending --edge 10 filled.stl -q -o filled
exit 0
out volume 3[123]\.\d+ mL
out note: the surface has 1 part within a part that is wound the same way, at \(.*\) mm: it counts as filled; a cavity is wound the other way round
$ omentum model --no-bending --edge 9 cavity.stl -q -o cavity
exit 0
out volume (27|28|29)\.\d+ mL

# A cap that is pushed through the bottom.
$ omentum model --no-bending --edge 12 cross.stl -q -o cross
exit 0
out note: the surface has \d+ pairs of triangles that cross, the first at
out the first at .* mL where the surface is folded inside out are left out
