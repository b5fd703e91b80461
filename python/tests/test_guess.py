"""What somebody types who guesses: it works, or the error says what does."""
import inspect
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


def test_lengths_in_millimetres_are_refused_with_the_same_in_metres(box):
    ball = np.ones((3, 3, 3), np.uint8)
    with pytest.raises(ValueError, match="2 mm is 0.002"):
        om.Volume(ball, 2)
    with pytest.raises(ValueError, match='6 mm is 0.006 or "6 mm"'):
        om.build_patient(ball, 6, spacing=0.002)
    tissue = om.Tissue(box, element="linear")
    with pytest.raises(ValueError, match="radius: 5 m .* 5 mm is 0.005"):
        tissue.grasp(box.x[0], radius=5)
    assert tissue.grasp([0.04, 0.01, 0.01], radius="11 mm") == tissue.grasp([0.04, 0.01, 0.01], radius=0.011) > 0
    with pytest.raises(ValueError, match="spacing: 3 m"):
        om.Scan.from_depth(np.zeros((4, 4)), om.Camera(width=4, height=4), spacing=3)
    with pytest.raises(ValueError, match="far: 500 m .* 500 mm is 0.5"):
        om.Camera(far=500)
    long = om.TetMesh(1000 * box.x, box.tet, sets=box.sets)
    (text, file), = warned(lambda: om.Tissue(long, element="linear"))
    assert "40 m long" in text and "0.001" in text and file == __file__
    assert not warned(lambda: om.Tissue(box, element="linear"))


def test_an_array_without_spacing_says_what_is_needed():
    with pytest.raises(TypeError, match='spacing=.* unit="mm"'):
        om.build_patient(np.ones((3, 3, 3), np.uint8), 0.002)


@pytest.mark.parametrize("make", [om.Tissue, om.Body])
def test_a_material_by_name_says_what_works(make, box):
    with pytest.raises(TypeError, match='young="3 kPa"'):
        make(box if make is om.Tissue else om.Scene(), material="liver")


def test_a_body_takes_the_settings_of_its_tissue():
    scene = om.Scene()
    scene.tissue.cells, scene.tissue.element = (4, 4, 1), "linear"
    body = om.Body(scene, young="4 kPa", poisson=0.4, law="corotational")
    assert (body.scene.tissue.young, body.scene.tissue.poisson, body.scene.tissue.law) == (4000, 0.4, om.capi.OmLaw.COROTATIONAL)
    assert scene.tissue.young == 3000  # the caller's is as it was
    with pytest.raises(AttributeError, match="did you mean 'young'"):
        om.Body(scene, yung=3)
    with pytest.raises(AttributeError, match="did you mean 'nworker'"):
        om.Body(scene, nworkr=3)
    with pytest.raises(TypeError, match="built already"):
        om.Body(body.site, scene=scene, young=3000)


def falling(box):
    return om.Tissue(om.TetMesh(box.x, box.tet), element="linear")


def test_tissue_that_nothing_holds_warns_once_at_the_line_of_the_caller(box):
    tissue = falling(box)
    (text, file), = warned(lambda: (tissue.step(), tissue.step()))
    assert "falls" in text and file == __file__
    assert warned(lambda: om.Contact(falling(box)).step())
    assert warned(lambda: om.Press(falling(box), om.Probe("sphere", radius=0.01)).step([0, 0, 0.1]))
    assert not warned(lambda: om.Contact(falling(box), planes=[((0, 0, 0), (0, 0, 1))]).step())

    def rest():
        with pytest.raises(om.Error):
            falling(box).find_rest()

    assert "set_attachment" in warned(rest)[0][0]
    scene = om.Scene()
    scene.tissue.cells, scene.tissue.element, scene.tissue.has_board = (4, 4, 1), "linear", False
    body = om.Body(scene)
    body.set_attachment([])
    assert "falls" in warned(body.step)[0][0] and not warned(body.step)
    held = om.Body(scene)
    assert held.attached.any() and not warned(held.step)


