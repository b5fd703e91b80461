"""An engine in Python: free fall, a weight on springs, tools, contact, and errors, as the engines of the library."""
import numpy as np
import pytest

import omentum as om

EDGES = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])


class Lattice(om.Engine):
    """Every edge of every element is a spring, k = E V / l^2; symplectic Euler with damping. As samples/15_write_an_engine.c."""

    name = "python-lattice"
    has_forces = True

    def create(self, mesh, mass, volume, young):
        each = np.sort(mesh.tet[:, EDGES].reshape(-1, 2), axis=1)
        pair, number = np.unique(each, axis=0, return_inverse=True)  # springs of the same edge are one
        length = np.linalg.norm(mesh.x[pair[:, 1]] - mesh.x[pair[:, 0]], axis=1)
        k = np.bincount(number.ravel(), np.repeat(young * volume, 6)) / length**2
        ends = np.zeros((len(mesh.x), len(pair)))
        ends[pair[:, 0], np.arange(len(pair))], ends[pair[:, 1], np.arange(len(pair))] = 1, -1
        return pair, ends, length, k, np.sqrt(0.5 * mass / (np.abs(ends) @ k)).min()

    def step(self, now):
        pair, ends, length, k, limit = now.data
        nsub = int(np.ceil(now.dt / limit))
        sub = now.dt / nsub
        for s in range(nsub):
            force = now.external + now.mass[:, None] * (now.gravity - 4.0 * now.v)
            d = now.x[pair[:, 1]] - now.x[pair[:, 0]]
            force += ends @ ((k * (1 - length / np.sqrt((d * d).sum(1))))[:, None] * d)
            now.v[...] += sub / now.mass[:, None] * force
            now.v[now.held] = (now.goal - now.x)[now.held] / (sub * (nsub - s))
            now.x[...] += sub * now.v
            now.push_out(now.x, now.v, sub)
            now.tool_force[...] = np.where(now.held[:, None], -force, 0)
        return nsub


class Broken(Lattice):
    name = "python-broken"

    def step(self, now):
        now.x[0] = np.nan


def test_free_fall():
    tissue = om.Tissue(om.TetMesh.box((0.02, 0.01, 0.01), (2, 1, 1)), Lattice(), young=3000)
    for _ in range(100):
        tissue.step(0.001)
    assert tissue.time == pytest.approx(0.1)
    # symplectic Euler is off by half a step
    fall = 9.81 / 16 * (4 * 0.1 - 1 + np.exp(-4 * 0.1))  # with damping of 4 / s
    assert tissue.mesh.x - tissue.x == pytest.approx(np.tile([0, 0, fall], (len(tissue.x), 1)), abs=0.6 * 9.81 * 0.1 * 0.001)


def test_attachments_carry_the_weight_and_a_tool_lifts(box, alive):
    tissue = om.Tissue(box, Lattice(), young=2e4)
    report = tissue.step()
    assert report.substeps > 1 and "python-lattice" in repr(tissue)
    for _ in range(150):
        tissue.step()
    weight = 1000 * 1.6e-5 * 9.81
    assert tissue.forces().attachment[2] == pytest.approx(weight, rel=0.02)
    tip = tissue.x[-1].copy()
    held = tissue.grasp(tip, radius=0.006)
    tissue.move(tip + [0, 0, 0.005])
    before = tissue.x[tissue.held_by == 0].copy()
    tissue.step()
    assert tissue.x[tissue.held_by == 0] - before == pytest.approx(np.tile([0, 0, 0.005], (held, 1)), abs=1e-9)
    twin = tissue.copy()
    tissue.step()
    twin.step()
    assert tissue.hash == twin.hash
    del tissue, twin, report
    assert alive() == 0


def test_a_scene_names_it_and_its_board_carries_it(is_slow):
    om.register_engine(Lattice())
    size = "cells: [5, 5, 1], young: 10000" if is_slow else "cells: [4, 4, 1], young: 2000"
    scene = om.Scene.parse(f"name: net\ntissue: {{source: sheet, engine: python-lattice, {size}}}\n")
    body = om.Body(scene)
    assert body.engine == "python-lattice"
    carried = []
    for _ in range(80 if is_slow else 40):
        body.step(0.02, strict=False)
        forces = body.forces()
        carried.append((forces.contact + forces.attachment)[2])
    assert body.x[:, 2].min() > -1e-4
    assert np.mean(carried[len(carried) // 2:]) == pytest.approx(-forces.weight[2], rel=0.03)
    with pytest.raises(om.Invalid, match="python-lattice"):
        om.register_engine(Lattice())  # the name is taken


def test_a_failed_step_leaves_the_tissue_as_it_was(box):
    tissue = om.Tissue(box, Broken())
    mark = tissue.hash
    with pytest.raises(om.Invalid, match="not finite"):
        tissue.step()
    assert tissue.hash == mark

    class Raising(Lattice):
        name = "python-raising"

        def step(self, now):
            now.x += 1
            raise ZeroDivisionError("no mass")

    tissue = om.Tissue(box, Raising())
    with pytest.raises(ZeroDivisionError, match="no mass"):
        tissue.step()
    assert tissue.hash == mark

    class Unready(Lattice):
        name = "python-unready"

        def create(self, mesh, mass, volume, young):
            raise KeyError("mesh")

    with pytest.raises(KeyError):
        om.Tissue(box, Unready())
    with pytest.raises(ValueError, match="no name"):
        om.Tissue(box, om.Engine())
