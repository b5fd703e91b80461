"""Probes, calibration and recordings: against balance of forces, a known answer, and the file itself."""
import pickle

import numpy as np
import pytest

import omentum as om


@pytest.fixture
def block(is_slow):
    """A block of 60 x 50 x 30 mm, held on its underside, without weight."""
    mesh = om.TetMesh.box((0.06, 0.05, 0.03), (12, 10, 6) if is_slow else (8, 7, 4))
    mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 2] < 1e-9)
    return mesh


@pytest.mark.parametrize("method", ["penalty", "multipliers"])
def test_a_sphere_pressed_to_rest_bears_what_the_attachments_bear(block, method, alive):
    tissue = om.Tissue(block, young=3000, gravity=(0, 0, 0), rayleigh_mass=2.0)
    press = om.Press(tissue, om.Probe("sphere", radius=0.02), method, ntri=3000)
    top = np.array([0.03, 0.025, 0.03 + 0.02])
    press.place(top + [0, 0, 0.001])
    assert press.gap(top) == pytest.approx(0, abs=6e-4)  # between the vertices of the contact surface
    for i in range(10):
        press.step(top - [0, 0, 0.003 * (i + 1) / 10], 0.02)
    for _ in range(5):
        report = press.step(top - [0, 0, 0.003], 5.0)
    assert report.is_settled and report.ncontact > 3 and report.penetration < 2e-4
    assert report.force[2] > 0.02 and report.push.sum(axis=0) == pytest.approx(-report.force, rel=1e-3, abs=1e-5)
    assert tissue.forces().attachment == pytest.approx(report.force, rel=5e-3, abs=1e-4)
    assert np.linalg.norm(report.normal, axis=1) == pytest.approx(np.ones(report.ncontact))
    assert press.pose[:3, 3] == pytest.approx(top - [0, 0, 0.003])
    hertz = 4 / 3 * 3000 / (1 - 0.45**2) * 0.02**0.5 * 0.003**1.5  # half space; the block is thin and coarse
    assert 0.8 * hertz < report.force[2] < 3 * hertz
    press.close()
    with pytest.raises(om.Closed):
        press.step(top)
    del press, tissue
    assert alive() == 0


def test_probes_of_every_shape():
    ball = om.Probe("sphere", radius=0.02).surface()
    assert ball.volume == pytest.approx(4 / 3 * np.pi * 0.02**3, rel=0.05)
    assert om.Probe(ball).surface().volume == pytest.approx(ball.volume)
    assert om.Probe("box", size=(0.05, 0.01, 0.06)).surface().volume == pytest.approx(0.05 * 0.01 * 0.06, rel=0.05)
    with pytest.raises(om.Invalid, match="radius"):
        om.Probe("sphere", radius=-1)


# ---- calibration ----


def stretch(parameters):
    """Distances, m, of a line a + b t at five places from a = 0.01, b = 0.002."""
    t = np.arange(5.0)
    return np.abs(parameters[0] + parameters[1] * t - (0.01 + 0.002 * t))


AB = [om.Parameter("a", 0.001, 0.1, 0.05, is_log=True), om.Parameter("b", -0.01, 0.01, 0.0)]


def test_a_calibration_finds_what_made_the_data():
    result = om.calibrate(stretch, AB, 5, noise=1e-4)
    assert result.outcome == 0 and result.best["a"] == pytest.approx(0.01, rel=1e-2) and result.best["b"] == pytest.approx(0.002, rel=1e-2)
    assert result.cost < 1e-4 < result.cost_start and len(result.trace) == result.summary["neval"]
    assert result.profiles["a"]["is_determined"] and result.profiles["a"]["lo"] < 0.01 < result.profiles["a"]["hi"]
    again = om.calibrate(stretch, AB, 5, noise=1e-4, nworker=2)
    assert again.best == result.best  # any number of threads


def test_a_parameter_that_the_data_do_not_determine_is_named():
    result = om.calibrate(lambda p: np.abs(np.array([p[0] - 0.01] * 3)), AB, 3, noise=1e-4, strict=False)
    assert not result.profiles["b"]["is_determined"]


def test_errors_of_a_model_reach_the_caller(alive):
    with pytest.raises(ZeroDivisionError):
        om.calibrate(lambda p: 1 / 0, AB, 5)
    with pytest.raises(ValueError, match=r"\(5,\)"):
        om.calibrate(lambda p: np.zeros(4), AB, 5)
    with pytest.raises(om.NotConverged) as caught:
        om.calibrate(lambda p: stretch(p) + 0.01, AB, 5, noise=1e-4, max_generations=5, max_local=20)
    assert caught.value.result.outcome > 0 and "a" in caught.value.result.best
    with pytest.raises(om.Cancelled):
        om.calibrate(stretch, AB, 5, progress=lambda *_: False)
    caught = None
    assert alive() == 0


