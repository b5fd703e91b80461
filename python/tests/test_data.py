"""Training data, calibration problems and acquisitions in files: against what made them."""
# PARTS 2
import pathlib
import shutil

import numpy as np
import pytest

import omentum as om


def test_a_data_set_of_banet_holds_its_samples(tmp_path, alive):
    definition = {"sample": {"way": "exact", "two_share": 0, "board_share": 0, "extent": (0.06, 0.08)}, "shard": 2, "npicture": 0}
    made = om.BanetData.generate(tmp_path / "data", 2, 927, **definition)
    assert made.summary["nsample"] == made.summary["nmade"] == 2
    assert om.BanetData.generate(tmp_path / "data", 2, 927, **definition).summary["nmade"] == 0  # they are there
    with pytest.raises(om.Cancelled):
        om.BanetData.generate(tmp_path / "other", 2, 927, progress=lambda *_: False, **definition)
    del made
    data = om.BanetData(tmp_path / "data")
    assert len(data) == 2
    sample = om.make_banet_sample(1, 927, way="exact", extent=(0.06, 0.08))
    facts = data.facts(1)
    assert facts["nsurface"] == len(sample.surface.x) and facts["nattached"] == sample.attached.sum()
    value, target, weight = data[1]
    assert value.shape == (5, *target.shape) and target.shape == weight.shape and value.dtype == np.float32
    assert 0 < target.sum() <= facts["nattached"] and target.sum() < weight.sum()
    # the displacement of a cell is a mean of vertices, in voxels of side / 64
    assert np.abs(value[1:4]).max() <= np.linalg.norm(sample.u, axis=1).max() / (0.3 / 64) + 1e-2
    assert value[4].min() == 0 and value[4].max() <= 1
    mirrored = data.cells(1, dim=(48, 48, 16), symmetry=4)[1]
    assert mirrored.shape == (16, 48, 48) and mirrored.sum() == target.sum()
    for index in (2, -1):
        with pytest.raises(IndexError):
            data[index]
    del data, sample
    assert alive() == 0


def test_a_data_set_of_umesh_holds_displacements(tmp_path):
    data = om.UmeshData.generate(tmp_path / "data", 3, nelem=200, npicture=0)
    assert data.summary["nsample"] == 3 and len(om.UmeshData(tmp_path / "data", 2)) == 2
    assert len(data) == 3 and data.mask.shape == (3, len(data.x)) and data.u.shape == (3, len(data.x), 3)
    assert data.mask.any(axis=1).all()
    assert np.linalg.norm(data.u, axis=2).max() == pytest.approx(data.summary["max_u"], rel=1e-5)
    u = data.u
    data.close()
    assert np.isfinite(u).all()  # the view keeps the data


def test_a_data_set_of_an_organ_of_ones_own(tmp_path, ellipsoid, alive):
    patient = om.build_patient(ellipsoid, edge=0.008, label=1, has_bending_test=False)
    surface, _ = patient.mesh.boundary()
    data = om.UmeshData.generate(tmp_path / "data", 1, organ=surface, nelem=200, npicture=0, max_press=0.005, press_share=1)
    assert data.x.min(axis=0) == pytest.approx(patient.mesh.x.min(axis=0), abs=0.008)  # a cell of the grid
    assert data.x.max(axis=0) == pytest.approx(patient.mesh.x.max(axis=0), abs=0.008)
    pressed = np.linalg.norm(data.u[data.mask], axis=1)
    assert 0 < pressed.max() <= 0.005 * (1 + 1e-5)
    with pytest.raises(AttributeError, match="max_press"):
        om.UmeshData.generate(tmp_path / "other", 1, max_pres=0.1)
    del data, surface, patient
    assert alive() == 0


def test_a_calibration_problem_from_files(tmp_path, is_slow):
    """As it comes, else with a coarser block."""
    problem = pathlib.Path(om.data_path("scenes/calibrate/press.yaml"))
    if not is_slow:
        problem = shutil.copytree(problem.parent, tmp_path / "coarse") / "press.yaml"
        gel = problem.parent / "gel.yaml"
        assert "cells: [10, 8, 5] " in gel.read_text()
        gel.write_text(gel.read_text().replace("cells: [10, 8, 5] ", "cells: [4, 3, 2] "))
    with pytest.raises(om.NotConverged, match="evaluations") as caught:
        om.calibrate_file(problem, out_dir=tmp_path / "out", max_generations=1 if is_slow else 2, population=12 if is_slow else 5, max_local=2, rise=0)
    result = caught.value.result
    assert set(result.best) == {"tissue.young", "attachments.stiffness"} and result.cost < result.cost_start
    assert (tmp_path / "out" / "report.html").exists() and result.summary["neval"] == len(result.trace)
    with pytest.raises(om.FileFailed, match="missing.csv"):
        om.calibrate_file(problem, tmp_path / "missing.csv")


def test_an_acquisition_is_written_and_read(tmp_path):
    points = np.random.default_rng(3).uniform(-0.05, 0.05, (40, 3))
    camera = om.Camera((0, 0, 0.3), (0, 0, 0), (0, 1, 0))
    pose = (np.array([0.01, 0.02, 0.03]), np.array([0.0, 0.6, 0.0, 0.8]))
    scan = om.Scan(points, noise=1e-3, camera=camera)
    om.save_acquisition(tmp_path / "lift.yaml", om.Acquisition(scan, [(0, pose, np.array([0.01, 0.02, 0.05]))], time=2.5))
    same = om.load_acquisition(tmp_path / "lift.yaml")
    assert same.scan.x == pytest.approx(points, abs=1e-6) and same.time == 2.5
    (arm, begin, now), = same.grasps
    assert arm == 0 and begin.p == pytest.approx(pose[0]) and begin.q == pytest.approx(pose[1]) and now.p[2] == pytest.approx(0.05)


def test_the_gil_is_free_in_a_step(is_slow):
    """While a thread computes in C, this one runs Python."""
    import threading
    mesh = om.TetMesh.box((0.1, 0.1, 0.1), [16 if is_slow else 5] * 3)
    mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 2] < 1e-9)
    tissue = om.Tissue(mesh, solver={"nworker": 1})
    thread = threading.Thread(target=lambda: tissue.find_rest(1e-6, strict=False))
    thread.start()
    turns = 0
    while thread.is_alive():
        turns += 1
        thread.join(1e-4)
    assert turns > 10


def test_cameras_and_networks_are_refused_in_a_forked_child():
    import os
    read, write = os.pipe()
    if os.fork() == 0:
        said = []
        for use in (om.SenseScene, om.BanetNet.load, om.UmeshNet.load, lambda: om.SimulatedWorld(om.Scene())):
            try:
                use()
            except om.Unavailable as error:
                said.append("spawn" in str(error))
        os.write(write, str(said).encode())
        os._exit(0)
    os.close(write)
    os.wait()
    assert os.read(read, 200).decode() == str([True] * 4)
    os.close(read)
