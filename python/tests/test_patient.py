"""Volumes, meshes and patient models: against volumes computed by hand, files and other libraries."""
# PARTS 4
import ctypes
import functools
import json
import os
import pickle
import signal
import struct
import threading
import time

import numpy as np
import pytest

import omentum as om

build = functools.partial(om.build_patient, has_bending_test=False)  # which takes as long as the rest
ELLIPSOID = 4 / 3 * np.pi * 0.036 * 0.028 * 0.020  # m^3


def test_a_label_map_becomes_a_mesh_of_its_volume(ellipsoid):
    patient = build(ellipsoid, edge=0.006, label=1)
    assert patient.mesh.volume == pytest.approx(ELLIPSOID, rel=0.02)
    centre = patient.mesh.x.mean(axis=0)
    assert centre == pytest.approx([0.043] * 3, abs=0.001)  # voxel 21.5 of 2 mm
    assert patient.mesh.x.min(axis=0) == pytest.approx(0.043 - np.array([0.036, 0.028, 0.020]), abs=0.002)
    assert np.degrees(patient.mesh.quality().dihedral_min) > 10
    assert np.isnan(patient.report.bending_error) and patient.report.nvoxel == (ellipsoid.values == 1).sum()


def test_the_affine_places_the_mesh(ellipsoid):
    affine = np.diag([-0.002, -0.002, 0.002, 1.0])  # as a file in LPS has it
    affine[:3, 3] = (0.1, 0.2, 0.3)
    moved = build(om.Volume(ellipsoid.values, affine=affine), edge=0.008, label=1)
    assert moved.mesh.x.mean(axis=0) == pytest.approx([0.1 - 0.043, 0.2 - 0.043, 0.3 + 0.043], abs=0.001)
    assert moved.mesh.volume == pytest.approx(ELLIPSOID, rel=0.04)


def test_a_sheet_of_fat_on_an_organ(ellipsoid):
    patient = om.build_patient(ellipsoid, edge=0.006, label=1, sheet={"thickness": 0.006}, attach="border:left 25 %")
    assert 0 < patient.report.bending_error < 0.1
    assert {"attachment", "underside", "top", "border"} <= set(patient.mesh.sets)
    assert patient.organ.volume == pytest.approx(ELLIPSOID, rel=0.05)
    assert len(patient.roi_point) == 200
    held = patient.mesh.x[patient.mesh.sets["attachment"]]
    assert held[:, 0].max() < patient.mesh.x[:, 0].mean()  # left is -x
    same = pickle.loads(pickle.dumps(patient))
    assert np.allclose(same.mesh.x, patient.mesh.x, atol=1e-9) and np.array_equal(same.mesh.tet, patient.mesh.tet)
    assert np.allclose(same.roi_point, patient.roi_point, atol=1e-9) and same.materials == patient.materials


def test_a_ct_made_here_becomes_fat_over_an_organ(tmp_path):
    ct, truth = om.make_ct(5, organ_half=0.048, fat_half=0.032)
    labels = om.label_ct(ct)
    fat, organ, tumour = (truth.values == om.CT_LABELS[name] for name in ("fat", "organ", "tumour"))
    assert truth.labels().keys() == {1, 2, 3} and np.array_equal(labels.affine, truth.affine)
    assert ct.values[fat].mean() < -50 < 0 < ct.values[organ].mean() < ct.values[tumour].mean() < 300  # HU
    for mask, label in ((fat, 1), (organ, 2)):
        found = labels.values == label
        assert 2 * (mask & found).sum() / (mask.sum() + found.sum()) > 0.9
    patient = build(labels, edge=0.005, label=1, over={"label": [2, 3], "roi": 3, "reach": 0.0035}, attach="underside:superior 35 %")
    assert patient.up == pytest.approx([0, 1, 0]) and {"underside", "top", "attachment"} <= set(patient.mesh.sets)
    below = np.isin(labels.values, (2, 3)).sum() * 0.0015**3
    assert patient.organ.volume == pytest.approx(below, rel=0.05)
    middle = labels.affine[:3, :3] @ np.mean(np.nonzero(labels.values == 3), axis=1) + labels.affine[:3, 3]
    assert np.linalg.norm((patient.roi_center - middle)[[0, 2]]) < 0.004 and len(patient.roi_point) == 200
    labels.save(tmp_path / "labels.nrrd")
    ct.save(tmp_path / "ct.nrrd")
    same = om.Volume.load(tmp_path / "labels.nrrd")
    assert same.values.dtype == np.uint8 and np.array_equal(same.values, labels.values) and same.affine == pytest.approx(labels.affine)
    assert np.array_equal(om.Volume.load(tmp_path / "ct.nrrd").values, ct.values)
    with pytest.raises(om.Invalid):
        om.Volume(labels.values.astype(np.int64), spacing=0.001).save(tmp_path / "wide.nrrd")
    with pytest.raises(om.Invalid, match="voxel"):
        om.make_ct(voxel=-1)


