"""Scenes, sites built from them, and bodies: tissue with its contact on fixed anatomy."""
from __future__ import annotations

import ctypes
import os
import pathlib
import tempfile
from typing import Any

import numpy as np

from . import _capi as c
from . import plot as _plot
from ._convert import array_of, find_enum, index_array, length, need, quantity
from ._lib import (Busy, Handle, Owner, Progress, ProgressFunction, arm_of, copied, create, forget_message, lib, outcome, path_of, pose, pose_matrix, refuse_fork, refuse_volume,
                   text_of, view)
from .mesh import Surface, TetMesh
from .patient import Patient
from .tissue import check_material, engines, warn_of_fall, warn_of_softness, with_status

class Scene(c.OmScene):
    """Everything a run needs to know: the fields of OmScene, SI units. `scene.tissue.young = 4000` changes one.

    scene = Scene.load("scenes/sheet.yaml");  scene = Scene();  print(scene.yaml())
    """

    def __init__(self) -> None:
        """The thesis's sheet with default settings."""
        super().__init__()
        plain = lib.om_scene_default()
        ctypes.memmove(ctypes.byref(self), ctypes.byref(plain), ctypes.sizeof(plain))
        self.engines = ctypes.pointer(engines)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """Read a scene file."""
        refuse_volume(path, "a scene")
        scene = cls()
        lib.om_scene_load(path_of(path), ctypes.byref(scene))
        scene.engines = ctypes.pointer(engines)
        return scene

    @classmethod
    def parse(cls, text: str, name: str = "scene") -> Scene:
        """The same from a text; `name` is that of the file in messages."""
        scene, data = cls(), text.encode()
        lib.om_scene_parse(data, len(data), name.encode(), ctypes.byref(scene))
        scene.engines = ctypes.pointer(engines)
        return scene

    def yaml(self, is_commented: bool = False) -> str:
        """The scene as a file, with every default filled in; is_commented: with unit, range and meaning of each key."""
        return text_of(lambda out: lib.om_scene_print(ctypes.byref(self), is_commented, out))

    def copy(self) -> Scene:
        """A scene of its own with the same values."""
        out = Scene.__new__(Scene)
        ctypes.memmove(ctypes.byref(out), ctypes.byref(self), ctypes.sizeof(self))
        return out

    def build(self, role: str = "twin", progress: bool | ProgressFunction | None = None) -> Site:
        """The site of the "twin" or of the simulated "world"."""
        return Site(self, role, progress)

    def __reduce__(self) -> Any:
        return _parse_again, (self.yaml(), self.path or "scene")


def _parse_again(text: str, name: str) -> Scene:
    return Scene.parse(text, name)


def scene_of(scene: Scene | str | os.PathLike[str]) -> Scene:
    """A scene, also from the path of its file."""
    if isinstance(scene, c.OmScene):
        return scene  # type: ignore[return-value]
    if isinstance(scene, (str, os.PathLike)):
        return Scene.load(scene)
    patient = ': patient.save("model"), then Scene.parse("name: mine\\ntissue: {source: patient, file: model/patient.yaml}")' if isinstance(scene, Patient) else ""
    raise TypeError(f"a Scene, or the path of its file, is needed, not {type(scene).__name__}{patient}")


class Site(Owner):
    """Mesh, fixed anatomy and region of interest of a scene.

    mesh: TetMesh in the world frame, m. roi_x, roi_n: sample points and outward normals of the region of interest
    (nroi x 3). roi_center: m (3). half_size: m (3). pose_world_task: (4 x 4). organ: Surface or None.
    """

    def __init__(self, scene: Scene | str | os.PathLike[str], role: str = "twin",
                 progress: bool | ProgressFunction | None = None) -> None:
        scene, raw = scene_of(scene), c.OmSite()
        handle = Handle(raw, lambda site: lib.om_site_done(ctypes.byref(site)))  # before the call: Ctrl-C may come after it
        with Progress(progress) as listener:
            lib.om_site_build(ctypes.byref(scene), find_enum(c.OmSiteRole, role), listener.pointer, ctypes.byref(raw))
        self._handle = handle
        self.role = role
        self.mesh = TetMesh._copy(raw.mesh)
        self.roi_x = copied(raw.roi_x, np.float64, (raw.nroi, 3))
        self.roi_n = copied(raw.roi_n, np.float64, (raw.nroi, 3))
        self.roi_center: np.ndarray = raw.roi_center.copy()
        self.half_size: np.ndarray = raw.half_size.copy()
        self.pose_world_task = pose_matrix(raw.pose_world_task)
        self.roi = Surface._copy(raw.roi)
        self.organ = Surface._copy(raw.organ) if raw.has_organ else None
        self.has_ground: bool = raw.has_ground

    def plot(self, ax: Any = None) -> Any:
        """Draw mesh, organ and region of interest at rest with matplotlib; the axes are returned."""
        self._c  # noqa: B018 - a closed one draws nothing
        ax = self.mesh.plot(ax)
        if self.organ:
            _plot.triangles(ax, self.organ.x, self.organ.tri, _plot.FLESH, 0.5)
        _plot.dots(ax, self.roi_x, "region of interest", _plot.RED)
        ax.legend(loc="upper right")
        return ax

    def to_pyvista(self) -> Any:
        """A pyvista.MultiBlock: "tissue", "roi", and "organ" where there is one."""
        self._c  # noqa: B018 - a closed one draws nothing
        blocks = need("pyvista", "to_pyvista()").MultiBlock()
        blocks["tissue"], blocks["roi"] = self.mesh.to_pyvista(), self.roi.to_pyvista()
        if self.organ:
            blocks["organ"] = self.organ.to_pyvista()
        return blocks

    def tip(self, arm: int = 0) -> np.ndarray:
        """Pose of the tip of a parked arm in the world (4 x 4)."""
        return pose_matrix(lib.om_world_place_tip(ctypes.byref(self._c), arm_of(arm)))

    @property
    def attached_area(self) -> float:
        """m^2."""
        return lib.om_site_attached_area(ctypes.byref(self._c))


