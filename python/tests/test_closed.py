"""After close() no method and no property reaches C: each raises, whatever its arguments. Under the address sanitizer too."""
import inspect

import numpy as np
import pytest

import omentum as om
from omentum._lib import Owner

FINE = {"close", "is_closed", "mesh", "load", "generate", "from_observation", "render_later"}


def make_all(box, folder):
    """An object of each class that owns memory of C, and those that it was made from."""
    scene = om.Scene()
    scene.tissue.cells, scene.tissue.world_cells = (4, 4, 1), (7, 7, 1)
    tissue, probe = om.Tissue(box), om.Probe("sphere", radius=0.01)
    site = om.Site(scene)
    body, world, planner = om.Body(site, scene=scene), om.SimulatedWorld(scene), om.Planner()
    world.reset(strict=False)
    recorder = om.Recorder(folder / "a.vtkhdf", box)
    task = om.RlTask("cart-pole")
    environments = [task, om.RlVec(task, 1)]
    sense = om.SenseScene()
    sense.add(box.boundary()[0])
    objects = [tissue, probe, om.Press(tissue, probe, ntri=500), om.Contact(tissue, self_contact=True), om.Loop(scene, world, body, planner), site, body, world, planner, recorder,
               sense, om.Scan(np.zeros((3, 3))), om.Matcher(scene, site), om.BanetNet.load(), om.Report("title"), om.View(body), *environments]

    class Mine(om.World):
        def refuse(self, *_):
            raise NotImplementedError

        move = set_jaw = stop = advance = observe = refuse

    data = om.BanetData.generate(folder / "data", 1, 916, {"way": "exact", "extent": (0.06, 0.08)}, shard=1, npicture=0)
    recorded = om.RecordedWorld(om.SimulatedWorld(scene), folder / "world.log")
    recorded.reset(strict=False)
    recorded.end()
    return [*objects, Mine(), data, recorded, om.ReplayedWorld(folder / "world.log")]


def calls(thing):
    """Every public method with plausible arguments, and every property, of an object."""
    plausible = {"tip": (0, 0, 0), "picture": np.zeros((2, 2, 3), np.uint8), "time": 1.0, "x": np.zeros((45, 3)), "points": np.zeros((1, 3)),
                 "camera": om.Camera(width=8, height=8), "number": 0, "kind": "pause", "situation": om.Situation(3), "vert": [0], "arm": 0,
                 "snapshot": b"", "plan": None, "goal": (0, 0, 0), "speed": 0.1, "angle": 0.5, "dt": 0.02, "acquisitions": [], "i": 0,
                 "surface": om.Surface(np.eye(3), [[0, 1, 2]]), "u": np.zeros((3, 3)), "seen": np.zeros(3), "key": "seed", "is_shown": True,
                 "env": 0, "seed": 1, "action": [[0]], "a": 0, "b": 1}
    if isinstance(thing, om.Tissue):
        plausible["x"] = np.zeros(thing.mesh.x.shape)
    if isinstance(thing, om.SenseScene):
        plausible["x"] = np.zeros((42, 3))  # of the boundary
    for name in sorted(n for n in dir(type(thing)) if not n.startswith("_") and n not in FINE):
        attribute = inspect.getattr_static(type(thing), name)
        if isinstance(attribute, property):
            yield name, lambda n=name: getattr(thing, n)
        elif inspect.isfunction(attribute):
            wanted = [p for p in list(inspect.signature(attribute).parameters.values())[1:]
                      if p.default is p.empty and p.kind == p.POSITIONAL_OR_KEYWORD]
            values = [plausible.get(p.name, "text") for p in wanted]
            yield name, lambda n=name, v=values: getattr(thing, n)(*v)


def test_use_after_close_raises(box, tmp_path):
    things = make_all(box, tmp_path)
    kinds = {type(t) for t in things}
    every = {k for k in vars(om).values() if isinstance(k, type) and issubclass(k, Owner) and k not in (om.World, om.Situation)}
    assert every - kinds <= {om.UmeshNet, om.UmeshData, om.RobotWorld}, every - kinds  # they load for seconds, or need a robot
    wrong, closed = [], 0
    for thing in reversed(things):
        thing.close()
        assert thing.is_closed
    for thing in things:
        for name, use in calls(thing):
            try:
                use()
                wrong.append(f"{type(thing).__name__}.{name} works")
            except om.Closed:
                closed += 1
            except (NotImplementedError, ValueError, TypeError, AttributeError) as error:
                if not isinstance(thing, om.World) or type(thing) is om.SimulatedWorld:
                    wrong.append(f"{type(thing).__name__}.{name}: {error!r}")
    assert not wrong and closed > 60, (closed, wrong)


@pytest.mark.parametrize("again", [0, 1])
def test_closing_twice_and_in_any_order(box, again):
    tissue, probe = om.Tissue(box), om.Probe("sphere", radius=0.01)
    press = om.Press(tissue, probe, ntri=500)
    tissue.close()
    probe.close()
    for use in (lambda: press.place((0, 0, 0)), lambda: press.step((0, 0, 0)), lambda: press.gap((0, 0, 0))):
        with pytest.raises(om.Closed):
            use()
    for _ in range(again + 1):
        press.close()
