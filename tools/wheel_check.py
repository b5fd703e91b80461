"""wheel_check.py system|bundle: use an installed package so that every library below it works; no checkout is in reach.

bundle: these libraries must be those inside of the package.
"""
import ctypes
import pathlib
import re
import sys
import tempfile

import numpy as np

import omentum as om

mesh = om.TetMesh.box((0.04, 0.02, 0.02), (8, 4, 4))
mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 0] == 0)
tissue = om.Tissue(mesh)
tip = np.array([0.04, 0.01, 0.02])
tissue.grasp(tip, radius=0.008)
for i in range(20):
    tissue.move(tip + [0, 0, 0.0005 * i])
    tissue.step()
assert tissue.forces().grasp[0][2] > 0.01

here = pathlib.Path(om.__file__).parent
scene = om.Scene.load(om.data_path("scenes/sheet.yaml"))  # libyaml
assert scene.tissue.young == 3000 and here in om.data_path("weights/banet.safetensors").parents
path = (ctypes.c_char * 4096)()
om.lib.om_path_share(b"weights/phantom.safetensors", path, 4096)  # as C looks for it
assert pathlib.Path(path.value.decode()).resolve() == om.data_path("weights/phantom.safetensors").resolve(), path.value

now = om.Situation(5)
now.mark("is_above_roi", [(3, 3)])
assert om.Planner().solve(now).grasp == (3, 3)  # clingo
view = om.SenseScene()
view.add(mesh.boundary()[0])
picture = view.render(om.Camera((0.02, 0.01, 0.15), (0.02, 0.01, 0), (0, 1, 0), width=64, height=48))  # Embree
assert picture.std() > 5
sample = om.make_banet_sample(3, 909, way="exact", extent=(0.06, 0.08))
assert np.isfinite(om.BanetNet.load().estimate(sample.surface, sample.u, sample.seen)).all()  # oneDNN
found = om.calibrate(lambda p: np.abs(p - 0.01), [om.Parameter("a", 0.001, 0.1, 0.05)], 1, noise=1e-4)  # NLopt
assert abs(found.best["a"] - 0.01) < 1e-3
with tempfile.TemporaryDirectory() as folder:
    om.save_png(f"{folder}/p.png", picture)  # libpng
    with om.Recorder(f"{folder}/a.vtkhdf", mesh) as recorder:  # HDF5
        recorder.add(0.1, mesh.x)
    assert pathlib.Path(folder, "a.vtkhdf").stat().st_size > 1000

assert (here / "NOTICE").exists() and (here / "LICENSE").exists()
mapped = set(re.findall(r"/\S+\.so[.\w]*", pathlib.Path("/proc/self/maps").read_text()))
ours = {p for p in mapped if "/site-packages/omentum" in p}
names = ("cholmod", "superlu", "openblas", "arpack", "embree3", "clingo", "hdf5", "dnnl", "yaml", "nlopt", "jansson", "png16", "metis")
if sys.argv[1] == "bundle":
    missing = [n for n in names if not any(f"/lib{n}" in p for p in ours)]
    assert not missing, f"not in the wheel: {missing}"
    texts = {p.stem for p in (here / "licences").glob("*.txt")}
    assert {"LGPL-2.1", "libcholmod3", "libsuperlu5", "libdnnl2"} <= texts and texts & {"libembree3-3", "embree"}, texts
    # no part under the GPL: neither UMFPACK nor the modules of CHOLMOD that are; nothing to link with, and no more than PyPI takes
    cholmod = ctypes.CDLL(next(p for p in ours if "/libcholmod" in p))
    assert hasattr(cholmod, "cholmod_analyze") and not hasattr(cholmod, "cholmod_super_numeric") and not hasattr(cholmod, "cholmod_updown")
    files = [p for p in here.parent.glob("omentum*/**/*") if p.is_file()]
    assert not [p for p in files if "umfpack" in p.name or p.suffix in (".a", ".h", ".hpp", ".la", ".pc")]
import importlib.metadata  # noqa: E402
assert "omentum_gymnasium:register" in {e.value for e in importlib.metadata.entry_points(group="gymnasium.envs")} if sys.version_info >= (3, 10) else True
assert (here.parent / "omentum_gymnasium.pth").exists()
print(f"{om.__version__} in {here.parent.parent}: {tissue.forces().pull[0][2]:.4f} N, {len(ours)} libraries of {len(mapped)} from the package")