def test_attached_vertices_are_one_number(tmp_path):
    """Tissue over an organ: of the model here, in its report, in a body of quadratic elements, and in a dry run."""
    _, truth = om.make_ct(5, organ_half=0.036, fat_half=0.022, voxel=0.003)
    patient = build(truth, edge=0.012, label=1, over={"label": [2, 3], "roi": 3}, attach="underside:superior 35 %", allow_loss=True)
    patient.save(tmp_path / "model")
    number = len(patient.mesh.sets["attachment"])
    assert number > 5 and json.loads((tmp_path / "model/report.json").read_text())["sets"]["attachment"] == number
    scene = om.Scene.parse("name: fat\ntissue: {source: patient, file: patient.yaml}\nattachments: {kind: set}\ntask: {grid: 3}\n")
    scene.data_root = str(tmp_path / "model")
    for body in (om.Body(patient), om.Body(scene)):
        assert body.attached.sum() == number and len(body.attached) == len(patient.mesh.x)
    tissue = om.Tissue(patient, element="linear")
    assert tissue.attached.sum() == number
    estimate, definition = om.capi.OmRetractEstimate(), om.lib.om_retract_default_def(ctypes.byref(scene))
    om.lib.om_retract_check(ctypes.byref(definition), None, ctypes.byref(estimate))
    assert estimate.twin_nattached == number


def test_several_labels_are_refused_until_one_is_named(ellipsoid):
    assert ellipsoid.labels() == {1: int((ellipsoid.values == 1).sum()), 5: 27}
    with pytest.raises(om.Invalid, match="label"):
        build(ellipsoid, edge=0.006)
    with pytest.raises(AttributeError, match="thickness"):
        build(ellipsoid, edge=0.006, label=1, sheet={"thicknes": 0.006})
    with pytest.raises(om.Invalid, match="attach|border"):
        build(ellipsoid, edge=0.006, label=1, sheet={"thickness": 0.006}, attach="bordr:left")


def test_volumes_are_read_with_type_and_axes(tmp_path):
    values = np.arange(24, dtype=np.int16).reshape(4, 3, 2)
    head = ("NRRD0004\ntype: int16\ndimension: 3\nspace: right-anterior-superior\nsizes: 4 3 2\n"
            "space directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (5,6,7)\nencoding: raw\nendian: little\n\n")
    path = tmp_path / "v.nrrd"
    path.write_bytes(head.encode() + values.tobytes(order="F"))
    volume = om.Volume.load(path)
    assert volume.values.dtype == np.int16 and np.array_equal(volume.values, values)
    assert volume.affine == pytest.approx(np.array([[0.001, 0, 0, 0.005], [0, 0.002, 0, 0.006], [0, 0, 0.003, 0.007], [0, 0, 0, 1]]))
    with pytest.raises(om.Invalid, match="voxels take"):
        om.Volume.load(path, max_bytes=10)
    with pytest.raises(om.FileFailed, match="missing.nrrd"):
        om.Volume.load(tmp_path / "missing.nrrd")


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.float32])
def test_volumes_are_written_and_read_again(kind, tmp_path):
    values = (np.random.default_rng(5).uniform(0, 200, (5, 4, 3))).astype(kind)
    affine = np.array([[0, -0.002, 0, 0.01], [0.001, 0, 0, 0.02], [0, 0, 0.003, 0.03], [0, 0, 0, 1.0]])
    om.Volume(values, affine=affine).save(tmp_path / "v.nrrd")
    same = om.Volume.load(tmp_path / "v.nrrd")
    assert same.values.dtype == kind and np.array_equal(same.values, values) and same.affine == pytest.approx(affine, abs=1e-9)
    with pytest.raises(om.Invalid):
        om.Volume(np.array([[[40000]]]), spacing=0.001).save(tmp_path / "w.nrrd")


