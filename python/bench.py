"""What Python costs: one JSON object a line, as `omentum_bench`; `make bench` runs both.

    python3 python/bench.py [ROUNDS]

`step`: a step of a sheet of 882 vertices by the package, and by the bare function of C, taken in turn; minimum of all rounds.
`read`: all positions of 10,648 vertices, as a view and as a copy; median. `law`: a step of 768 elements by a law
in Python, processor time of the thread; least of 15. `load`: the network of the phantom, processor time; least of three.
`goal`: what the row is to stay below; `goal_ratio`: above 1 where it does.
"""
import ctypes
import json
import statistics
import sys
import time

try:
    import numpy as np
except ImportError:
    print("bench.py: python3 cannot import numpy (make python)", file=sys.stderr)
    sys.exit(0)

import omentum as om

MOST_OVERHEAD, MOST_READ_US = 0.05, 50


def once(function, clock=time.perf_counter):
    begin = clock()
    function()
    return 1e6 * (clock() - begin)


def bench_step(rounds):
    mesh = om.TetMesh.box((0.12, 0.12, 0.005), (20, 20, 1))
    mesh.sets["attachment"] = np.arange(20)
    tissue = om.Tissue(mesh, element="linear", solver={"nworker": 1})  # short: the call counts
    for _ in range(100):
        tissue.step()
    bare = ctypes.CDLL(om.lib._name).om_tissue_step
    bare.argtypes = [ctypes.c_void_p] * 3 + [ctypes.c_double, ctypes.c_void_p]
    report = om.capi.OmTissueReport()
    arguments = (tissue._model.address, tissue._handle.address, tissue._work.address, 0.02, ctypes.addressof(report))
    state = tissue.snapshot()
    python, direct = [], []
    for _ in range(rounds):  # each round is the same step
        tissue.restore(state)
        python.append(once(tissue.step))
        tissue.restore(state)
        direct.append(once(lambda: bare(*arguments)))
    over = min(python) / min(direct) - 1
    return {"bench": "python", "scene": "step", "size": len(mesh.x), "min_ms": 1e-3 * min(python), "reference": "the same call in C",
            "reference_ms": 1e-3 * min(direct), "overhead": over, "goal": MOST_OVERHEAD, "goal_ratio": MOST_OVERHEAD / max(over, 1e-4)}


def bench_read(rounds):
    tissue = om.Tissue(om.TetMesh.box((1, 1, 1), (21, 21, 21)), element="linear")
    view, copy = (statistics.median(once(f) for _ in range(rounds)) for f in (lambda: tissue.x, lambda: tissue.x.copy()))
    return {"bench": "python", "scene": "read", "size": len(tissue.x), "view_us": view, "copy_us": copy, "goal": MOST_READ_US,
            "goal_ratio": MOST_READ_US / copy}


def bench_load(rounds):
    return {"bench": "python", "scene": "load umesh", "min_ms": 1e-3 * min(once(om.UmeshNet.load, time.process_time) for _ in range(3 if rounds > 50 else 1))}


class Stable(om.Law):
    name = "bench-stable"

    def energy(self, F, of):
        J = np.linalg.det(F)
        return of.mu / 2 * ((F * F).sum((1, 2)) - 3) - of.mu * (J - 1) + (of.lam + of.mu) / 2 * (J - 1) ** 2


class StableStress(Stable):
    name = "bench-stable-stress"

    def stress(self, F, of):
        cofactors = np.stack([np.cross(F[:, :, k - 2], F[:, :, k - 1]) for k in range(3)], axis=2)
        factor = (of.lam + of.mu) * (np.linalg.det(F) - 1) - of.mu
        return of.mu[:, None, None] * F + factor[:, None, None] * cofactors


def bench_law(rounds):
    mesh = om.TetMesh.box((0.04, 0.02, 0.02), (8, 4, 4))
    mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 0] < 1e-9)
    times = []
    for engine, law in ((Stable(), {}), (StableStress(), {}), ("fem", {"law": "stable-neo-hookean", "element": "linear"})):
        tissue = om.Tissue(mesh, engine, young=2e4, solver={"nworker": 1}, **law)
        times.append(1e-3 * min(once(tissue.step, time.thread_time) for _ in range(5 if rounds < 100 else 15)))
    return {"bench": "python", "scene": "law by its energy", "size": len(mesh.tet), "min_ms": times[0], "with_stress_ms": times[1],
            "reference": "the same law of the library", "reference_ms": times[2], "ratio": times[2] / times[0]}


rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 500
for bench in (bench_step, bench_read, bench_law, bench_load):
    print(json.dumps(bench(rounds)))
