"""What an engine of tissue promises, tested: for engines of the library and in Python alike."""
from __future__ import annotations

import inspect
from typing import Any

import numpy as np

from . import _capi as c
from ._lib import Error, Invalid, lib
from .engine import Engine
from .mesh import TetMesh
from .tissue import Tissue, find_engine

_TURN = 0.1  # rad


def check_engine(engine: str | Engine, mesh: TetMesh | None = None, **options: Any) -> dict[str, float]:
    """Hold an engine to what callers of Tissue rely on; AssertionError says what is broken. The same tests pass for every engine of
    the library ("fem", "pbd", "xpbd", "springs", "chainmail") and for a Law.

    Time advances; rest without load stays; attachments hold; what a tool grasps follows it, turned too; the same steps give the same
    bits, also from a snapshot and in a copy; reset is the beginning; wrong arguments are refused and change nothing; where the
    engine has forces they balance the weight; springs are obeyed or refused. Returned: weight and force of the tool at the end, N,
    the largest violation of balance (relative to the weight), and the largest speed at the end, m/s.

    mesh: with a set "attachment"; None: a block of 40 x 20 x 20 mm, held at x = 0. options: of Tissue, such as young or numbers.
    """
    return _Check(engine, mesh, options).run()


class _Check:
    def __init__(self, engine: str | Engine, mesh: TetMesh | None, options: dict[str, Any]) -> None:
        if mesh is None:
            mesh = TetMesh.box((0.04, 0.02, 0.02), (4, 2, 2))
            mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 0] < 1e-9)
        self.engine, self.given, self.options = engine, mesh, {"young": 2e4, **options}
        self.mesh = self.make().mesh  # with midpoints, where elements are quadratic
        self.name = engine.name if isinstance(engine, Engine) else engine
        can = lib.om_engine_capabilities(find_engine(engine))
        self.has_forces = bool(can & c.OmEngineCapability.FORCES)
        size = np.ptp(mesh.x, axis=0).max()
        self.size, held = size, mesh.x[mesh.sets["attachment"]].mean(axis=0)
        self.tip = mesh.x[np.linalg.norm(mesh.x - held, axis=1).argmax()].copy()
        self.radius = 0.3 * size

    def make(self, **options: Any) -> Tissue:
        return Tissue(self.given, self.engine, **{**self.options, **options})

    def want(self, holds: Any, what: str) -> None:
        assert holds, f"engine {self.name}: {what}"

    def lift(self, tissue: Tissue, steps: int, begin: int = 0) -> None:
        for i in range(begin, begin + steps):
            tissue.move(self.tip + [0, 0, 0.001 * self.size * (i + 1)])
            tissue.step(0.02, strict=False)

    def run(self) -> dict[str, float]:
        for name, function in inspect.getmembers(self, inspect.ismethod):
            if name.startswith("test_"):
                function()
        return self.balance()

    # ---- promises ----

    def test_rest(self) -> None:
        tissue = self.make(gravity=(0, 0, 0))
        for _ in range(5):
            tissue.step(0.02, strict=False)
        self.want(abs(tissue.time - 0.1) < 1e-12, f"after five steps of 0.02 s the time is {tissue.time:g} s")
        moved = np.abs(tissue.x - self.mesh.x).max()
        self.want(moved < 1e-4 * self.size, f"without any load the tissue moves by {moved:.3g} m")

    def test_attachments_hold(self) -> None:
        tissue, held = self.make(), self.mesh.sets["attachment"]
        tissue.grasp(self.tip, radius=self.radius)
        self.lift(tissue, 10)
        off = np.abs(tissue.x[held] - self.mesh.x[held]).max()
        self.want(off < 1e-9, f"an attached vertex is off by {off:.3g} m")
        self.want(np.isfinite(tissue.x).all() and np.isfinite(tissue.v).all(), "a position or a velocity is not finite")

    def test_what_is_grasped_follows(self) -> None:
        tissue = self.make()
        number = tissue.grasp(self.tip, radius=self.radius)
        held = tissue.held_by == 0
        self.want(number == held.sum() > 0, f"a grasp holds {held.sum()} vertices, the answer is {number}")
        arm = tissue.x[held] - self.tip
        pose = np.eye(4)
        pose[:2, :2] = [[np.cos(_TURN), -np.sin(_TURN)], [np.sin(_TURN), np.cos(_TURN)]]
        pose[:3, 3] = self.tip + [0, 0, 0.02 * self.size]
        for k in range(1, 5):
            part = np.eye(4)
            angle = _TURN * k / 4
            part[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            part[:3, 3] = self.tip + [0, 0, 0.02 * self.size * k / 4]
            tissue.move(part)
            tissue.step(0.02, strict=False)
        off = np.abs(tissue.x[held] - (arm @ pose[:3, :3].T + pose[:3, 3])).max()
        self.want(off < 1e-7, f"a grasped vertex is {off:.3g} m away from its place at the tool")
        tissue.release()
        self.want((tissue.held_by == -1).all(), "a vertex is held after the tool has opened")

    def test_the_same_bits(self) -> None:
        first, second = self.make(), self.make()
        for tissue in (first, second):
            tissue.grasp(self.tip, radius=self.radius)
            self.lift(tissue, 4)
        self.want(first.hash == second.hash, "the same steps give other results")
        state, copy = first.snapshot(), first.copy()
        for tissue in (first, copy):
            self.lift(tissue, 3, 4)
        self.want(first.hash == copy.hash, "a copy goes on in another way")
        second.restore(state)
        self.lift(second, 3, 4)
        self.want(first.hash == second.hash, "a snapshot is not the whole state: steps after restore give other results")
        mark = self.make()
        first.reset()
        for tissue in (first, mark):
            tissue.step(0.02, strict=False)
        self.want(first.hash == mark.hash, "reset is not the beginning")

    def test_wrong_arguments_change_nothing(self) -> None:
        tissue = self.make()
        tissue.step(0.02, strict=False)
        mark = tissue.hash
        wrong = {"a step of -0.02 s": lambda: tissue.step(-0.02), "a step of nan s": lambda: tissue.step(np.nan),
                 "a grasp of nothing": lambda: tissue.grasp(self.tip + 10), "a third arm": lambda: tissue.grasp(self.tip, arm=7),
                 "positions that are not finite": lambda: tissue.set_x(np.full_like(self.mesh.x, np.nan))}
        for what, use in wrong.items():
            try:
                use()
            except Invalid:
                self.want(tissue.hash == mark, f"{what}: refused, but the state has changed")
                continue
            self.want(False, f"{what} is not refused")

    def test_springs(self) -> None:
        tissue, held = self.make(), self.mesh.sets["attachment"]
        has_springs = find_engine(self.engine).contents.has_springs
        try:
            tissue.set_attachment(held, stiffness=20.0)
        except Error:
            self.want(not has_springs, "springs are refused though its table has has_springs")
            return
        self.want(has_springs, "springs are taken though its table lacks has_springs")
        sag = []
        for _ in range(200):
            tissue.step(0.02, strict=False)
            sag.append((self.mesh.x - tissue.x)[held, 2].sum())
        carried, weight = 20.0 * float(np.mean(sag[100:])), -tissue.forces().weight[2]  # a mean: it may still swing
        self.want(abs(carried - weight) < 0.05 * weight, f"springs carry {carried:.3g} N of {weight:.3g} N")

    def balance(self) -> dict[str, float]:
        tissue = self.make()
        tissue.grasp(self.tip, radius=self.radius)
        self.lift(tissue, 20)
        for _ in range(150):
            tissue.step(0.02, strict=False)
        speed = float(np.linalg.norm(tissue.v, axis=1).max())
        if not self.has_forces:
            return {"weight": float(tissue.mass.sum() * np.linalg.norm((0, 0, 9.81))), "grasp": np.nan, "balance": np.nan, "speed": speed}
        forces = tissue.forces()
        weight = float(np.linalg.norm(forces.weight))
        rest = forces.grasp.sum(axis=0) + forces.attachment + forces.contact + forces.external + forces.weight
        off = float(np.linalg.norm(rest)) / weight
        self.want(forces.grasp[0][2] > 0, f"a tool that lifts feels {forces.grasp[0][2]:.3g} N")
        self.want(off < 0.05, f"at rest {off:.2g} of the weight is not carried by tool and attachments")
        return {"weight": weight, "grasp": float(forces.grasp[0][2]), "balance": off, "speed": speed}