class BodyReport(c.OmBodyReport):
    """OmBodyReport with the status of the step and its sentence."""

    status: c.OmStatus
    message: str


_SETTINGS = ("role", "nworker", "scene", "progress")  # arguments of Body beside the tissue's fields


class BodyForces(c.OmBodyForces):
    """OmBodyForces, N."""

    def plot(self, ax: Any = None) -> Any:
        """Bars of the components of each force that is not zero, with matplotlib; the axes are returned."""
        return _plot.forces(ax, self)


class Body(Owner):
    """Tissue of a scene with its contact on board and organ.

        body = Body(Scene.load("scenes/sheet.yaml"))       # or Body(patient)
        body.settle()
        body.grasp(point)
        body.move(point + [0, 0, 0.01])
        body.step(0.02)
        body.forces().pull[0]                               # N, less the weight that the ground no longer carries
    """

    def __init__(self, source: Scene | Patient | Site | str | os.PathLike[str], role: str = "twin", nworker: int = 0,
                 scene: Scene | None = None, progress: bool | ProgressFunction | None = None, **tissue: Any) -> None:
        """
        source: a scene or the path of its file, a patient model, or a site of `scene`.
        role: "twin", the robot's belief, or "world", the simulated truth.
        nworker: threads of a step, 0: one a processor; results do not depend on it.
        scene: of a patient: settings such as law and engine; its tissue is replaced by the patient.
        tissue: fields of OmSceneTissue that replace those of the scene: young (Pa, or words: "3 kPa"), poisson, law, density, engine, ...
        """
        check_material(tissue)
        if tissue and isinstance(source, Site):
            raise TypeError(f"{', '.join(tissue)}: a site is built already; set them in its scene")
        for name, kind in (("young", "stress"), ("density", "density")):
            if name in tissue:
                tissue[name] = quantity(tissue[name], kind, name)
        warn_of_softness(tissue.get("young"))
        if not isinstance(source, (Patient, Site)):
            source = scene_of(source)
            if tissue:
                source = source.copy()
                source.tissue.assign(tissue, also=_SETTINGS)
        self._made = None if isinstance(source, Site) else (source, role, nworker, scene.copy() if scene is not None else None, tissue)
        if isinstance(source, Patient):
            scene, site = _patient_site(source, scene, role, progress, tissue)
        elif isinstance(source, Site):
            if scene is None:
                raise ValueError("a body of a site needs the scene of the site")
            site = source
        else:
            scene, site = source, Site(source, role, progress)
        scene = scene.copy()  # borrowed by C: later changes of the caller's scene are not for this body
        self.scene, self.site = scene, site
        out = ctypes.c_void_p()
        lib.om_body_create(ctypes.byref(scene), ctypes.byref(site._c), nworker, ctypes.byref(out))
        self._setup(Handle(out.value, lib.om_body_destroy, site._handle, scene))

    def _setup(self, handle: Handle) -> None:
        self._handle = handle
        self._busy = Busy("Body")
        self._is_looked_at = False
        self._view: Handle | None = None
        self._shape = self.site.mesh.x.shape

    @classmethod
    def _borrow(cls, address: int, scene: Scene, site: Site, keep: Any) -> Body:
        """A body that another object owns: the truth of a world."""
        body = cls.__new__(cls)
        body.scene, body.site, body._made = scene, site, None
        body._setup(Handle(address, lambda _: None, keep))
        return body

    # ---- what there is ----

    @property
    def mesh(self) -> TetMesh:
        """The mesh at rest."""
        return self.site.mesh

    @property
    def x(self) -> np.ndarray:
        """Positions, m (nvert x 3): a read-only view that every step changes."""
        return view(self._handle, lib.om_body_x(self._c), np.float64, self._shape)

    @property
    def nodes(self) -> np.ndarray:
        """Positions of the vertices and, of quadratic elements, of the midpoints of edges, m (nnode x 3): a copy."""
        x = np.empty((lib.om_body_node_count(self._c), 3))
        lib.om_body_get_nodes(self._c, x.ctypes.data)
        return x

    @property
    def attached(self) -> np.ndarray:
        """True where a vertex is attached (nvert): a view."""
        return view(self._handle, lib.om_body_attached(self._c), np.bool_, self._shape[:1])

    @property
    def held_by(self) -> np.ndarray:
        """The arm that grasps each vertex, -1: none (nvert): a view."""
        return view(self._handle, lib.om_body_held_by(self._c), np.int8, self._shape[:1])

    @property
    def engine(self) -> str:
        """Name of the engine."""
        return lib.om_body_engine(self._c).contents.name.decode()

    @property
    def nbad(self) -> int:
        """Steps so far that did not converge."""
        return lib.om_body_nbad(self._c)

    @property
    def hash(self) -> int:
        """Of the state."""
        return lib.om_body_hash(self._c)

    # ---- changing it ----

    def grasp(self, tip: Any, arm: int = 0, radius: float | str = 0.005) -> int:
        """Grasp the vertices within `radius` m of the tip (a point or a pose), with quadratic elements also the midpoints of
        edges there; their number is returned. A radius above 0.1 m is refused."""
        radius = length(radius, "radius")
        held = ctypes.c_int()
        with self._busy:
            lib.om_body_grasp(self._c, arm, pose(tip), radius, ctypes.byref(held))
        return held.value

    def move(self, tip: Any, arm: int = 0) -> None:
        """Goal of the tool for the end of the next step."""
        with self._busy:
            lib.om_body_move(self._c, arm, pose(tip))

    def release(self, arm: int = 0) -> None:
        """Open the tool."""
        with self._busy:
            lib.om_body_release(self._c, arm_of(arm))

    def is_holding(self, arm: int = 0) -> bool:
        """Whether the arm grasps tissue."""
        return lib.om_body_is_holding(self._c, arm_of(arm))

    def set_attachment(self, vert: Any, anchor: Any = None, stiffness: Any = None) -> None:
        """Replace all attachments; as of Tissue.set_attachment."""
        vert = index_array(vert, "vert", self._shape[0])
        anchor = None if anchor is None else array_of(anchor, np.float64, (len(vert), 3), "anchor")
        if stiffness is not None:
            stiffness = np.ascontiguousarray(np.broadcast_to(np.asarray(stiffness, np.float64), (len(vert),)))
        with self._busy:
            lib.om_body_set_attachment(self._c, len(vert), vert.ctypes.data, None if anchor is None else anchor.ctypes.data,
                                       None if stiffness is None else stiffness.ctypes.data)

    def step(self, dt: float = 0.02, strict: bool = True) -> BodyReport:
        """A step of `dt` s. One that did not converge has advanced; it raises NotConverged, or with strict=False returns the
        report, whose `status` and `message` say so."""
        report = BodyReport()
        self._look_at_supports()
        with self._busy:
            forget_message()
            status = lib.om_body_step(self._c, quantity(dt, "time", "dt"), ctypes.byref(report))
        return outcome(status, with_status(report, status), strict)

    def settle(self, dt: float = 0.02, speed: float = 1e-3, seconds: float = 5.0, strict: bool = True) -> bool:
        """Step until all speeds are below `speed` m/s, for at most `seconds` s. True: the body is at rest."""
        self._look_at_supports()
        with self._busy:
            forget_message()
            status = lib.om_body_settle(self._c, dt, speed, seconds)
        return outcome(status, status == 0, strict)

    def _look_at_supports(self) -> None:
        """Before the first step alone, as of Tissue: a body that no board, organ, attachment or tool carries falls."""
        if self._is_looked_at:
            return
        self._is_looked_at = True
        site = self.site
        if not (site.has_ground or site.organ or self.attached.any() or (self.held_by >= 0).any()) and self.scene.tissue.gravity:
            warn_of_fall()

    def reset(self) -> None:
        """Back to the rest shape and the attachments of the site, at time 0."""
        with self._busy:
            lib.om_body_reset(self._c)

    # ---- measuring ----

    def forces(self) -> BodyForces:
        """N: grasp and pull (arms x 3), attachment, contact, weight (3)."""
        out = BodyForces()
        with self._busy:
            lib.om_body_get_forces(self._c, ctypes.byref(out))
        return out

    def visibility(self) -> float:
        """Share of the region of interest that the scene's endoscope sees now, 0 to 1; nothing but tissue and fixed anatomy hides it."""
        refuse_fork("a camera")
        seen = c.OmVisibility()
        with self._busy:
            if self._view is None:
                address = create(lib.om_view_create_of_body, ctypes.byref(self.scene), self._c)
                self._view = Handle(address, lib.om_view_destroy, self._handle)
            lib.om_view_look(self._view.address, lib.om_body_x(self._c), ctypes.byref(seen))
        return seen.nseen / max(1, seen.npoint)

    def vertex_forces(self) -> np.ndarray:
        """Force on each vertex by tools, attachments and contact, N (nvert x 3)."""
        out = np.zeros(self._shape)
        with self._busy:
            lib.om_body_get_vertex_forces(self._c, out.ctypes.data)
        return out

    def plot(self, measure: str | None = None, ax: Any = None, color: Any = _plot.FAT) -> Any:
        """Draw the present shape with matplotlib, and the organ below it; attached and grasped vertices are marked, and the axes
        returned. measure: colours the tissue, as of Tissue.measure."""
        self._c  # noqa: B018 - a closed one draws nothing
        ax = _plot.axes_3d(ax)
        if self.site.organ:
            _plot.triangles(ax, self.site.organ.x, self.site.organ.tri, _plot.FLESH, 0.5)
        values = None if measure is None else self.measure(measure)
        return _plot.deformed(ax, self.mesh, self.x, self.attached, self.held_by, measure, values, color)

    def to_pyvista(self, *measures: str) -> Any:
        """The present shape as a pyvista.UnstructuredGrid, with attached, held_by, displacement (m), and measures of the elements.
        `body.site.organ.to_pyvista()` is the organ."""
        self._c  # noqa: B018 - a closed one draws nothing
        moved = TetMesh(self.x.copy(), self.mesh.tet, self.mesh.label, self.mesh.sets)
        return _plot.deformed_grid(self, moved.to_pyvista(), measures)

    def measure(self, kind: str | c.OmTissueMeasure = "von_mises") -> np.ndarray:
        """A measure of every element (ntet), as of Tissue.measure."""
        out = np.zeros(len(self.mesh.tet))
        number = find_enum(c.OmTissueMeasure, kind)
        with self._busy:
            lib.om_body_get_measure(self._c, number, out.ctypes.data)
        return out

    def snapshot(self) -> bytes:
        """Everything that changes."""
        block = np.zeros(lib.om_body_state_size(self._c), np.uint8)
        with self._busy:
            lib.om_body_save(self._c, block.ctypes.data)
        return block.tobytes()

    def restore(self, snapshot: bytes) -> None:
        """Return to a snapshot of this body."""
        if len(snapshot) != lib.om_body_state_size(self._c):
            raise ValueError("the snapshot is of another body")
        with self._busy:
            lib.om_body_restore(self._c, snapshot)

    def __reduce__(self) -> Any:
        if self._made is None:
            raise TypeError("a body of a site, or of a world, is not pickled: pickle the scene or the patient, and snapshot()")
        source, role, nworker, scene, tissue = self._made
        source = self.scene if isinstance(source, Scene) else source  # as it was when the body was made
        return _restored_body, (source, role, nworker, scene, tissue if isinstance(source, Patient) else {}, self.snapshot())

    def __repr__(self) -> str:
        return "Body(closed)" if self.is_closed else f"Body({self.mesh!r}, engine {self.engine!r})"


def _restored_body(source: Any, role: str, nworker: int, scene: Scene | None, tissue: dict[str, Any], snapshot: bytes) -> Body:
    body = Body(source, role, nworker, scene, **tissue)
    body.restore(snapshot)
    return body


def _patient_site(patient: Patient, scene: Scene | None, role: str, progress: Any, tissue: dict[str, Any]) -> tuple[Scene, Site]:
    """A scene whose tissue is the patient model, and its site, which holds no file afterwards."""
    mine = Scene.parse(scene.yaml(), scene.path or "scene") if scene is not None else Scene()
    with tempfile.TemporaryDirectory(prefix="omentum-") as folder:
        place = pathlib.Path(folder, "patient")
        patient.save(place)
        mine.tissue.source = c.OmTissueSource.PATIENT
        mine.data_root, mine.tissue.file = str(place), "patient.yaml"
        if scene is None:
            mine.attach.kind = int(c.OmAttachKind.SET)
            mine.tissue.young = mine.tissue.density = mine.tissue.poisson = -1  # the materials of the patient
        mine.tissue.assign(tissue, also=_SETTINGS)
        return mine, Site(mine, role, progress)
