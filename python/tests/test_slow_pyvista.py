"""PyVista (VTK, more than 100 MB): meshes and recordings as its objects, and back, against its own measures."""
import numpy as np
import pytest

import omentum as om

pyvista = pytest.importorskip("pyvista")


def test_meshes_both_ways(box):
    box.label[3] = 7
    grid = box.to_pyvista()
    assert grid.volume == pytest.approx(box.volume, rel=1e-6) and grid.n_cells == len(box.tet)
    same = om.TetMesh.from_pyvista(grid)
    assert same.x == pytest.approx(box.x, abs=1e-7) and np.array_equal(same.tet, box.tet) and np.array_equal(same.label, box.label)
    assert np.array_equal(same.sets["attachment"], box.sets["attachment"])
    surface, _ = box.boundary()
    assert surface.to_pyvista().area == pytest.approx(2 * (0.04 * 0.02 * 2 + 0.02 * 0.02), rel=1e-6)
    again = om.Surface.from_pyvista(surface.to_pyvista())
    assert again.volume == pytest.approx(surface.volume, rel=1e-6)
    ball = om.Surface.from_pyvista(pyvista.Sphere(radius=0.02))
    ball.require_closed()
    assert ball.volume == pytest.approx(pyvista.Sphere(radius=0.02).volume, rel=1e-6)


def test_patients_bodies_volumes_and_scans():
    """Volumes of solids are those of the library; an image has the extent of its voxels' centres."""
    scene = om.Scene()
    scene.tissue.cells, scene.tissue.element = (4, 4, 1), "linear"
    body = om.Body(scene)
    grid = body.to_pyvista("von_mises")
    assert grid.volume == pytest.approx(body.mesh.volume, rel=1e-6) and np.asarray(grid.cell_data["von_mises"]).shape == (len(body.mesh.tet),)
    assert body.site.to_pyvista()["tissue"].volume == pytest.approx(body.mesh.volume, rel=1e-6)
    patient = om.build_patient(np.pad(np.ones((9, 9, 9), np.uint8), 2), "4 mm", spacing=2, unit="mm", has_bending_test=False)
    assert patient.to_pyvista()["tissue"].volume == pytest.approx(patient.mesh.volume, rel=1e-6)
    image = om.Volume(np.arange(24).reshape(2, 3, 4), spacing=(0.01, 0.02, 0.03)).to_pyvista()
    assert image.volume == pytest.approx(0.01 * 0.04 * 0.09) and image["values"][image.find_closest_point((0.01, 0.02, 0.06))] == 18
    turned = om.Volume(np.arange(24).reshape(2, 3, 4), affine=[[0, 0.02, 0, 0], [0.01, 0, 0, 0], [0, 0, 0.03, 0], [0, 0, 0, 1]]).to_pyvista()
    assert turned["values"][turned.find_closest_point((0.02, 0.01, 0.06))] == 18
    assert om.Scan([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], tri=[[0, 1, 2]]).to_pyvista().area == pytest.approx(0.005)


def test_files_are_read_by_vtk(box, tmp_path):
    box.save(tmp_path / "m.vtu")
    assert pyvista.read(tmp_path / "m.vtu").volume == pytest.approx(box.volume, rel=1e-6)
    box.boundary()[0].save(tmp_path / "m.ply")
    assert pyvista.read(tmp_path / "m.ply").volume == pytest.approx(box.volume, rel=1e-6)


def test_a_recording_as_objects_and_by_vtk_itself(box, tmp_path):
    pytest.importorskip("h5py")
    tissue = om.Tissue(box, element="linear")
    with om.Recorder(tmp_path / "run.vtkhdf", tissue.mesh, point={"force": 3}, cell={"von_mises": 1}) as recorder:
        for _ in range(3):
            tissue.step()
            recorder.add(tissue.time, tissue.x, force=tissue.internal_force(), von_mises=tissue.measure())
    grid = om.Recording(tmp_path / "run.vtkhdf").to_pyvista(2)
    assert np.asarray(grid.points) == pytest.approx(tissue.x) and grid.volume == pytest.approx(tissue.measure("volume_ratio") @ np.full(
        len(box.tet), box.volume / len(box.tet)), rel=1e-6)
    assert np.asarray(grid.cell_data["von_mises"]).ravel() == pytest.approx(tissue.measure())
    assert np.asarray(grid.point_data["force"]) == pytest.approx(tissue.internal_force())
    reader = pyvista.get_reader(tmp_path / "run.vtkhdf")
    assert reader.read().n_cells == len(box.tet)
