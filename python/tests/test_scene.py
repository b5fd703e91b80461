"""Scenes, bodies, cameras, the planner: against the C program's own results, geometry by hand, and each other."""
# PARTS 2
import pickle
import re

import numpy as np
import pytest

import omentum as om


@pytest.fixture
def sheet():
    """The thesis's sheet, coarser, seed 201."""
    scene = om.Scene.load(om.data_path("scenes/sheet.yaml"))
    scene.seed = 201
    scene.tissue.cells = (10, 10, 1)
    scene.tissue.world_cells = (16, 16, 1)
    return scene


@pytest.fixture(scope="module")
def patient(ellipsoid, is_slow):
    """A sheet on an organ."""
    return om.build_patient(ellipsoid, edge=0.006 if is_slow else 0.012, label=1, sheet={"thickness": 0.006, "keep_edge": True},
                            attach="border:left 25 %", allow_loss=True, has_bending_test=False)


# ---- scenes and bodies ----


def test_a_scene_is_read_changed_and_pickled(sheet):
    assert sheet.tissue.young == 3000 and sheet.tissue.size == pytest.approx([0.12, 0.12, 0.005])
    same = pickle.loads(pickle.dumps(sheet))
    assert same.seed == 201 and same.yaml() == sheet.yaml()
    assert om.Scene.parse("name: mine\ntissue:\n  source: sheet\n  young: 4000\n").tissue.young == 4000
    with pytest.raises(om.Invalid, match="yung"):
        om.Scene.parse("name: mine\ntissue:\n  yung: 4000\n", "my.yaml")
    sheet.tissue.element, sheet.tissue.law = "linear", "corotational"
    assert sheet.tissue.element == om.capi.OmTissueElement.ELEMENT_LINEAR and "corotational" in sheet.yaml()
    with pytest.raises(AttributeError, match="did you mean 'young'"):
        sheet.tissue.yong = 1
    with pytest.raises(ValueError, match="OmLaw has no member 'corotated'; did you mean 'corotational'"):
        sheet.tissue.law = "corotated"
    sheet.world.element, sheet.world.law = "quadratic", "neo-hookean"  # ints in C, as -1 says "the twin's"
    assert sheet.world.element == om.capi.OmTissueElement.ELEMENT_QUADRATIC
    assert sheet.world.law == om.capi.OmLaw.NEO_HOOKEAN and "  element: quadratic" in sheet.yaml()
    sheet.world.element = -1
    assert sheet.world.element == -1 and om.Scene.parse(sheet.yaml()).world.element == -1


def test_a_path_is_a_scene(tmp_path):
    path = tmp_path / "one.yaml"
    scene = om.Scene()
    scene.tissue.cells = (4, 4, 1)
    path.write_text(scene.yaml())
    assert np.array_equal(om.Body(path).mesh.x, om.Body(om.Scene.load(str(path))).mesh.x)
    assert len(om.Site(path).mesh.x) == 5 * 5 * 2
    for make in (om.Body, om.SimulatedWorld, om.retract, om.preplan):
        with pytest.raises(TypeError, match="a Scene, or the path of its file, is needed, not int"):
            make(7)
    with pytest.raises(OSError, match="nothere.yaml"):
        om.retract(tmp_path / "nothere.yaml")


def test_a_wrong_name_is_met_with_the_nearest_of_the_function(box):
    for call, near in ((lambda: om.Tissue(box, yuong=3e3), "young"), (lambda: om.retract(om.Scene(), outdir="x"), "out_dir"),
                       (lambda: om.retract(om.Scene(), nworkers=1), "nworker"), (lambda: om.make_ct(sed=1), "seed")):
        with pytest.raises(AttributeError, match=f"did you mean '{near}'"):
            call()


def test_twin_and_world_have_the_same_anatomy(sheet):
    twin, world = sheet.build("twin"), sheet.build("world")
    assert len(world.mesh.x) > 2 * len(twin.mesh.x)
    assert world.roi_center == pytest.approx(twin.roi_center)
    assert world.attached_area == pytest.approx(twin.attached_area, rel=0.15)


