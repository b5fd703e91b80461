"""Damaged surfaces for model_repair.cmd and model_repair_overlap.cmd, as .stl files in the current folder."""
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
stl("cross", [tuple((x, y, z - 44 if z > 18 else z) for x, y, z in t) for t in sphere((0, 0, 0), 20, 10)])
