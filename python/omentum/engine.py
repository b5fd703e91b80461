"""Engines of tissue in Python: for trying out an idea. Slow: each step calls Python, so some hundred vertices are a limit."""
from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from . import _capi as c
from ._convert import functions_of
from ._lib import Invalid, copied, lib, status_of, view
from .mesh import TetMesh

_TABLE = functions_of(c.OmTissueEngine)


class EngineStep:
    """What an engine gets for a step of `dt` s. Arrays of vertices are (nvert x 3).

    x (m), v (m/s): in: at the beginning; out: at the end, written in place. tool_force (N): out: force of the tool or the
    attachment on each held vertex. held: mask of vertices whose position is prescribed; goal: m, where they must be at the end.
    external: external forces, N. mass: kg (nvert). gravity: m/s^2 (3). data: what Engine.create returned.
    """

    def __init__(self, model: int, state: int, dt: float, nobstacle: int, obstacle: Any, data: Any) -> None:
        mesh = lib.om_tissue_mesh(model).contents
        n = mesh.nvert
        self.dt, self.data, self.nvert = dt, data, n
        self.x = view(None, lib.om_engine_x(state), np.float64, (n, 3), True)
        self.v = view(None, lib.om_engine_v(state), np.float64, (n, 3), True)
        self.tool_force = view(None, lib.om_engine_tool_force(state), np.float64, (n, 3), True)
        self.contact_force = view(None, lib.om_tissue_contact_force(state), np.float64, (n, 3), True)
        self.external = view(None, lib.om_tissue_external_force(state), np.float64, (n, 3))
        self.mass = view(None, lib.om_tissue_mass(model), np.float64, (n,))
        self.gravity = np.frombuffer(lib.om_tissue_gravity(model), np.float64).copy()
        self.held, self.goal = np.zeros(n, bool), np.zeros((n, 3))
        goal = c.OmVec3()
        for i in range(n):
            if lib.om_engine_find_goal(state, i, ctypes.byref(goal)):
                self.held[i], self.goal[i] = True, (goal.x, goal.y, goal.z)
        self._obstacles = [obstacle[i] for i in range(nobstacle)]

    def push_out(self, x: np.ndarray, v: np.ndarray, sub: float) -> None:
        """Move free vertices out of boards, organs and probes at the end of a substep of `sub` s: x and v change, and
        contact_force holds the forces."""
        normal = c.OmVec3()
        self.contact_force[...] = 0
        for o in self._obstacles:
            turn = np.frombuffer(lib.om_quat_to_mat3(c.OmQuat(*o.pose_end.q.tolist())), np.float64).reshape(3, 3).T
            local = (x - o.pose_end.p) @ turn
            for i in np.flatnonzero(~self.held):
                gap = o.distance(o.ctx, c.OmVec3(*local[i].tolist()), ctypes.byref(normal)) - o.offset
                if gap >= 0 or not np.isfinite(gap):
                    continue
                n = turn @ (normal.x, normal.y, normal.z)
                speed = min(0.0, v[i] @ n)
                o.penetration = max(o.penetration, -gap)
                o.ncontact += 1
                x[i] -= gap * n
                v[i] -= speed * n
                self.contact_force[i] -= speed * self.mass[i] / sub * n


class Engine:
    """An engine that moves vertices itself. Derive from it, and pass an instance to Tissue, or to register_engine:

        class Fall(om.Engine):
            name = "fall"
            def step(self, now):
                now.v[...] += now.dt * now.gravity
                now.x[...] += now.dt * now.v
                now.x[now.held] = now.goal[now.held]

    A step that raises leaves the tissue as it was.
    """

    name = ""  # in scenes and messages
    numbers: tuple[str, ...] = ("young",)  # numbers of a scene that have an effect: "young", "poisson", ...
    has_forces = False  # `step` writes tool_force and contact_force in newtons

    def create(self, mesh: TetMesh, mass: np.ndarray, volume: np.ndarray, young: np.ndarray) -> Any:
        """Prepare a model; what it returns is `data` of each step. mass: kg (nvert). volume: m^3, young: Pa (ntet)."""

    def step(self, now: EngineStep) -> int | None:
        """Compute a step; the number of substeps may be returned."""
        raise NotImplementedError

    def __getstate__(self) -> dict[str, Any]:
        """An engine is pickled without what C holds of it."""
        return {k: v for k, v in self.__dict__.items() if k not in ("_table", "_data")}

    def table(self) -> Any:
        """The table of the engine for C, made once; it lives as long as the engine."""
        if not hasattr(self, "_table"):
            if not self.name:
                raise ValueError(f"{type(self).__name__} has no name")
            self._data: dict[int, Any] = {}
            names = (ctypes.c_char_p * (len(self.numbers) + 1))(*(n.encode() for n in self.numbers), None)
            table = c.OmTissueEngine(version=c.OM_ENGINE_VERSION, name=self.name.encode(), has_forces=self.has_forces)
            table.number = names
            table.create = _TABLE["create"](self._on_create)
            table.destroy = _TABLE["destroy"](self._on_destroy)
            table.step = _TABLE["step"](self._on_step)
            table._keep = names
            self._table = table
        return ctypes.pointer(self._table)

    def _on_create(self, model: int) -> int:
        try:
            mesh = TetMesh._copy(lib.om_tissue_mesh(model).contents)
            ntet = len(mesh.tet)
            young = np.array([lib.om_engine_material(model, e).contents.young for e in range(ntet)])
            self._data[model] = self.create(mesh, copied(lib.om_tissue_mass(model), np.float64, (len(mesh.x),)),
                                            copied(lib.om_engine_volume(model), np.float64, (ntet,)), young)
            return 0
        except BaseException as error:
            return status_of(error, self.name)

    def _on_destroy(self, model: int) -> None:
        self._data.pop(model, None)

    def _on_step(self, model: int, state: int, _work: int, dt: float, nobstacle: int, obstacle: Any, report: Any) -> int:
        now = EngineStep(model, state, dt, nobstacle, obstacle, self._data.get(model))
        x, v = now.x.copy(), now.v.copy()
        try:
            substeps = self.step(now)
            if not (np.isfinite(now.x).all() and np.isfinite(now.v).all()):
                raise Invalid(f"engine {self.name}: a position or a velocity is not finite after the step")
            report.contents.substeps = substeps or 1
            lib.om_engine_end_step(state, dt)
            return 0
        except BaseException as error:
            now.x[...], now.v[...] = x, v
            return status_of(error, self.name)