def test_a_body_lies_on_its_board_and_is_lifted(sheet, alive):
    body = om.Body(sheet)
    assert body.settle() and body.engine == "fem"
    weight = 1000 * 0.12 * 0.12 * 0.005 * 9.81
    forces = body.forces()
    assert forces.weight == pytest.approx([0, 0, -weight], rel=1e-6)
    assert (forces.contact + forces.attachment)[2] == pytest.approx(weight, rel=0.02)
    assert body.vertex_forces().sum(axis=0)[2] == pytest.approx(weight, rel=0.02)
    carried = forces.contact[2]
    far = body.x[np.linalg.norm(body.x[:, :2] - body.x[body.attached][:, :2].mean(axis=0), axis=1).argmax()].copy()
    held = body.grasp(far)
    assert held == (body.held_by == 0).sum() >= 4 and body.is_holding()  # at least the face under the tip
    state = body.snapshot()

    def lift():
        for i in range(25):
            body.move(far + [0, 0, 0.02 * (i + 1) / 25])
            body.step()
        return body.hash

    after = lift()
    assert body.x[body.held_by == 0, 2].mean() > 0.015
    body.restore(state)
    assert lift() == after  # the same bits
    body.settle()
    forces = body.forces()
    assert forces.grasp[0][2] > 0.01
    assert forces.pull[0][2] == pytest.approx(forces.grasp[0][2] - (carried - forces.contact[2]), abs=1e-6)
    assert forces.grasp[0] + forces.contact + forces.attachment + forces.weight == pytest.approx(np.zeros(3), abs=0.02 * weight)
    assert body.measure("von_mises").max() > 0
    x = body.x
    body.close()
    with pytest.raises(om.Closed):
        body.step()
    assert np.isfinite(x).all()
    del x, body
    assert alive() == 0


def test_a_patient_becomes_a_body_on_its_organ(patient):
    body = om.Body(patient)
    body.settle()
    assert body.mesh.x == pytest.approx(patient.mesh.x, abs=1e-9)
    forces = body.forces()
    assert forces.weight == pytest.approx(-patient.up * patient.materials[0]["density"] * patient.mesh.volume * 9.81, rel=1e-3)
    assert forces.contact @ patient.up > 0.5 * np.linalg.norm(forces.weight)  # the organ carries it


def test_bodies_are_pickled_with_their_state(sheet, patient):
    """To the same bits, as what a process of a pool gets."""
    for body in (om.Body(sheet), om.Body(pickle.loads(pickle.dumps(patient)))):
        body.settle(strict=False)
        tip = body.x[body.mesh.sets["top"][0]].copy()
        body.grasp(tip, radius=0.01)
        body.move(tip + [0, 0, 0.001])
        body.step(strict=False)
        same = pickle.loads(pickle.dumps(body))
        assert np.array_equal(same.x, body.x) and same.hash == body.hash
        for each in (body, same):
            each.move(tip + [0, 0, 0.002])
            each.step(strict=False)
        assert same.hash == body.hash and same.forces().grasp[0].tolist() == body.forces().grasp[0].tolist()
    with pytest.raises(TypeError, match="snapshot"):
        pickle.dumps(om.Body(sheet.build(), scene=sheet))


# ---- cameras ----


def wall(z, half=0.05):
    """A square in the plane z = const, seen from below."""
    corner = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return om.Surface(corner, np.array([[0, 2, 1], [0, 3, 2]]))


