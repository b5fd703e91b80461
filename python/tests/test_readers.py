"""Every file that is written opens in the programs that people use: one test a reader, skipped by name where it is missing."""
import numpy as np
import pytest

import omentum as om


@pytest.fixture
def mesh():
    """Two labels and a set, in a block of 40 x 20 x 20 mm."""
    mesh = om.TetMesh.box((0.04, 0.02, 0.02), (4, 2, 2))
    mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 0] < 1e-9)
    middle = mesh.x[mesh.tet].mean(axis=1)
    mesh.label[:] = np.where(middle[:, 0] > 0.02, 2, 1)
    return mesh


def corners(x):
    """Points in an order that does not depend on the file, m."""
    return np.array(sorted(map(tuple, np.round(np.asarray(x, dtype=float), 9))))


@pytest.mark.parametrize("ending", ["vtu", "vtk", "msh"])
def test_meshio_reads_volume_meshes(mesh, ending, tmp_path):
    meshio = pytest.importorskip("meshio")
    path = tmp_path / f"m.{ending}"
    mesh.save(path)
    read = meshio.read(path)
    tet = [block.data for block in read.cells if block.type == "tetra"]
    assert np.concatenate(tet).shape == mesh.tet.shape
    assert corners(read.points) == pytest.approx(corners(mesh.x), abs=1e-12)
    if ending != "msh":
        assert np.array_equal(np.concatenate(read.cell_data["tet_label"]).ravel(), mesh.label)
        assert np.array_equal(np.flatnonzero(np.ravel(read.point_data["attachment"])), mesh.sets["attachment"])
    if ending == "vtu":  # unit and space are numbers
        assert read.field_data["metres_per_unit"] == [1] and read.field_data["is_lps"] == [0]


@pytest.mark.parametrize("ending", ["stl", "ply", "obj", "off"])
def test_meshio_reads_surfaces(mesh, ending, tmp_path):
    meshio = pytest.importorskip("meshio")
    surface, _ = mesh.boundary()
    path = tmp_path / f"s.{ending}"
    surface.save(path)
    read = meshio.read(path)
    tri = np.concatenate([block.data for block in read.cells if block.type == "triangle"])
    assert len(tri) == len(surface.tri)
    assert read.points.min(axis=0) == pytest.approx(surface.x.min(axis=0), abs=1e-8)
    assert read.points.max(axis=0) == pytest.approx(surface.x.max(axis=0), abs=1e-8)


def test_files_of_a_patient_model_are_read(ellipsoid, tmp_path):
    meshio = pytest.importorskip("meshio")
    patient = om.build_patient(ellipsoid, edge=0.008, label=1, sheet={"thickness": 0.008}, has_bending_test=False)
    patient.save(tmp_path / "patient")
    tissue = meshio.read(tmp_path / "patient/tissue.vtu")
    assert tissue.points == pytest.approx(patient.mesh.x, abs=1e-12)
    assert len(meshio.read(tmp_path / "patient/organ.ply").points) == len(patient.organ.x)


