"""Worlds and the loop: a world in Python behaves as the one it wraps, listeners see the run, errors come through."""
# PARTS 3
import os

import numpy as np
import pytest

import omentum as om

IS_SLOW = bool(os.environ.get("OM_TEST_SLOW"))


def make_scene():
    """The first grasp lifts. Coarse, of linear elements, with small pictures, in the quick tests."""
    scene = om.Scene.load(om.data_path("scenes/sheet.yaml"))
    ncell, scene.seed = (12, 201) if IS_SLOW else (6, 207)
    scene.task.ahead = 0  # om.retract looks ahead as the scene says, a loop that is made by hand does not
    scene.tissue.cells = (ncell, ncell, 1)
    scene.tissue.world_cells = (3 * ncell // 2, 3 * ncell // 2, 1)
    if not IS_SLOW:
        scene.tissue.element = scene.world.element = "linear"
        for camera in (scene.endoscope, scene.rgbd):
            camera.width, camera.height = 64, 48
    return scene


def abort_after(tick):
    """A supervisor that ends a run at a tick; None: the run goes to its end."""
    return None if tick is None else lambda loop: loop.command("abort") if loop.ntick == tick else None


class Wrapped(om.World):
    """A world in Python that passes every call to a simulated one."""

    def __init__(self, inner):
        super().__init__(narm=2, sources=om.VISIBILITY | om.DEPTH | om.COLOR | om.IMAGE)
        self.inner, self.calls = inner, []

    def move(self, arm, goal, speed):
        self.calls.append("move")
        self.inner.move(arm, goal, speed)

    def set_jaw(self, arm, angle):
        self.inner.set_jaw(arm, angle)

    def stop(self, arm):
        self.inner.stop(arm)

    def advance(self, dt):
        self.inner.advance(dt)

    def observe(self, what=0):
        return self.inner.observe(what)


class Log(om.Listener):
    def __init__(self):
        self.ticks, self.plans, self.ended, self.outcomes = 0, [], [], None

    def on_tick(self, loop, sample):
        self.ticks += 1

    def on_plan(self, loop, situation, plan):
        self.plans.append((situation.n, str(plan)))

    def on_action_end(self, loop, action):
        self.ended.append(action["verb"])

    def on_end(self, loop, result):
        self.outcomes = result.outcome


class Stop(om.Listener):
    def __init__(self, at):
        self.at = at

    def on_tick(self, loop, sample):
        if loop.ntick == self.at:
            loop.command("abort")


def run(scene, wrap, listeners=(), **settings):
    inner, twin = om.SimulatedWorld(scene), om.Body(scene)
    inner.reset()
    twin.settle(strict=False)
    world = wrap(inner)
    loop = om.Loop(scene, world, twin, om.Planner(), truth=inner.truth, listeners=list(listeners), **settings)
    return loop, loop.run(), world


def test_a_loop_over_a_world_in_python_is_the_run_of_c(alive):
    """In full size to the end, else until the tissue has been lifted for a while."""
    last = None if IS_SLOW else 330
    scene, log = make_scene(), Log()
    plain = om.retract(scene, supervise=abort_after(last))
    loop, result, world = run(scene, Wrapped, [log] + ([] if IS_SLOW else [Stop(at=last)]))
    assert result.outcome == ("exposed" if IS_SLOW else "aborted") and result.actions and np.nanmax(result.samples["force"]) > 0
    assert result.outcome == plain.outcome and result.summary["hash"] == plain.summary["hash"]
    assert result.samples["force"] == pytest.approx(plain.samples["force"], nan_ok=True)
    assert log.ticks == loop.ntick and log.outcomes == result.outcome and log.plans[0][0] == 5
    assert log.ended == [om.capi.OmPlanVerb(a["verb"]).name.lower() for a in result.actions]
    assert "move" in world.calls and loop.phase == "ended"
    with pytest.raises(om.Invalid, match="ended"):
        loop.tick()
    del loop, result, world, log, plain
    assert alive() == 0


def test_an_exception_in_a_world_or_a_listener_reaches_the_caller():
    class Broken(Wrapped):
        def advance(self, dt):
            raise RuntimeError("the arm lost power")

    with pytest.raises(RuntimeError, match="lost power"):
        run(make_scene(), Broken)

    class Curious(om.Listener):
        def on_tick(self, loop, sample):
            raise KeyError("tick")

    with pytest.raises(KeyError):
        run(make_scene(), lambda world: world, [Curious()])

    class Closing(om.Listener):
        def on_tick(self, loop, sample):
            loop.close()

    with pytest.raises(RuntimeError, match="does not close"):
        run(make_scene(), lambda world: world, [Closing()])


def test_the_plan_before_is_followed_first(tmp_path):
    """In full size, else nine points of a coarse twin."""
    scene = make_scene()
    scene.task.grid = 5 if IS_SLOW else 3
    before = om.preplan(scene)
    assert before.chosen and before.points[before.chosen]["verdict"] == "chosen" and len(before.points) == (25 if IS_SLOW else 9)
    assert before.plan.actions[0].verb == "reach" and before.plan.actions[0].block == before.chosen
    before.save(tmp_path / "plan.json")
    same = om.Preplan.load(tmp_path / "plan.json")
    assert same.points.keys() == before.points.keys() and same.chosen == before.chosen and str(same) == str(before)
    result = om.retract(scene, preplan=before, supervise=lambda loop: loop.result.actions and not IS_SLOW and loop.command("abort"))
    assert result.actions[0]["block"] == before.raw.chosen


def test_a_listener_commands_the_loop():
    _, result, _ = run(make_scene(), lambda world: world, [Stop(at=20)])
    assert result.outcome == "aborted" and not result.is_exposed


def test_a_supervisor_commands_a_run():
    seen = []

    def watch(loop):
        seen.append(loop.ntick)
        result = loop.result
        assert result.outcome == ("aborted" if loop.phase == "ended" else "running") and not result.is_exposed
        assert (result.summary["outcome"] is None) == (loop.phase != "ended")
        if len(seen) == 3:
            loop.command("slow", value=0.5)
        if len(seen) == 6:
            with pytest.raises(RuntimeError, match="does not tick"):
                loop.tick()
            loop.command("abort")

    result = om.retract(make_scene(), supervise=watch)
    assert result.outcome == "aborted" and seen[:3] == [1, 2, 3] and 6 <= len(seen) <= 7

    def fail(loop):
        raise KeyError("who")

    with pytest.raises(KeyError, match="who"):
        om.retract(make_scene(), supervise=fail)


def test_a_listener_hears_commands():
    class Hear(om.Listener):
        kinds = []

        def on_tick(self, loop, sample):
            if loop.ntick == 5:
                loop.command("forbid", block=7)
            if loop.ntick == 8:
                loop.command("abort")

        def on_command(self, loop, command):
            self.kinds.append((command.kind.name, command.block))

    hear = Hear()
    run(make_scene(), lambda world: world, [hear])
    assert ("FORBID", 7) in hear.kinds and hear.kinds[-1][0] == "ABORT"


def test_observations_cross_the_border_both_ways(alive):
    inner = om.SimulatedWorld(make_scene())
    inner.reset()
    world = Wrapped(inner)
    direct = inner.observe(om.VISIBILITY | om.DEPTH | om.COLOR | om.IMAGE)
    raw = om.capi.OmObservation()
    om.lib.om_world_observe(world._c, om.DEPTH | om.COLOR | om.IMAGE, raw)  # through C to Python and back
    back = om.Observation._of(raw)
    assert np.array_equal(back.picture, direct.picture) and back.picture.shape[2] == 3
    assert np.median(np.abs(back.depth - direct.depth)) < 1e-3 and back.depth.max() > 0.1
    assert back.depth_camera.matrix == pytest.approx(direct.depth_camera.matrix)
    assert back.color.shape == (*back.depth.shape, 3)
    assert back.arms[0].tip.p == pytest.approx(direct.arms[0].tip.p, abs=2e-3)
    depth = direct.depth
    del direct, back, raw, world, inner
    assert depth.max() > 0.1 and alive() > 0  # the view keeps its memory
    del depth
    assert alive() == 0


def test_a_run_writes_its_record(tmp_path):
    scene = make_scene()
    result = om.retract(scene, tmp_path / "run", frame_every=0, supervise=abort_after(None if IS_SLOW else 60))
    assert {"report.html", "run.json", "run.vtkhdf"} <= {p.name for p in (tmp_path / "run").iterdir()}
    h5py = pytest.importorskip("h5py")
    assert h5py.is_hdf5(tmp_path / "run" / "run.vtkhdf")
    recording = om.Recording(tmp_path / "run" / "run.vtkhdf")
    assert recording.times[-1] <= result.samples["time"][-1] + 1e-6 and len(recording) > 3
    assert recording.x(0).shape == (recording.nvert, 3) and np.isfinite(recording.x(-1)).all()
    recording.close()
    assert result.reason and len(result.samples["time"]) > 3 and result.summary["naction"] == len(result.actions)
    with pytest.raises(om.Cancelled):
        om.retract(scene, progress=lambda *_: False)


def test_a_run_of_quadratic_tissue_records_all_nodes(tmp_path):
    h5py = pytest.importorskip("h5py")
    scene = make_scene()
    scene.tissue.element = scene.world.element = "quadratic"
    om.retract(scene, tmp_path / "run", frame_every=0, supervise=abort_after(30))
    recording = om.Recording(tmp_path / "run" / "run.vtkhdf")
    nx, ny, nz = (int(n) for n in scene.tissue.world_cells)
    tets = [cell for cell in recording.cells if len(cell) == 10]
    nodes = np.unique(np.concatenate(tets))
    assert len(tets) == 6 * nx * ny * nz
    assert len(nodes) == (2 * nx + 1) * (2 * ny + 1) * (2 * nz + 1)  # a grid of half the cells
    with h5py.File(tmp_path / "run" / "run.vtkhdf") as file:
        types = file["VTKHDF/Types"][()]
    assert (types == 24).sum() == len(tets) and set(types) == {5, 24}  # VTK_QUADRATIC_TETRA, VTK_TRIANGLE
    x, moved = recording.x(0), recording.array("displacement_m", -1)
    middle = np.array([x[cell[4]] - (x[cell[0]] + x[cell[1]]) / 2 for cell in tets])
    assert np.abs(middle).max() < 0.002 and np.isfinite(moved).all()  # hardly bent at first
    assert recording.array("roi", 0)[nodes].sum() > 10 and recording.array("attachment", 0)[len(nodes):].sum() == 0
    recording.close()


def test_a_recorded_world_is_replayed(tmp_path):
    inner = om.SimulatedWorld(make_scene())
    recorded = om.RecordedWorld(inner, tmp_path / "world.log")
    recorded.reset()
    tips = []
    for _ in range(3):
        recorded.advance(0.02)
        tips.append(recorded.observe(om.VISIBILITY))
    recorded.end()
    replayed = om.ReplayedWorld(tmp_path / "world.log")
    replayed.reset()
    for tip in tips:
        replayed.advance(0.02)
        again = replayed.observe(om.VISIBILITY)
        assert again.visibility == tip.visibility and again.arms[1].tip.p.tolist() == tip.arms[1].tip.p.tolist()
    with pytest.raises(om.Error, match="log"):
        replayed.advance(0.05)
    for use in (lambda: replayed.truth, replayed.snapshot, lambda: replayed.render(64, 48)):
        with pytest.raises(om.Unavailable):
            use()
    with pytest.raises(om.Invalid, match="no arm 2"):
        replayed.stop(2)


def test_snapshots_of_a_world_repeat_its_noise():
    world = om.SimulatedWorld(make_scene())
    world.reset()
    state = world.snapshot()
    world.advance(0.02)
    first = world.observe().arms[0].tip.p.copy()
    world.restore(state)
    world.advance(0.02)
    assert world.observe().arms[0].tip.p.tolist() == first.tolist()
    assert world.render(160, 120).shape == (120, 160, 3)
    with pytest.raises(om.Invalid, match="reach|speed|pose"):
        world.move(0, (5, 5, 5), 0.02)


def interrupt():
    """SIGINT to this process."""
    import os
    import signal
    os.kill(os.getpid(), signal.SIGINT)


def test_ctrl_c_stops_a_run(alive):
    calls = []

    def report(stage, done, total):
        calls.append(stage)
        if len(calls) == 5:
            interrupt()

    with pytest.raises(KeyboardInterrupt):
        om.retract(make_scene(), progress=report)
    assert alive() == 0


def test_ctrl_c_stops_a_loop(alive):
    class Impatient(om.Listener):
        def on_tick(self, loop, sample):
            if loop.ntick == 5:
                interrupt()

    inner, twin = om.SimulatedWorld(make_scene()), om.Body(make_scene())
    inner.reset()
    loop = om.Loop(make_scene(), inner, twin, om.Planner(), listeners=[Impatient()])
    with pytest.raises(KeyboardInterrupt):
        loop.run()
    assert loop.ntick == 5
    while loop.phase != "ended":  # the loop is whole: it stops the arms and ends
        loop.tick()
    assert loop.result.outcome == "cancelled"
    del loop, inner, twin
    assert alive() == 0


def test_ctrl_c_ends_a_search():
    calls = []

    def model(p):
        calls.append(1)
        if len(calls) == 30:
            interrupt()
        return np.abs(p - 0.3)

    with pytest.raises(KeyboardInterrupt):
        om.calibrate(model, [om.Parameter("a", -1, 1, 0.9)], 1, max_generations=1000, population=20)
    assert len(calls) < 200