def test_a_camera_sees_a_wall_at_its_depth():
    camera = om.Camera((0, 0, 0), (0, 0, 1), (0, -1, 0), width=64, height=48, fov=np.radians(40))
    scene = om.SenseScene()
    back, front = scene.add(wall(0.2, 0.2)), scene.add(wall(0.1, 0.01), "organ")
    depth, ids, normal = scene.depth(camera)
    assert depth.shape == (48, 64) and depth[0, 0] == pytest.approx(0.2, rel=1e-5) and depth[24, 32] == pytest.approx(0.1, rel=1e-5)
    assert ids[0, 0] == back and ids[24, 32] == front and normal[0, 0] == pytest.approx([0, 0, -1], abs=1e-6)
    side = 2 * 24 / np.tan(np.radians(20)) * 0.01 / 0.1  # px: the front wall's side by a pinhole
    assert (ids == front).sum() ** 0.5 == pytest.approx(side, abs=1)
    points, normals = camera.cloud(depth, normal, ids, only=front)
    assert points[:, 2] == pytest.approx(np.full(len(points), 0.1), rel=1e-5) and len(normals) == len(points)
    assert camera.project(points)[:, 0] == pytest.approx(np.nonzero(ids == front)[1] + 0.5, abs=1e-3)
    assert camera.ray(32, 24) == pytest.approx([0, 0, 1], abs=1e-12)
    picture = scene.render(camera)
    assert picture.shape == (48, 64, 3) and picture.dtype == np.uint8 and picture[24, 32].tolist() != picture[0, 0].tolist()
    scene.update(front, wall(0.15, 0.01).x)
    assert scene.depth(camera)[0][24, 32] == pytest.approx(0.15, rel=1e-5)
    scene.show(front, False)
    assert scene.depth(camera)[1][24, 32] == back


def test_visibility_counts_each_point_once():
    camera = om.Camera(width=64, height=48)
    scene = om.SenseScene()
    scene.add(wall(0.1, 0.02))
    points = np.array([[0, 0, 0.2], [0.1, 0, 0.2], [0, 0, 0.05], [9, 0, 0.2]])
    seen = scene.visibility(camera, points)
    assert (seen.npoint, seen.nseen, seen.nhidden, seen.noutside, seen.naway) == (4, 2, 1, 1, 0)
    assert scene.visibility(camera, points, ignore=(0,)).nseen == 3


def test_noise_has_the_stated_deviation():
    camera = om.Camera(width=200, height=200)
    noisy = camera.add_noise(np.full((200, 200), 0.5, np.float32), seed=4, a=1e-3, b=0, dropout=0)
    assert noisy.std() == pytest.approx(1e-3, rel=0.03) and noisy.mean() == pytest.approx(0.5, abs=3e-5)
    again = camera.add_noise(np.full((200, 200), 0.5, np.float32), seed=4, a=1e-3, b=0, dropout=0)
    assert np.array_equal(noisy, again)


def test_wrong_cameras_are_refused(box):
    with pytest.raises(om.Invalid, match="fov"):
        om.Camera(fov=4)
    scene = om.SenseScene()
    number = scene.add(box.boundary()[0])
    with pytest.raises(ValueError, match="shape"):
        scene.update(number, np.zeros((3, 3)))
    with pytest.raises(ValueError, match="no object 7"):
        scene.show(7, True)
    with pytest.raises(om.Invalid):
        scene.render(om.Camera(), samples=9)


# ---- the planner ----


def test_a_plan_pulls_the_block_above_the_region():
    planner, now = om.Planner(), om.Situation(5)
    now.mark("is_above_roi", [(3, 3)])
    plan = planner.solve(now)
    assert plan and plan.is_optimal and plan.grasp == (3, 3) and plan.cost[0] == 1
    assert [a.verb for a in plan.actions] == ["reach", "grasp"] + ["pull"] * (len(plan.actions) - 2)
    assert plan.actions[0].text == "PSM1 reaches grasping point (3,3)" and str(plan).startswith("1. PSM1 reaches")
    now.mark("is_fixed", [(3, 3)])
    other = planner.solve(now)
    assert other.grasp != (3, 3) and np.abs(np.subtract(other.grasp, (3, 3))).sum() == 1
    why = planner.explain(now, other, 1)
    assert re.search(r"\(3,3\)", why) and "attachment" in why


def test_no_plan_is_an_exception_or_an_outcome():
    planner, now = om.Planner(), om.Situation(3)
    now.mark("is_above_roi", [(2, 2)])
    now.is_fixed[:9] = True
    with pytest.raises(om.NoSolution, match="no plan"):
        planner.solve(now)
    plan = planner.solve(now, strict=False)
    assert not plan and plan.outcome == om.capi.OmStatus.UNSAT
    with pytest.raises(ValueError, match="no block"):
        now.mark("is_fixed", [(4, 1)])