def test_a_camera_in_one_line():
    """Pixels as OpenCV counts them: the centre of the first one is (0, 0), of the library (0.5, 0.5)."""
    pose = np.array([[0, 0, 1, 0.1], [-1, 0, 0, 0.2], [0, -1, 0, 0.3], [0, 0, 0, 1.0]])
    camera = om.Camera(fx=500, fy=510, cx=310, cy=235, width=640, height=480, pose=pose, distortion=(-0.1, 0.02))
    at = np.array([0.01, -0.02, 0.25, 1.0])  # in the camera's frame
    u, v = at[:2] / at[2]
    bent = 1 - 0.1 * (u * u + v * v) + 0.02 * (u * u + v * v) ** 2  # Brown's radial terms
    assert camera.project((pose @ at)[:3]) == pytest.approx(np.array([[500 * u * bent + 310.5, 510 * v * bent + 235.5]]), abs=1e-6)
    matrix = [[500, 0, 310], [0, 510, 235], [0, 0, 1]]
    assert bytes(om.Camera.from_matrix(matrix, 640, 480, pose, (-0.1, 0.02))) == bytes(camera)
    plain = om.Camera(fx=500, width=640, height=480)
    assert plain.matrix == pytest.approx(np.eye(4)) and (plain.lens.fy, plain.lens.cx, plain.lens.cy) == (500, 320, 240)
    assert om.Camera(fx=500, width=64, height=48, eye=(0, 0, 1), target=(0, 0, 0), up=(0, 1, 0)).matrix[:3, 2] == pytest.approx([0, 0, -1])
    for wrong, text in (({"fx": 500}, "width and height"), ({"cx": 3, "width": 4, "height": 4}, "without fx"),
                        ({"fx": 5, "lens": {"fx": 5}, "width": 4, "height": 4}, "not both"), ({"pose": pose, "eye": (0, 0, 0)}, "leave out eye")):
        with pytest.raises(ValueError, match=text):
            om.Camera(**wrong)


def test_a_depth_picture_becomes_a_scan():
    """A plane across the axis: its points are where the intrinsics put them."""
    camera = om.Camera(fx=100, width=40, height=30, pose=np.eye(4))
    scan = om.Scan.from_depth(np.full((30, 40), 0.2), camera, spacing="2 mm")
    assert scan.x[:, 2] == pytest.approx(np.full(len(scan.x), 0.2), abs=1e-6) and len(scan.tri) > 100
    assert np.ptp(scan.x[:, 0]) == pytest.approx(0.2 / 100 * 39, rel=0.15)


def test_a_word_that_is_not_taken_is_answered_with_the_nearest():
    """Of functions of C's fields, and of those with named arguments alone, constructors, methods and class methods."""
    ball, pixel = np.ones((3, 3, 3), np.uint8), np.zeros((4, 4))
    camera = om.Camera(width=4, height=4)
    for call, near in ((lambda: om.Camera(widht=3), "width"), (lambda: om.Volume(ball, spaccing=1), "spacing"),
                       (lambda: om.build_patient(ball, 0.002, spacing=0.002, afine=1), "affine"),
                       (lambda: camera.cloud(pixel, norml=pixel), "normal"), (lambda: om.Volume.load("a", entri=1), "entry"),
                       (lambda: om.make_ct(sead=1), "seed"), (lambda: om.Chart("a", {}, x_lable="b"), "x_label"),
                       (lambda: om.retract(om.Scene(), out_dri="a"), "out_dir"), (lambda: om.Scan.from_depth(pixel, camera, maks=pixel), "mask"),
                       (lambda: om.Press(1, om.Probe("sphere"), surfase=1), "surface")):
        with pytest.raises((TypeError, AttributeError), match=f"did you mean '{near}'"):
            call()
    with pytest.raises(AttributeError, match="it has .*keep_all"):  # nothing is near: what there is
        om.build_patient(ball, 0.002, spacing=0.002, qqqqqq=1)
    assert str(inspect.signature(om.Camera.cloud)).startswith("(self, depth")  # for help() and editors

    def wrong(**_):
        return np.zeros(3, dtyp=float)

    with pytest.raises(TypeError, match="dtyp") as error:  # an error inside of a function stays its own
        om.calibrate(lambda p: wrong(), [om.Parameter("a", 0.001, 0.1, 0.05)], 1, noise=1e-4)
    assert "did you mean" not in str(error.value)