def nifti(values, slope, inter):
    """A NIfTI-1 file of 16-bit integers and voxels of 1, 2, 3 mm, byte by byte."""
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *values.shape, 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 4, 16)
    struct.pack_into("<8f", head, 76, 1, 1, 2, 3, 1, 1, 1, 1)
    struct.pack_into("<3f", head, 108, 352, slope, inter)
    struct.pack_into("<b", head, 123, 2)
    struct.pack_into("<2h", head, 252, 0, 1)
    struct.pack_into("<12f", head, 280, 1, 0, 0, 5, 0, 2, 0, 6, 0, 0, 3, 7)
    struct.pack_into("<4s", head, 344, b"n+1")
    return bytes(head) + values.astype("<i2").tobytes(order="F")


@pytest.mark.parametrize("slope, inter", [(1, 0), (2, 0), (1, -1024), (2, -1024), (-0.5, 3)])
def test_stored_values_are_scaled_to_intensities(slope, inter, tmp_path):
    stored = np.arange(24, dtype=np.int16).reshape(4, 3, 2)
    (tmp_path / "v.nii").write_bytes(nifti(stored, slope, inter))
    values = om.Volume.load(tmp_path / "v.nii").values
    assert values.shape == (4, 3, 2) and values[0, 0, 0] == inter and values[3, 2, 1] == slope * 23 + inter
    assert np.array_equal(values, np.array([slope * v + inter for v in range(24)]).reshape(4, 3, 2))
    assert (values.dtype == np.int16) == ((slope, inter) == (1, 0))


def test_sides_of_a_voxel_belong_to_its_axes():
    """Axes turned by 90 degrees, and the columns of a rotation by 3-4-5 with sides of 5, 10 and 2 mm."""
    turned = np.diag([0.0, 0, 0.003, 1])
    turned[0, 1], turned[1, 0] = -0.002, 0.001
    assert om.Volume(np.zeros((2, 2, 2), np.uint8), affine=turned).spacing == pytest.approx([0.001, 0.002, 0.003])
    oblique = np.array([[0.003, -0.008, 0, 0], [0.004, 0.006, 0, 0], [0, 0, 0.002, 0], [0, 0, 0, 1]])
    assert om.Volume(np.zeros((2, 2, 2), np.uint8), affine=oblique).spacing == pytest.approx([0.005, 0.010, 0.002])


def test_lengths_have_their_unit(ellipsoid):
    """2 mm written as 2 would be a patient of 90 m."""
    values = ellipsoid.values
    with pytest.raises(ValueError, match=r'2 mm is 0\.002; for millimetres add unit="mm"'):
        om.Volume(values, spacing=2.0)
    with pytest.raises(ValueError, match="metres"):
        om.Volume(values, affine=np.diag([0.002, 0.002, 2.0, 1.0]))
    same = om.Volume(values, spacing=(2, 2, 2), unit="mm")
    assert same.affine == pytest.approx(ellipsoid.affine, abs=1e-15)
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    affine[:3, 3] = (10, 20, 30)
    assert om.Volume(values, affine=affine, unit="mm").affine[:3, 3] == pytest.approx([0.010, 0.020, 0.030], abs=1e-15)
    with pytest.raises(ValueError, match="one of m, cm, mm, um"):
        om.Volume(values, spacing=2, unit="inch")
    patient = build(values, edge="8 mm", label=1, spacing=2, unit="mm")
    assert patient.mesh.volume == pytest.approx(ELLIPSOID, rel=0.04)
    with pytest.raises(ValueError, match='edge="8 foot"'):
        build(ellipsoid, edge="8 foot")
    with pytest.raises(TypeError, match="spacing: for an array only"):
        build(ellipsoid, edge=0.008, spacing=0.002)


def test_nifti_of_another_writer_becomes_a_patient(ellipsoid, tmp_path):
    """A file written by nibabel, in millimetres and with an oblique affine: voxels, places, and the mesh."""
    nibabel = pytest.importorskip("nibabel")
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = 2 * turn, (-30, 12, 5)
    nibabel.save(nibabel.Nifti1Image(ellipsoid.values, affine), tmp_path / "labels.nii.gz")
    volume = om.Volume.load(tmp_path / "labels.nii.gz")
    assert np.array_equal(volume.values, ellipsoid.values)
    metres = np.diag([1e-3, 1e-3, 1e-3, 1]) @ affine
    assert volume.affine == pytest.approx(metres, abs=1e-7)
    from_file, from_numpy = (build(s, edge=0.008, label=1) for s in (tmp_path / "labels.nii.gz", om.Volume(ellipsoid.values, affine=metres)))
    centre = (metres @ [21.5, 21.5, 21.5, 1])[:3]
    for patient in (from_file, from_numpy):
        assert patient.mesh.volume == pytest.approx(ELLIPSOID, rel=0.04) and patient.mesh.x.mean(axis=0) == pytest.approx(centre, abs=1e-3)
    back = nibabel.load(tmp_path / "labels.nii.gz")
    assert np.array_equal(np.asarray(back.dataobj), volume.values)