# ---- recordings ----


def record(path, box):
    tissue = om.Tissue(box)
    with om.Recorder(path, tissue.mesh, point={"force": 3}, cell={"von_mises": 1}) as recorder:
        for _ in range(3):
            tissue.step()
            recorder.add(tissue.time, tissue.x, force=tissue.internal_force(), von_mises=tissue.measure())
    return tissue


def test_a_recording_appears_whole_or_not_at_all(box, tmp_path, alive):
    record(tmp_path / "run.vtkhdf", box)
    with pytest.raises(RuntimeError, match="stop"):
        with om.Recorder(tmp_path / "half.vtkhdf", box) as recorder:
            recorder.add(0.1, box.x)
            raise RuntimeError("stop")
    with om.Recorder(tmp_path / "wrong.vtkhdf", box, cell={"a": 1}) as recorder:
        with pytest.raises(ValueError, match="arrays"):
            recorder.add(0.1, box.x)
        recorder.add(0.1, box.x, a=np.zeros(len(box.tet)))
        with pytest.raises(om.Invalid, match="time"):
            recorder.add(0.1, box.x, a=np.zeros(len(box.tet)))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run.vtkhdf", "wrong.vtkhdf"]
    del recorder
    assert alive() == 0


def test_a_recording_of_quadratic_elements(box, tmp_path, alive):
    h5py = pytest.importorskip("h5py")
    tissue = om.Tissue(box)
    ends = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]  # of the nodes on edges, in VTK's order
    with om.Recorder(tmp_path / "ten.vtkhdf", tissue, cell={"von_mises": 1}) as recorder:
        recorder.add(0, tissue.x, von_mises=np.arange(8.0 * len(box.tet)))
        tissue.step()
        recorder.add(tissue.time, tissue.x, von_mises=tissue.measure())
    del recorder
    recording = om.Recording(tmp_path / "ten.vtkhdf")
    with h5py.File(tmp_path / "ten.vtkhdf") as file:
        assert set(file["VTKHDF/Types"][()]) == {24}  # VTK_QUADRATIC_TETRA
    cells, x = np.array(recording.cells), recording.x(0)
    assert cells.shape == (len(box.tet), 10) and np.array_equal(cells[:, :4], box.tet)
    assert len(x) == len(tissue.x) == len(tissue.mesh.x) > len(box.x)
    for k, (a, b) in enumerate(ends):
        assert x[cells[:, 4 + k]] == pytest.approx((x[cells[:, a]] + x[cells[:, b]]) / 2, abs=1e-7)
    assert recording.array("von_mises", 0).ravel() == pytest.approx(np.arange(len(box.tet)) * 8 + 3.5)
    assert recording.x(1) == pytest.approx(tissue.x, abs=1e-7)
    recording.close()
    for name in ("ten.vtu", "ten.vtk", "ten.msh"):
        tissue.reset()
        tissue.save(tmp_path / name)
        back = om.TetMesh.load(tmp_path / name, unit=1)
        assert np.array_equal(back.tet, box.tet) and np.array_equal(back.x, box.x)
        assert set(back.sets) == set(box.sets)
    moved = tissue.x.copy()
    moved[len(box.x):, 2] += 0.002
    tissue.set_x(moved)
    tissue.save(tmp_path / "bent.msh")
    with pytest.raises(om.Invalid, match="tetrahedron 1 is curved"):
        om.TetMesh.load(tmp_path / "bent.msh", unit=1)
    assert np.array_equal(om.TetMesh.load(tmp_path / "bent.msh", unit=1, straighten=True).x, box.x)
    assert tissue.measure().shape == (8 * len(box.tet),) and tissue.internal_force().shape == tissue.x.shape
    twin = tissue.copy()
    assert twin.hash == tissue.hash and pickle.loads(pickle.dumps(tissue)).hash == tissue.hash
    del tissue, twin
    assert alive() == 0


def test_a_recording_is_read_as_numpy(box, tmp_path):
    pytest.importorskip("h5py")
    tissue = record(tmp_path / "run.vtkhdf", box)
    recording = om.Recording(tmp_path / "run.vtkhdf")
    assert recording.times == pytest.approx([0.02, 0.04, 0.06])
    assert recording.x(2) == pytest.approx(tissue.x) and recording.array("von_mises", -1).ravel() == pytest.approx(tissue.measure())
    assert recording.array("force", 2) == pytest.approx(tissue.internal_force())
    assert np.array_equal(np.array(recording.cells), tissue.mesh.tet)
    assert [time for time, _ in recording] == recording.times.tolist()
    with pytest.raises(KeyError, match="von_mises"):
        recording.array("stress", 0)
    with pytest.raises(IndexError):
        recording.x(3)
    recording.close()