@pytest.mark.parametrize("ending", ["vtu", "vtk"])
def test_pyvista_reads_volume_meshes(mesh, ending, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    path = tmp_path / f"m.{ending}"
    mesh.save(path)
    read = pyvista.read(path)
    assert read.n_cells == len(mesh.tet) and np.asarray(read.points) == pytest.approx(mesh.x, abs=1e-12)
    assert np.array_equal(read.cell_data["tet_label"], mesh.label)


@pytest.mark.parametrize("ending", ["stl", "ply", "obj", "vtk"])
def test_pyvista_reads_surfaces(mesh, ending, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    surface, _ = mesh.boundary()
    path = tmp_path / f"s.{ending}"
    surface.save(path)
    read = pyvista.read(path)
    assert read.n_cells == len(surface.tri) and np.ptp(read.points, axis=0) == pytest.approx((0.04, 0.02, 0.02), abs=1e-8)


def test_gmsh_reads_meshes(mesh, tmp_path):
    gmsh = pytest.importorskip("gmsh", exc_type=ImportError)
    path = tmp_path / "m.msh"
    mesh.save(path)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        assert len(gmsh.model.mesh.getElementsByType(4)[0]) == len(mesh.tet)
        names = {gmsh.model.getPhysicalName(*group) for group in gmsh.model.getPhysicalGroups()}
        assert "attachment" in names
    finally:
        gmsh.finalize()


def test_a_gmsh_file_has_the_sections_of_its_format(mesh, tmp_path):
    """Format 4.1 without Gmsh: every section ends, and the counts of its first line fit."""
    path = tmp_path / "m.msh"
    mesh.save(path)
    lines = path.read_bytes().split(b"\n")
    version, is_binary, size = lines[1].split()
    assert lines[0] == b"$MeshFormat" and version == b"4.1" and size == b"8"
    for section in (b"MeshFormat", b"PhysicalNames", b"Entities", b"Nodes", b"Elements"):
        assert sum(line == b"$" + section for line in lines) == sum(line.endswith(b"$End" + section) for line in lines) == 1
    if is_binary == b"0":
        at = lines.index(b"$Nodes") + 1
        assert int(lines[at].split()[1]) == len(mesh.x)


def test_nibabel_writes_what_is_read(tmp_path):
    """Volumes are written as NRRD; the affine is that of nibabel, in metres."""
    nibabel = pytest.importorskip("nibabel")
    values = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
    affine = np.array([[-0.7, 0, 0.1, 5], [0, 0.8, 0, -3], [0.05, 0, 1.5, 2], [0, 0, 0, 1]])
    nibabel.save(nibabel.Nifti1Image(values, affine), tmp_path / "v.nii.gz")
    read = om.Volume.load(tmp_path / "v.nii.gz")
    assert np.array_equal(read.values, values)
    assert read.affine[:3] == pytest.approx(1e-3 * affine[:3], abs=1e-9)


def test_a_dicom_series_is_read_by_dcm2niix(monkeypatch, tmp_path):
    """By a script in its place, which writes a volume of nibabel; without it the message says what to install."""
    nibabel = pytest.importorskip("nibabel")
    i, j, k = np.meshgrid(*[np.arange(16) - 7.5] * 3, indexing="ij")
    values = (i**2 + j**2 + k**2 < 40).astype(np.uint8)
    nibabel.save(nibabel.Nifti1Image(values, np.diag([3, 3, 3, 1])), tmp_path / "v.nii")
    (tmp_path / "series").mkdir()
    (tmp_path / "tmp").mkdir()
    (tmp_path / "series/IM1").write_bytes(bytes(128) + b"DICM")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    with pytest.raises(om.Error, match="dcm2niix, which is not installed"):
        om.Volume.load(tmp_path / "series")
    (tmp_path / "bin").mkdir()
    script = tmp_path / "bin/dcm2niix"
    script.write_text(f'#!/bin/sh\n/bin/cp {tmp_path}/v.nii "$8/1_ct.nii"\n')
    script.chmod(0o755)
    monkeypatch.setenv("PATH", str(script.parent))
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    assert np.array_equal(om.Volume.load(tmp_path / "series").values, values)
    patient = build_patient(tmp_path / "series")
    assert patient.mesh.volume == pytest.approx(values.sum() * 27e-9, rel=0.05) and patient.name == "series"
    assert not list((tmp_path / "tmp").iterdir())


def build_patient(path):
    return om.build_patient(path, edge=0.006, label=1, has_bending_test=False)


def test_pynrrd_reads_volumes(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    values = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
    affine = np.diag([0.0007, 0.0008, 0.0015, 1])
    affine[:3, 3] = 0.001, 0.002, 0.003
    om.Volume(values, affine=affine).save(tmp_path / "v.nrrd")
    read, header = nrrd.read(str(tmp_path / "v.nrrd"))
    assert np.array_equal(read, values) and header["space"] == "right-anterior-superior"
    assert header["space directions"] == pytest.approx(np.diag([0.7, 0.8, 1.5]))
    assert header["space origin"] == pytest.approx([1, 2, 3])


def test_pynrrd_writes_what_is_read(tmp_path):
    """Also axes that are not of space, which pynrrd marks by rows of NaN."""
    nrrd = pytest.importorskip("nrrd")
    values = np.arange(48, dtype=np.uint8).reshape(2, 2, 3, 4)
    directions = np.vstack([[np.nan] * 3, np.diag([0.7, 0.8, 1.5])])
    nrrd.write(str(tmp_path / "v.nrrd"), values,
               {"space": "right-anterior-superior", "space directions": directions, "space origin": [1, 2, 3]})
    read = om.Volume.load(tmp_path / "v.nrrd", entry=1)
    assert np.array_equal(read.values, values[1]) and read.spacing == pytest.approx([0.0007, 0.0008, 0.0015])


def test_h5py_reads_recordings(mesh, tmp_path):
    h5py = pytest.importorskip("h5py")
    with om.Recorder(tmp_path / "r.vtkhdf", mesh, point={"speed": 1}) as recorder:
        for i in range(3):
            recorder.add(0.1 * i, mesh.x + 0.001 * i, speed=np.full((len(mesh.x), 1), i))
    with h5py.File(tmp_path / "r.vtkhdf") as file:
        root = file["VTKHDF"]
        assert {"Type", "Version"} <= set(root.attrs)
        steps = []
        file.visititems(lambda name, item: steps.append(item) if name.endswith("Steps") else None)
        assert steps and all(int(step.attrs["NSteps"]) == 3 for step in steps)