def test_meshes_survive_files_and_pickles(box, tmp_path):
    box.label[3] = 7
    for name in ("m.vtu", "m.vtk", "m.msh"):
        box.save(tmp_path / name)
        same = om.TetMesh.load(tmp_path / name, unit=1)
        assert same.x == pytest.approx(box.x, abs=1e-12) and np.array_equal(same.tet, box.tet)
        assert np.array_equal(same.label, box.label) and np.array_equal(same.sets["attachment"], box.sets["attachment"])
    assert np.array_equal(pickle.loads(pickle.dumps(box)).tet, box.tet)
    assert box.volume == pytest.approx(1.6e-5) and box.refined().volume == pytest.approx(1.6e-5)
    surface, vert = box.boundary()
    assert surface.volume == pytest.approx(1.6e-5) and np.array_equal(box.x[vert], surface.x)
    assert surface.normals()[np.argmax(surface.x @ [1, 1, 1])] == pytest.approx(np.ones(3) / 3**0.5, abs=0.2)
    surface.require_closed()
    with pytest.raises(om.Invalid, match="edge|open|closed"):
        om.Surface(surface.x, surface.tri[1:]).require_closed()


def test_damaged_surfaces_are_repaired(alive):
    """Two boxes that overlap in 10 x 20 x 20 mm, then holes, a turned triangle and one that occurs again."""
    (x, tri), (x2, tri2) = ((s.x, s.tri) for s in (om.TetMesh.box((0.04, 0.02, 0.02), (16, 8, 8), low=(low, 0, 0)).boundary()[0]
                                                   for low in (0, 0.03)))
    whole = om.Surface(x, tri)
    same, report = whole.repaired()
    assert same.volume == pytest.approx(1.6e-5) and not report.found and str(report) == "" and report.npart == 1
    bad = np.vstack([np.delete(tri, 10, axis=0), tri[20:21]])
    bad[3] = bad[3, ::-1]
    mended, report = om.Surface(x, bad).repaired("mend", max_hole=0.1)
    mended.require_closed()
    assert mended.volume == pytest.approx(1.6e-5) == report.volume and report.found == {"duplicate": 1, "winding": 1, "hole": 1}
    assert len(report.notes) == 3 and report.notes[2].startswith("the surface has 1 hole, at (") and "2.5 mm across" in str(report)
    assert len(bad) == len(tri)  # what was given stays
    _, report = om.Surface(np.vstack([x, x2 + (0, 0.001, 0.001)]), np.vstack([tri, tri2 + len(x)])).repaired()
    assert report.volume == pytest.approx(3.2e-5 - report.overlap) and report.overlap == pytest.approx(0.01 * 0.019**2, rel=0.02)
    with pytest.raises(om.Invalid, match="1 triangle that occurs again, at"):
        om.Surface(x, bad).repaired("strict")
    with pytest.raises(om.Invalid, match="hole larger than"):
        om.Surface(x, bad).repaired(max_hole=0.001)
    with pytest.raises(ValueError, match="did you mean 'mend'"):
        whole.repaired("mended")
    with pytest.raises(AttributeError, match="max_hole"):
        whole.repaired(max_holes=1)
    assert alive() == 0


def test_cracked_meshes_are_welded(box):
    other = om.TetMesh.box((0.04, 0.02, 0.02), (4, 2, 2), low=(0.04, 0, 0))
    cracked = om.TetMesh(np.vstack([box.x, other.x]), np.vstack([box.tet, other.tet + len(box.x)]), sets=box.sets)
    welded, report = cracked.welded()
    assert (report.nvert, report.nface) == (9, 8) and report.first[0] == pytest.approx(0.04)
    assert len(welded.x) == 2 * len(box.x) - 9 and welded.quality().npart == 1 < cracked.quality().npart
    assert welded.volume == pytest.approx(3.2e-5) and np.array_equal(welded.x[welded.sets["attachment"]], box.x[box.sets["attachment"]])
    assert welded.welded()[1].nface == 0


