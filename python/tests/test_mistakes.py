"""Mistakes that somebody makes in the first hour: each error says what to do next."""
import warnings

import numpy as np
import pytest

import omentum as om


def warned(call):
    """The warnings of a call, each with the file that it names."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        call()
    return [(str(w.message), w.filename) for w in found]


def refused(call, *words):
    """The call raises, and its sentence has each of these words."""
    with pytest.raises((TypeError, ValueError, AttributeError, OSError)) as error:
        call()
    assert all(word in str(error.value) for word in words), str(error.value)


BALL = (np.indices((12, 12, 12)) - 5.5) ** 2
BALL = (BALL.sum(axis=0) < 25).astype(np.uint8)  # of 10 voxels across


def test_a_map_that_cannot_be_meshed_says_why():
    """Sides of voxels, order of axes, values and labels, as people have them who come from 3D Slicer, SimpleITK and nibabel."""
    assert om.Volume(BALL, "0.8 mm").spacing == pytest.approx([8e-4] * 3) and om.Volume(BALL, ["1 mm", "1 mm", 0.002]).spacing[2] == 0.002
    for wrong in ((1, 1), (1, 1, 0), (-1, 1, 1), (1, np.nan, 1)):
        refused(lambda: om.Volume(BALL, wrong, unit="mm"), "spacing=", "three, for x, y and z")
    slices_first = np.zeros((5, 8, 8), np.uint8)
    (text, file), = warned(lambda: om.Volume(slices_first, (1, 1, 3), unit="mm"))
    assert "transpose(2, 1, 0)" in text and file == __file__
    assert not warned(lambda: om.Volume(slices_first.T, (1, 1, 3), unit="mm")) and not warned(lambda: om.Volume(slices_first, 1, unit="mm"))
    refused(lambda: om.Volume(BALL[..., None], 0.001), "values[..., 0]")
    assert om.Volume(BALL.astype(np.float16), 0.001).values.dtype == np.float32

    def build(values=BALL, edge="5 mm", spacing=2, unit="mm", **more):
        return om.build_patient(values, edge, spacing=spacing, unit=unit, has_bending_test=False, **more)

    refused(lambda: build(0 * BALL), "the volume holds no label", "every voxel is 0")
    refused(lambda: build(0.7 * BALL), "intensities of 0 to 0.7", "window_lo=LO")
    refused(lambda: build(BALL + (BALL.cumsum(axis=0) > 5)), "holds 2 labels", "label=N", "all_labels=True")
    refused(lambda: build(spacing=2, unit="um"), "the body is 0.02 mm long and an edge 5 mm")
    refused(lambda: build(edge=None), "edge=None", '"8 mm"')
    refused(lambda: build(label=1.5), "label=1.5", "whole number")
    assert len(build(label=1.0).mesh.tet) == len(build(label=1).mesh.tet) > 100
    (text, _), = warned(lambda: build(np.ones((8, 8, 8), np.uint8)))
    assert "the volume cuts the organ" in text


def test_what_holds_or_covers_an_organ_is_asked_for_in_words():
    def build(**more):
        return om.build_patient(BALL, "5 mm", spacing=2, unit="mm", **more)

    refused(lambda: build(attach="border:medial 25%"), "sheet={", "set_attachment")
    refused(lambda: build(sheet={"thickness": 8}), "sheet thickness: 8000 mm")
    refused(lambda: build(sheet={"thickness": "8 feet"}), "sheet: thickness", "units: m, cm, mm")
    refused(lambda: build(sheet="lateral"), "a dictionary is needed", "thickness")


def test_a_path_that_leads_nowhere_names_the_nearest_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    om.Volume(BALL, 0.002).save("organ.seg.nrrd")
    for call in (lambda: om.build_patient("orgn.seg.nrrd", "5 mm"), lambda: om.Volume.load("organ.seg.nrd")):
        refused(call, 'did you mean "organ.seg.nrrd"')
    refused(lambda: om.TetMesh.load("liver.msh"), f"No such file or directory in {tmp_path}")
    refused(lambda: om.Scene.load("scenes/sheet.yaml"), f"there is no folder {tmp_path / 'scenes'}")
    for call in (lambda: om.Patient.load("organ.seg.nrrd"), lambda: om.Body("organ.seg.nrrd"), lambda: om.retract("organ.seg.nrrd")):
        refused(call, "is a volume", 'build_patient("organ.seg.nrrd"')


def test_what_is_no_mesh_or_material_says_what_makes_one(box):
    surface, _ = box.boundary()
    for wrong, words in (("a.nrrd", "build_patient"), (om.Volume(BALL, 0.001), "build_patient"), (box.x, "TetMesh(x, tet)"), (surface, "no inside")):
        refused(lambda: om.Tissue(wrong), "a TetMesh or a Patient is needed", words)
    refused(lambda: om.view(om.Tissue(box)), "a Body", "plot()")
    refused(lambda: om.Tissue(box, materials=["liver"]), 'young="3 kPa"')
    soft = om.Tissue(box, materials={"young": "2 kPa"})
    assert soft._arguments["materials"] == {"young": "2 kPa"}
    soft.find_rest()
    other = om.Tissue(box, young=2000)
    other.find_rest()
    assert np.array_equal(soft.x, other.x)
    refused(lambda: om.Tissue(box, poisson="0.45"), "poisson='0.45'")
    refused(lambda: om.Tissue(box, gravity=9.81), "gravity=9.81", "three numbers")
    (text, file), = warned(lambda: om.Tissue(box, young=3))
    assert '"3 kPa"' in text and file == __file__
    assert "3 kPa" in warned(lambda: om.Body(om.Scene(), young=3))[0][0]


def test_a_mask_belongs_to_the_vertices_of_the_tissue(box):
    """Of quadratic elements, which have midpoints: a mask of the given mesh would leave these free."""
    tissue = om.Tissue(box)
    assert len(tissue.x) > len(box.x)
    refused(lambda: tissue.set_attachment(box.x[:, 0] < 1e-9), f"a mask of {len(box.x)} for {len(tissue.x)} vertices")
    tissue.set_attachment(tissue.x[:, 0] < 1e-9)
    assert tissue.attached.sum() == (tissue.mesh.x[:, 0] < 1e-9).sum()
    with pytest.raises(AttributeError, match="set_x"):
        tissue.x = box.x
    tissue.step("20 ms")
    assert tissue.time == pytest.approx(0.02)


def test_a_depth_picture_without_depths_says_so():
    camera = om.Camera(fx=100, width=40, height=30)
    for nothing in (np.nan, 0):
        (text, file), = warned(lambda: om.Scan.from_depth(np.full((30, 40), nothing), camera))
        assert "no pixel" in text and file == __file__


def test_an_inverted_element_says_what_to_do(box):
    """Under 60 times its weight a soft block folds with the default law; the law that the message names does not fold."""
    options = {"element": "linear", "young": 1000, "gravity": (0, 0, -600)}
    with pytest.raises(om.NotConverged, match="inverted at rest: .* neo-Hookean"):
        om.Tissue(box, **options).find_rest()
    tissue = om.Tissue(box, law="neo-hookean", **options)
    assert tissue.find_rest(strict=False).ninverted == 0
