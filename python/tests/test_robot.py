"""A robot of one's own: the example runs a retraction to its end; what is missing or wrong is named; exceptions end the run."""
# PARTS 2
import pathlib
import sys

import numpy as np
import pytest

import omentum as om

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "examples"))
import my_robot  # noqa: E402


def make_scene():
    scene = om.Scene()
    scene.seed, scene.tissue.cells, scene.task.time_step = 2, (6, 6, 1), 0.04
    return scene


def seen_by_rays(body):
    """Share of the region that is seen, with a scene of rays of its own."""
    camera = om.Camera._copy(om.lib.om_world_endoscope(body.scene, body.site._c))
    surface, vert = body.mesh.boundary()
    rays = om.SenseScene()
    rays.add(om.Surface(body.x[vert], surface.tri))
    counts = rays.visibility(camera, body.site.roi_x, body.site.roi_n)
    return counts.nseen / counts.npoint


def test_the_example_exposes_the_region():
    """The robot is that of the simulated world in C but for noise of sensors, speeds of jaws and turns."""
    result, robot = my_robot.main(make_scene())
    assert result.is_exposed and [a["verb"] for a in result.actions][:3] == [0, 1, 3]  # reach, grasp, pull
    visible = robot.patient.visibility()
    assert visible >= 0.8 and visible == pytest.approx(seen_by_rays(robot.patient), abs=0.08)  # here without midpoints of edges
    assert robot.patient.is_holding(result.actions[1]["arm"]) and robot.time == pytest.approx(result.summary["time"])
    code = pathlib.Path(my_robot.__file__).read_text().split("class MyRobot")[1].split("def main")[0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 40  # "30 lines"


class Coarse(my_robot.MyRobot):
    def __init__(self):
        scene = make_scene()
        scene.tissue.cells, scene.tissue.element = (5, 5, 1), "linear"
        super().__init__(scene)
        self.scene = scene

    def run(self):
        return om.Loop(self.scene, self).run()


def raising(error):
    def method(*_):
        raise error

    return method


@pytest.mark.parametrize("name", ["move", "set_jaw", "stop", "advance", "observe"])
@pytest.mark.parametrize("error", [RuntimeError("no power"), KeyboardInterrupt()])
def test_an_exception_in_any_method_ends_the_run(name, error):
    robot = Coarse()
    setattr(robot, name, raising(error))
    with pytest.raises(type(error)) as raised:
        loop = om.Loop(robot.scene, robot)
        if name == "stop":  # the loop stops its arms when it is cancelled
            loop.tick()
            loop.command("abort")
        loop.run()
    assert raised.value is error


def test_what_is_missing_is_named():
    class Half(om.World):
        def move(self, arm, goal, speed):
            pass

        def advance(self, dt):
            pass

    with pytest.raises(TypeError, match=r"Half has no set_jaw\(arm, angle\), no stop\(arm\), no observe\(what\): a world needs move\(arm, goal, speed\)"):
        Half()

    class Forgets(my_robot.MyRobot):
        def __init__(self):
            pass

    with pytest.raises(RuntimeError, match=r"Forgets.__init__ did not call super\(\).__init__\(\)"):
        om.Loop(make_scene(), Forgets(), twin=object())


@pytest.mark.parametrize(("gives", "text"), [
    (lambda robot: None, "returned NoneType: an omentum.Observation"),
    (lambda robot: om.Observation(0, robot.arms[:1], 0), "2 of omentum.Arm"),
    (lambda robot: om.Observation(0, [1, 2], 0), "2 of omentum.Arm"),
])
def test_a_wrong_observation_is_named(gives, text):
    robot = Coarse()
    robot.observe = lambda what: gives(robot)
    with pytest.raises((TypeError, ValueError), match=text):
        robot.run()
    seeing = Coarse()
    om.World.__init__(seeing, narm=2, sources=om.VISIBILITY | om.IMAGE)
    with pytest.raises(ValueError, match="without `picture`"):
        om.lib.om_world_observe(seeing._c, om.IMAGE, om.capi.OmObservation())
    for share in (85, -0.01, float("nan")):
        seeing.observe = lambda what, share=share: om.Observation(0, seeing.arms, share)
        om.lib.om_world_observe(seeing._c, 0, om.capi.OmObservation())  # without VISIBILITY it is not read
        with pytest.raises(ValueError, match="a share, not percent"):
            om.lib.om_world_observe(seeing._c, om.VISIBILITY, om.capi.OmObservation())


def test_what_an_arm_measures():
    turn = np.array([[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1.0]])
    arm = om.Arm(turn, jaw=0.1, jaw_goal=0.0, force=(1, 2, 3))
    assert arm.pose == pytest.approx(turn) and arm.tip.q == pytest.approx([0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    assert arm.is_holding and not om.Arm(turn, jaw=0.1).tip.p[0] == 0 and not om.Arm(jaw=0.5).is_holding
    assert arm.has_wrench and arm.force.tolist() == [1, 2, 3] and not om.Arm().has_wrench
    raw = om.capi.OmObservation()
    om.Observation(2.5, [arm, om.Arm(time=2.0)], 0.5)._write(raw)
    back = om.Observation._of(raw)
    assert [a.time for a in back.arms] == [2.5, 2.0] and back.arms[0].pose == pytest.approx(turn) and back.visibility == 0.5


def test_a_loop_takes_the_path_of_a_scene(tmp_path):
    robot = Coarse()
    (tmp_path / "small.yaml").write_text(robot.scene.yaml())
    loop = om.Loop(tmp_path / "small.yaml", robot)
    loop.tick()
    assert loop.ntick == 1
