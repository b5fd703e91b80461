# omentum model: damaged surfaces and meshes are mended with one meaning, each with a note; see model_input.cmd for refusals.
write make.py
    import math, sys
    def sphere(c, r, n=16):
        """Triangles of a sphere, outward."""
        p = lambda i, j: (c[0] + r * math.sin(math.pi * i / n) * math.cos(math.pi * j / n),
                          c[1] + r * math.sin(math.pi * i / n) * math.sin(math.pi * j / n), c[2] + r * math.cos(math.pi * i / n))
        out = []
        for i in range(n):
            for j in range(2 * n):
                a, b, d, e = p(i, j % (2 * n)), p(i + 1, j), p(i + 1, (j + 1) % (2 * n)), p(i, (j + 1) % (2 * n))
                if i == 0: a = e = (c[0], c[1], c[2] + r)
                if i == n - 1: b = d = (c[0], c[1], c[2] - r)
                if i < n - 1: out.append((a, b, d))
                if i > 0: out.append((a, d, e))
        return out
    def turn(tri): return [(a, c, b) for a, b, c in tri]
    def stl(name, tri):
        with open(name + ".stl", "w") as f:
            print("solid UNIT=mm SPACE=RAS", file=f)
            for t in tri:
                print("facet normal 0 0 0\nouter loop", *("vertex %.6f %.6f %.6f" % v for v in t), "endloop\nendfacet", sep="\n", file=f)
            print("endsolid", file=f)
    a = sphere((0, 0, 0), 20)
    stl("union", a + sphere((24, 3, -2), 20))
    stl("filled", a + sphere((1, 2, 3), 10))
    stl("cavity", a + turn(sphere((1, 2, 3), 10)))
    stl("inward", turn(a))
    stl("mixed", [t if i % 33 else turn([t])[0] for i, t in enumerate(a)])
    stl("again", a + a[100:120] + turn(a[300:310]))
    stl("hole", a[:500] + a[502:])
    stl("flat", a + [(a[9][0], a[9][0], a[9][1])])
    stl("cross", [tuple((x, y, z - 44 if z > 18 else z) for x, y, z in t) for t in a])

$ python3 make.py
exit 0

# Two balls that overlap are their union, 60.3 mL of 33.5 and 33.5 (flat triangles lack 1.4 %); not blown up.
$ omentum model --no-bending --edge 6 union.stl -q -o union
exit 0
out volume (59|60)\.\d+ mL
out note: the surface has \d+ pairs of triangles that cross, the first at \(.*\) mm: the body is the union; 6\.\d+ mL in more than one part count once
$ omentum model --strict union.stl -q -o none
exit 3
err union\.stl: the surface has \d+ pairs of triangles that cross, the first at

# A ball in a ball: the same winding is filled, the opposite one a cavity of 4.2 mL.
$ omentum model --no-bending --edge 6 filled.stl -q -o filled
exit 0
out volume 3[23]\.\d+ mL
out note: the surface has 1 part within a part that is wound the same way, at \(.*\) mm: it counts as filled; a cavity is wound the other way round
$ omentum model --no-bending --edge 6 cavity.stl -q -o cavity
exit 0
out volume (28|29)\.\d+ mL
$ omentum model --no-bending --edge 6 --strict cavity.stl -q -o strict
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
$ omentum model --no-bending --edge 6 cross.stl -q -o cross
exit 0
out note: the surface has \d+ pairs of triangles that cross, the first at
out the first at .* mL where the surface is folded inside out are left out

# Few triangles, one too many: above a tenth of them only --repair mends; a hole as large as the body likewise.
$ printf 'OFF\n5 5 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n40 40 40\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n3 0 1 4\n' > fin.off; omentum model --no-bending --repair fin.off -q -o fin
exit 0
out volume 4\.\d+ mL
out note: the surface has 1 triangle of a fin or an inner wall
$ printf 'OFF\n4 3 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n3 0 2 1\n3 0 1 3\n3 0 3 2\n' > open.off; omentum model --no-bending --repair open.off -q -o open
exit 0
out volume 4\.\d+ mL
