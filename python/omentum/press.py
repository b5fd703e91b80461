"""Rigid probes that press on tissue, with readable contact forces."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _capi as c
from ._convert import find_enum
from ._lib import Handle, Owner, copied, create, forget_message, lib, message_of, outcome, pose, pose_matrix
from .mesh import Surface
from .tissue import Tissue


class Probe(Owner):
    """A rigid shape: "box" (pressing face at the origin, body at z >= 0), "sphere", "capsule", or a closed Surface."""

    def __init__(self, shape: str | Surface = "box", **fields: Any) -> None:
        """fields of OmProbeDef, m: size, rounding (box), radius (sphere, capsule), length (capsule)."""
        is_mesh = isinstance(shape, Surface)
        definition = lib.om_probe_default_def(find_enum(c.OmProbeShape, "mesh" if is_mesh else shape))
        definition.assign(fields)
        if isinstance(shape, Surface):
            raw = shape._as_c()
            definition.surface = ctypes.pointer(raw)
        self._handle = Handle(create(lib.om_probe_create, ctypes.byref(definition)), lib.om_probe_destroy)

    def surface(self) -> Surface:
        """Triangles to draw, in the probe's frame."""
        raw = c.OmSurface()
        lib.om_probe_get_surface(self._c, ctypes.byref(raw))
        return Surface._take(raw)


@dataclass
class PressReport:
    """A step of a press. force: N, by the tissue on the probe (3); torque: N m about its origin; area: m^2; penetration: m.

    Of each contact: vert (of the contact surface), point (m), normal (from the probe to the tissue), push (N, on the tissue),
    gap (m, negative inside). tissue: OmTissueReport.
    """

    status: c.OmStatus
    message: str
    is_settled: bool
    force: np.ndarray
    torque: np.ndarray
    area: float
    penetration: float
    ncontact: int
    vert: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    push: np.ndarray
    gap: np.ndarray
    tissue: c.OmTissueReport = field(repr=False)


class Press(Owner):
    """A probe that presses on a tissue: step() moves it, and the tissue with it.

        press = Press(tissue, Probe("sphere", radius=0.01))
        press.place(above)
        report = press.step(below, 0.02)
        report.force                                        # N
    """

    def __init__(self, tissue: Tissue, probe: Probe, method: str = "penalty", **fields: Any) -> None:
        """method: "penalty", "multipliers" or "prescribed". fields of OmPressDef: ntri, stiffness, friction, tolerance, reuse, and
        surface: a Surface in the rest shape whose vertices are the contact points; default: made from the mesh."""
        definition = lib.om_press_default_def(probe._c)
        definition.method = method
        surface = fields.pop("surface", None)
        if surface is not None:
            definition.surface = ctypes.pointer(surface._as_c())
        definition.assign(fields, also=("surface",))
        self._tissue = tissue
        address = create(lib.om_press_create, ctypes.byref(definition), tissue._model_c)
        self._handle = Handle(address, lib.om_press_destroy, probe._handle, tissue._model)

    def place(self, tip: Any) -> None:
        """Set the pose of the probe without a path; of "prescribed" this selects the area that follows it."""
        lib.om_press_place(self._c, self._tissue._model_c, self._tissue._c, pose(tip))

    def step(self, tip: Any, dt: float = 0.02, strict: bool = True) -> PressReport:
        """A step of the tissue of `dt` s while the probe moves to a pose; `strict` as of Tissue.step."""
        raw, tissue = c.OmPressReport(), self._tissue
        tissue._look_at_supports()
        with tissue._busy:
            forget_message()
            status = lib.om_press_step(self._c, tissue._model_c, tissue._c, tissue._work.address, pose(tip), dt, ctypes.byref(raw))
        n = raw.ncontact
        report = PressReport(
            c.OmStatus(status), message_of(status), raw.is_settled, raw.force.copy(),
            raw.torque.copy(), raw.area, raw.penetration, n, copied(raw.vert, np.int32, (n,)),
            copied(raw.point, np.float64, (n, 3)), copied(raw.normal, np.float64, (n, 3)), copied(raw.push, np.float64, (n, 3)),
            copied(raw.gap, np.float64, (n,)),
            c.OmTissueReport.from_buffer_copy(raw.tissue))
        return outcome(status, report, strict)

    def gap(self, tip: Any) -> float:
        """Distance of the probe at a pose to the tissue, m, negative inside."""
        return lib.om_press_eval_gap(self._c, self._tissue._c, pose(tip))

    @property
    def pose(self) -> np.ndarray:
        """Pose of the probe (4 x 4)."""
        return pose_matrix(lib.om_press_pose(self._c))
