# omentum model: damaged meshes of tetrahedra are mended, each defect with a note.
# Meshes: tetrahedra inside out are turned, a crack is welded or left, nodes on edges are dropped; each is said.
write box.py
    import itertools
    def mesh(crack, turned):
        """Two cubes of 30 mm side by side, six tetrahedra each."""
        x, tet = [], []
        for cube in range(2):
            base = len(x)
            x += [(30 * (cube + i), 30 * j, 30 * k) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
            for p in itertools.permutations((1, 2, 4)):
                v = [base, base + p[0], base + p[0] + p[1], base + 7]
                odd = p in ((1, 4, 2), (2, 1, 4), (4, 2, 1))
                tet.append([v[0], v[2], v[1], v[3]] if odd != turned else v)
        same = list(range(len(x)))
        if not crack: same = [x.index(p) for p in x]
        return x, [[same[v] for v in t] for t in tet]
    for name, crack, turned in ("whole", 0, 0), ("crack", 1, 0), ("turned", 0, 1):
        x, tet = mesh(crack, turned)
        with open(name + ".msh", "w") as f:
            print("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d" % len(x), file=f)
            for i, p in enumerate(x): print(i + 1, *p, file=f)
            print("$EndNodes\n$Elements\n%d" % len(tet), file=f)
            for i, t in enumerate(tet): print(i + 1, 4, 2, 1, 1, *(v + 1 for v in t), file=f)
            print("$EndElements", file=f)
    x, tet = mesh(0, 0)
    node = {}
    for t in tet:
        for a, b in itertools.combinations(sorted(t), 2): node.setdefault((a, b), len(x) + len(node))
    with open("ten.msh", "w") as f:
        print("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d" % (len(x) + len(node)), file=f)
        for i, p in enumerate(x): print(i + 1, *p, file=f)
        for (a, b), n in node.items(): print(n + 1, *((s + t) / 2 + (0.5 if a == 0 else 0) for s, t in zip(x[a], x[b])), file=f)
        print("$EndNodes\n$Elements\n%d" % len(tet), file=f)
        for i, t in enumerate(tet):
            mid = [node[tuple(sorted((t[a], t[b])))] for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))]
            print(i + 1, 11, 2, 1, 1, *(v + 1 for v in t + mid), file=f)
        print("$EndElements", file=f)

$ python3 box.py
exit 0
$ omentum model --no-bending whole.msh --strict -q -o whole
exit 0
out 12 tetrahedra, 12 vertices
$ omentum model --no-bending turned.msh -q -o turned
exit 0
out 12 tetrahedra, 12 vertices
out volume 54\.00 mL
out note: 12 tetrahedra are inside out \(vertices 2 to 4 run clockwise seen from the first\), the first is number 1: turned by exchanging two vertices
$ omentum model --no-bending crack.msh -q -o crack
exit 0
out 12 tetrahedra, 12 vertices
out note: 2 pairs of faces lay on each other with vertices of their own, the first at \(30, .*\) mm: 4 vertices are welded \(--keep-cracks leaves them\)
$ omentum model --no-bending crack.msh --keep-cracks -q -o cracked
exit 0
out 12 tetrahedra, 16 vertices
out note: 2 pairs of faces lie on each other and stay apart
$ omentum model --no-bending crack.msh --strict -q -o none
exit 3
err crack\.msh: 2 pairs of faces lie on each other and have their own vertices: the mesh is cracked
$ omentum model --no-bending ten.msh -q -o ten
exit 0
out 12 tetrahedra, 12 vertices
out note: the tetrahedra have ten nodes: the nodes on their edges are dropped, they are up to 0\.866 mm off the middle of their edge
$ omentum model --no-bending ten.msh --strict -q -o none
exit 3
err ten\.msh: tetrahedron 1 is curved
no-file none
