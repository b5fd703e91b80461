"""check_engine: every engine of the library passes, and so do engines and laws in Python; broken ones are named."""
# PARTS 2
import inspect

import numpy as np
import pytest
from test_engine import Lattice
from test_law import Stable, Venant

import omentum as om

ENGINES = [("fem", {}), ("fem", {"law": "neo-hookean"}), ("pbd", {"numbers": {"cluster_spacing": 0.01, "cluster_radius": 0.02}}), ("xpbd", {}),
           ("springs", {}), ("chainmail", {})]


def block(*cells):
    mesh = om.TetMesh.box((0.04, 0.02, 0.02), cells)
    mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 0] < 1e-9)
    return mesh


def check(engine, mesh=None, **options):
    found = om.check_engine(engine, mesh, **options)
    assert found["weight"] == pytest.approx(1.6e-5 * 1000 * 9.81, rel=1e-9)
    if np.isfinite(found["grasp"]):
        assert 0.04 < found["grasp"] < 0.2 and found["balance"] < 1e-3


@pytest.mark.parametrize("engine, options", ENGINES, ids=lambda v: getattr(v, "name", v) if not isinstance(v, dict) else ",".join(v))
def test_every_engine_keeps_its_promises(engine, options):
    check(engine, **options)


@pytest.mark.parametrize("engine", [Lattice(), Venant()], ids=lambda engine: engine.name)
def test_engines_in_python_keep_them(engine):
    check(engine, block(2, 1, 1))


@pytest.mark.slow
@pytest.mark.parametrize("engine", [Lattice(), Stable()], ids=lambda engine: engine.name)
def test_engines_in_python_keep_them_on_the_mesh_of_the_others(engine):
    check(engine)


def test_on_a_mesh_of_ones_own():
    mesh = om.TetMesh.box((0.06, 0.03, 0.01), (6, 3, 1))
    mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 1] < 1e-9)
    assert om.check_engine("fem", mesh, young=1e4)["balance"] < 1e-3


def test_broken_promises_are_named(is_slow):
    class Slack(Lattice):  # attachments give way
        name = "slack"

        def step(self, now):
            number = super().step(now)
            now.x[now.held] += 1e-5
            return number

    class Memory(Lattice):  # a state that snapshots do not see
        name = "memory"
        count = 0

        def step(self, now):
            self.count += 1
            number = super().step(now)
            now.v[~now.held] *= 1 - 1e-9 * self.count
            return number

    class Drift(Lattice):
        name = "drift"

        def step(self, now):
            number = super().step(now)
            now.x[~now.held] += 1e-5
            return number

    class Weak(Lattice):  # half of the force of each tool and attachment is lost
        name = "weak"

        def step(self, now):
            number = super().step(now)
            now.tool_force[...] *= 0.5
            return number

    for engine, words in ((Slack(), "attached vertex|grasped vertex|without any load"), (Memory(), "same steps|goes on|whole state|not the beginning"),
                          (Drift(), "without any load"), (Weak(), "not carried")):
        with pytest.raises(AssertionError, match=f"engine {engine.name}: .*({words})"):
            om.check_engine(engine, None if is_slow else block(2, 1, 1))


# ---- the package itself ----


def test_everything_public_is_described():
    missing = []
    for name in om.__all__:
        thing = getattr(om, name)
        if not (inspect.isclass(thing) or inspect.isfunction(thing)) or not (getattr(thing, "__module__", "") or "").startswith("omentum"):
            continue
        if not thing.__doc__:
            missing.append(name)
        for member, value in vars(thing).items() if inspect.isclass(thing) else ():
            inner = value.__func__ if isinstance(value, (classmethod, staticmethod)) else value.fget if isinstance(value, property) else value
            inherited = any(getattr(getattr(base, member, None), "__doc__", None) for base in thing.__mro__[1:-1])
            if inspect.isfunction(inner) and not member.startswith("_") and not inner.__doc__ and not inherited:
                missing.append(f"{name}.{member}")
    assert not missing


def test_a_bar_of_progress(ellipsoid, capsys):
    tqdm = pytest.importorskip("tqdm")
    om.build_patient(ellipsoid, edge=0.01, label=1, progress=True)
    shown = capsys.readouterr().err
    assert "%|" in shown and tqdm.__version__


def test_lines_of_progress_without_tqdm(ellipsoid, capsys, monkeypatch):
    import sys
    monkeypatch.setitem(sys.modules, "tqdm", None)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    om.build_patient(ellipsoid, edge=0.01, label=1, progress=True)
    shown = capsys.readouterr().err.splitlines()
    assert len(shown) > 1 and all(line.endswith("%") for line in shown)
