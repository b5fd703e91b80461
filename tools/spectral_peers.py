#!/usr/bin/env python3
"""Functional maps of the data folder by other programs, for doc/notes/match_spectral.md and test_match_spectral_data.

    tools/spectral_peers.py DATA     DATA/functional_maps has cat, lion and camels

Needs robust_laplacian 1.1.0, pyfmaps 1.3.1 and SciPy. Prints eigenvalues 1, 20 and 99 times the area, and errors before
and after ZoomOut in percent of the root of the area, distances along edges; the same first maps and rounds as the test.
"""
import pathlib
import sys
import time

import numpy as np
import pyFM.refine.zoomout
import pyFM.spectral
import robust_laplacian
import scipy.sparse as sparse
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import eigsh


class Shape:
    def __init__(self, path, npair):
        word = path.read_text().split()
        nvert, ntri = int(word[1]), int(word[2])
        self.x = np.array(word[4:4 + 3 * nvert], float).reshape(-1, 3)
        tri = np.array(word[4 + 3 * nvert:4 + 3 * nvert + 4 * ntri], int).reshape(-1, 4)[:, 1:]
        start = time.process_time()
        stiffness, mass = robust_laplacian.mesh_laplacian(self.x, tri)
        self.area = mass.diagonal().sum()
        self.value, phi = eigsh(stiffness, npair, mass, sigma=-0.4 * np.pi / self.area)
        self.seconds = time.process_time() - start
        self.phi = phi * np.sqrt(self.area)
        self.share = sparse.diags(mass.diagonal() / self.area)
        edge = np.unique(np.sort(np.vstack([tri[:, [0, 1]], tri[:, [1, 2]], tri[:, [2, 0]]]), 1), axis=0)
        length = np.linalg.norm(self.x[edge[:, 0]] - self.x[edge[:, 1]], axis=1)
        self.graph = sparse.csr_matrix((length, (edge[:, 0], edge[:, 1])), (nvert, nvert))

    def percent(self, start):
        return 100 * dijkstra(self.graph, directed=False, indices=start) / np.sqrt(self.area)


def zoomout(a, b, start, first, last, step):
    """A vertex of a for each vertex of b."""
    matrix = b.phi[:, :first].T @ (b.share @ a.phi[start, :first])
    matrix = pyFM.refine.zoomout.zoomout_refine(matrix, a.phi, b.phi, nit=(last - first) // step, step=step,
                                                A2=b.share, verbose=False)
    return pyFM.spectral.FM_to_p2p(matrix, a.phi, b.phi)


def main(data):
    folder = pathlib.Path(data) / "functional_maps"
    ints = lambda name: np.loadtxt(folder / name, int)
    cat, lion = (Shape(folder / f"{name}-00.off", 100) for name in ("cat", "lion"))
    for name, shape in (("cat", cat), ("lion", lion)):
        print(f"{name}: {shape.seconds:.2f} s,", *(f"{v:.13g}" for v in shape.value[[1, 20, 99]] * shape.area))
    mark, start = ints("landmarks.txt"), ints("lion2cat")
    distance = cat.percent(mark[:, 0])
    error = lambda m: distance[np.arange(len(mark)), m[mark[:, 1]]].mean()
    begin = time.process_time()
    end = zoomout(cat, lion, start, 20, 100, 10)
    print(f"lion to cat: {error(start):.2f} %, {error(end):.2f} % after {time.process_time() - begin:.2f} s")
    third = Shape(folder / "camel-gallop-03.off", 80)
    for k in (1, 2):
        camel = Shape(folder / f"camel-gallop-0{k}.off", 80)
        there, back = ints(f"camel_map_{k}_to_3"), ints(f"camel_map_3_to_{k}")
        sample = np.arange(0, len(camel.x), 50)
        distance = camel.percent(sample)
        error = lambda p, q: distance[np.arange(len(sample)), q[p[sample]]].mean()
        after = error(zoomout(third, camel, there, 20, 80, 10), zoomout(camel, third, back, 20, 80, 10))
        print(f"camel {k} to 3 and back: {error(there, back):.2f} %, {after:.2f} %")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