def test_wrong_meshes_are_refused(box):
    with pytest.raises(ValueError, match="n x 4"):
        om.TetMesh(box.x, box.tet[:, :3])
    bad = om.TetMesh(box.x, box.tet.copy())
    bad.tet[5, 2] = 10**6
    with pytest.raises(om.Invalid, match="5"):
        bad.validate()
    with pytest.raises(om.Invalid):
        om.Tissue(bad)


def test_meshio_both_ways(box):
    meshio = pytest.importorskip("meshio")
    same = om.TetMesh.from_meshio(box.to_meshio())
    assert np.array_equal(same.x, box.x) and np.array_equal(same.tet, box.tet)
    assert np.array_equal(same.sets["attachment"], box.sets["attachment"])
    surface, _ = box.boundary()
    again = om.Surface.from_meshio(surface.to_meshio())
    assert again.volume == pytest.approx(box.volume) and len(again.x) == len(surface.x)
    # triangles and tetrahedra in one mesh, in millimetres: only the vertices of the triangles
    both = meshio.Mesh(1e3 * box.x, [("tetra", box.tet), ("triangle", np.arange(12).reshape(4, 3)[:2])])
    assert len(om.Surface.from_meshio(both, unit=1e-3).x) == 6
    assert om.TetMesh.from_meshio(both, unit=1e-3).volume == pytest.approx(box.volume)


def test_files_of_meshio_are_read_and_ours_by_meshio(box, tmp_path):
    meshio = pytest.importorskip("meshio")
    box.label[:] = np.arange(len(box.tet)) % 3
    for name in ("a.msh", "a.vtk"):  # meshio reads no .vtu with texts, which ours has
        box.save(tmp_path / name)
        theirs = om.TetMesh.from_meshio(meshio.read(tmp_path / name))
        assert theirs.x == pytest.approx(box.x, abs=1e-12) and np.array_equal(theirs.tet, box.tet), name
    for name in ("b.vtu", "b.vtk", "b.msh"):
        box.to_meshio().write(tmp_path / name, file_format="gmsh" if name == "b.msh" else None)  # meshio's default is Ansys'
        ours = om.TetMesh.load(tmp_path / name, unit=1)
        assert ours.x == pytest.approx(box.x, abs=1e-12) and np.array_equal(ours.tet, box.tet), name
    surface, _ = box.boundary()
    surface.to_meshio().write(tmp_path / "s.stl")
    assert om.Surface.load(tmp_path / "s.stl", unit=1).volume == pytest.approx(box.volume, rel=1e-5)


def test_pictures(tmp_path):
    picture = np.arange(5 * 7 * 3, dtype=np.uint8).reshape(5, 7, 3)
    om.save_png(tmp_path / "p.png", picture)
    assert np.array_equal(om.load_png(tmp_path / "p.png"), picture)
    with pytest.raises(ValueError):
        om.save_png(tmp_path / "q.png", picture.astype(float))


# ---- progress ----


def test_progress_is_reported_and_cancels(ellipsoid, alive):
    seen = []
    build(ellipsoid, edge=0.008, label=1, progress=lambda *report: seen.append(report))
    assert seen and all(isinstance(stage, str) and 0 <= done <= total for stage, done, total in seen)
    with pytest.raises(om.Cancelled):
        build(ellipsoid, edge=0.008, label=1, progress=lambda *_: False)
    with pytest.raises(ZeroDivisionError):
        build(ellipsoid, edge=0.008, label=1, progress=lambda *_: 1 / 0)
    assert alive() == 0


def test_ctrl_c_ends_a_long_call(ellipsoid, alive):
    """SIGINT in the middle of a build that would take many seconds."""
    def interrupt():
        time.sleep(0.1)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    begin = time.monotonic()
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        while time.monotonic() < begin + 60:
            build(ellipsoid, edge=0.002, label=1)
    thread.join()
    assert time.monotonic() - begin < 20
    assert alive() == 0


def test_ctrl_c_at_the_end_of_a_call_frees_its_result(ellipsoid, alive):
    """SIGINT in the last report, when the call succeeds all the same."""
    def report(stage, done, total):
        last[:] = [stage, done, total]
        if not is_first and last == wanted:
            os.kill(os.getpid(), signal.SIGINT)

    is_first, last, wanted = True, [], []
    build(ellipsoid, edge=0.01, label=1, progress=report)
    is_first, wanted = False, list(last)
    with pytest.raises(KeyboardInterrupt):
        build(ellipsoid, edge=0.01, label=1, progress=report)
    assert alive() == 0
