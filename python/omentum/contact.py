"""Contact of tissue with planes, with itself, and of soft bodies with each other."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from typing import Any, Iterable

import numpy as np

from . import _capi as c
from ._lib import Closed, Handle, Owner, create, forget_message, lib, message_of, outcome
from .mesh import Surface
from .tissue import Tissue


@dataclass
class ContactReport:
    """A step with contact. force: N, of all obstacles on the tissue (3); penetration and self_penetration: m.

    Places where tissue touches tissue (ntouch): vert and weight (ntouch x 4): vertex vert[k, a] feels weight[k, a] * force[k];
    body (ntouch x 2): of the two sides; point (m), normal (from the second side to the first), touch_force (N, on the first
    side), gap (m, distance less thickness). is_held_back: a tool stopped short of its goal. tissue: OmTissueReport.
    """

    status: c.OmStatus
    message: str
    is_settled: bool
    is_held_back: bool
    nsolve: int
    ncontact: int
    force: np.ndarray
    penetration: float
    self_penetration: float
    ntouch: int
    vert: np.ndarray
    weight: np.ndarray
    body: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    touch_force: np.ndarray
    gap: np.ndarray
    tissue: c.OmTissueReport = field(repr=False)


@dataclass
class Skin:
    """The smooth surface of a body of the mesh, which rides on the body: OmContactSkin.

    surface: closed, of the body at rest. vert: (first, end) of the body's vertices in the tissue's mesh. spacing: m, grid of its
    distance field.
    """

    surface: Surface
    vert: tuple[int, int]
    spacing: float

    def _field(self) -> Handle:
        raw = c.OmSdf()
        definition = lib.om_sdf_default_def(self.spacing)
        lib.om_sdf_from_surface(ctypes.byref(self.surface._as_c()), ctypes.byref(definition), ctypes.byref(raw))
        return Handle(ctypes.pointer(raw), lib.om_sdf_done)


class Contact(Owner):
    """Contact of a tissue: step() is a step of the tissue with it.

        sheet = Tissue(mesh)
        contact = Contact(sheet, planes=[((0, 0, 0), (0, 0, 1))], self_contact=True, self_friction=0.3)
        contact.step(0.02)
        contact.body_force(0, 1)                            # N, of body 1 on body 0: bodies are the pieces of the mesh
    """

    def __init__(self, tissue: Tissue, planes: Iterable[tuple[Any, Any]] = (), skins: Iterable[Skin] = (),
                 **fields: Any) -> None:
        """planes: (point, normal towards the free side) of each. skins: smooth surfaces of bodies of the mesh. fields of
        OmContactDef: self_contact, self_thickness (m), self_friction, friction, offset (m), stiffness, recover_speed (m/s),
        max_iterations."""
        definition = lib.om_contact_default_def()
        planes = list(planes)
        raw = (c.OmContactPlane * max(1, len(planes)))()
        obstacles = (c.OmTissueObstacle * max(1, len(planes)))()
        for k, (point, normal) in enumerate(planes):
            raw[k].point, raw[k].normal = point, normal
            obstacles[k] = lib.om_plane_obstacle(ctypes.byref(raw[k]))
        definition.nobstacle, definition.obstacle = len(planes), obstacles
        skins = list(skins)
        kept = [skin._field() for skin in skins]
        raw_skins = (c.OmContactSkin * max(1, len(skins)))()
        for k, skin in enumerate(skins):
            raw_skins[k].sdf, (raw_skins[k].vert_begin, raw_skins[k].vert_end) = kept[k].address, skin.vert
        definition.nskin, definition.skin = len(skins), raw_skins
        definition.assign(fields)
        self._tissue, self._has_support = tissue, bool(planes or skins)
        address = create(lib.om_contact_create, ctypes.byref(definition), tissue._model_c)
        self._made: Handle | None = Handle(address, lib.om_contact_destroy, tissue._model, *kept)
        self._handle = Handle(create(lib.om_contact_work_create, address), lib.om_contact_work_destroy, self._made)

    def close(self) -> None:
        """Give up the contact; the tissue stays."""
        self._handle = self._made = None

    def step(self, dt: float = 0.02, strict: bool = True) -> ContactReport:
        """A step of the tissue of `dt` s with contact; `strict` as of Tissue.step."""
        raw, tissue = c.OmContactReport(), self._tissue
        tissue._look_at_supports(self._has_support)
        with tissue._busy:
            forget_message()
            status = lib.om_contact_step(self._c, tissue._model_c, tissue._c, tissue._work.address, dt,
                                         ctypes.byref(raw))
        return outcome(status, self._report(status, raw), strict)

    def settle(self, dt: float = 0.02, speed: float = 1e-3, seconds: float = 5.0, strict: bool = True) -> c.OmStatus:
        """Step until contact has settled and no vertex is faster than `speed` m/s, for at most `seconds`."""
        tissue = self._tissue
        tissue._look_at_supports(self._has_support)
        with tissue._busy:
            forget_message()
            status = lib.om_contact_settle(self._c, tissue._model_c, tissue._c, tissue._work.address, dt, speed,
                                           seconds)
        return outcome(status, c.OmStatus(status), strict)

    def find_crossing(self) -> tuple[int, np.ndarray]:
        """Edges of the surface that go through another part of it, and the middle of the first, m."""
        number, at = ctypes.c_int(), c.OmVec3()
        with self._tissue._busy:
            lib.om_contact_find_crossing(self._c, self._tissue._c, ctypes.byref(number), ctypes.byref(at))
        return number.value, np.array([at.x, at.y, at.z])

    def body_force(self, a: int, b: int) -> np.ndarray:
        """Force of body b on body a in the last substep, N (3)."""
        f = lib.om_contact_body_force(self._c, a, b)
        return np.array([f.x, f.y, f.z])

    @property
    def body(self) -> np.ndarray:
        """The body of each vertex: pieces of the mesh in the order of their first vertices (nvert); -1 without self_contact and
        skins."""
        if self._made is None:
            raise Closed("this Contact is closed")
        made = self._made.address
        return np.array([lib.om_contact_body_of(made, k) for k in range(len(self._tissue.x))], np.int32)

    def _report(self, status: int, raw: Any) -> ContactReport:
        n = raw.ntouch
        touch = [raw.touch[k] for k in range(n)]

        def table(name: str, width: int) -> np.ndarray:
            return np.array([list(getattr(t, name)) for t in touch], float).reshape(n, width)

        return ContactReport(
            c.OmStatus(status), message_of(status), raw.is_settled, raw.is_held_back, raw.nsolve, raw.ncontact, raw.force.copy(),
            raw.penetration, raw.self_penetration, n, table("vert", 4).astype(np.int32), table("weight", 4),
            table("body", 2).astype(np.int32), table("point", 3), table("normal", 3), table("force", 3),
            np.array([t.gap for t in touch]), c.OmTissueReport.from_buffer_copy(raw.tissue))
