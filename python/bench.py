"""What Python costs: one JSON object a line, as `omentum_bench`.

    python3 python/bench.py [ROUNDS]

`step`: a step of a sheet of 882 vertices by the package, and by the bare function of C, taken in turn; minimum of all rounds, us.
`read`: all positions of 10,648 vertices, as a view and as a copy; median, us.
"""
import ctypes
import json
import statistics
import sys
import time

import numpy as np

import omentum as om


def once(function):
    begin = time.perf_counter()
    function()
    return 1e6 * (time.perf_counter() - begin)


def bench_step(rounds):
    mesh = om.TetMesh.box((0.12, 0.12, 0.005), (20, 20, 1))
    mesh.sets["attachment"] = np.arange(20)
    tissue = om.Tissue(mesh, solver={"nworker": 1})
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
    return {"row": "python/step", "nvert": len(mesh.x), "python_us": min(python), "c_us": min(direct),
            "ratio": min(python) / min(direct)}


def bench_read(rounds):
    tissue = om.Tissue(om.TetMesh.box((1, 1, 1), (21, 21, 21)))
    return {"row": "python/read", "nvert": len(tissue.x), "view_us": statistics.median(once(lambda: tissue.x) for _ in range(rounds)),
            "copy_us": statistics.median(once(lambda: tissue.x.copy()) for _ in range(rounds))}


rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 500
for bench in (bench_step, bench_read):
    print(json.dumps(bench(rounds)))
