"""Soft tissue: grasp, move, step, statics, forces, stress, attachments, snapshots."""
from __future__ import annotations

import ctypes
import os
from typing import Any

import numpy as np

from . import _capi as c
from . import plot as _plot
from ._convert import array_of, find_enum, index_array, length, quantity
from ._lib import (Busy, Closed, Handle, Owner, arm_of, copied, create, forget_message, lib, message_of, outcome, path_of,
                   pose, view, warn_user)
from .engine import Engine
from .mesh import Surface, TetMesh
from .patient import Patient
from .volume import Volume

__all__ = ["Embedding", "StepReport", "Tissue", "register_engine"]


class StepReport(c.OmTissueReport):
    """OmTissueReport with the status of the step: OK or NOT_CONVERGED, and its sentence."""

    status: c.OmStatus
    message: str


class TissueForces(c.OmTissueForces):
    """OmTissueForces, N."""

    def plot(self, ax: Any = None) -> Any:
        """Bars of the components of each force that is not zero, with matplotlib; the axes are returned."""
        return _plot.forces(ax, self)


def with_status(report: Any, status: int) -> Any:
    report.__dict__["status"] = c.OmStatus(status)
    report.__dict__["message"] = message_of(status)
    return report


engines = lib.om_engine_set_default()  # lives as long as the module: scenes borrow it
lib.om_engine_set_add(ctypes.byref(engines), lib.om_umesh_engine())
_registered: list[Engine] = []


def register_engine(engine: Engine) -> None:
    """Make an engine in Python known by its name, to Tissue and in scenes (`tissue: engine`)."""
    lib.om_engine_set_add(ctypes.byref(engines), engine.table())
    _registered.append(engine)  # the set borrows its table


def find_engine(name: str | Engine) -> Any:
    """The table of an engine: "fem", "pbd", "xpbd", "springs", "chainmail", "umesh", or one in Python."""
    if isinstance(name, Engine):
        return name.table()
    table = ctypes.POINTER(c.OmTissueEngine)()
    lib.om_engine_set_find(ctypes.byref(engines), name.encode(), ctypes.byref(table))
    return table


_KIND = {"young": "stress", "density": "density"}


def _make_materials(definition: Any, mesh: TetMesh, materials: Any, plain: dict[str, Any]) -> None:
    """Materials by label: an entry of label -1 holds for every label that no other entry has."""
    materials = [materials] if isinstance(materials, (dict, str)) else materials
    for entry in materials:
        if not isinstance(entry, dict):
            raise TypeError(_NO_MATERIAL.format(entry))
    materials = [{k: quantity(v, _KIND[k], k) if k in _KIND else v for k, v in entry.items()} for entry in materials]
    number = int(mesh.label.max(initial=0)) + 1  # type: ignore[union-attr]
    table, density = (c.OmMaterial * number)(), (ctypes.c_double * number)()
    for label in range(number):
        entry = next((m for m in materials if m.get("label", -1) == label), None) or \
            next((m for m in materials if m.get("label", -1) == -1), {})
        values = {k: v for k, v in {**entry, **plain}.items() if k not in ("name", "label", "density")}
        ctypes.memmove(ctypes.byref(table[label]), ctypes.byref(definition.material_default), ctypes.sizeof(c.OmMaterial))
        table[label].assign(values)
        density[label] = entry.get("density", definition.density)
    definition.nmaterial, definition.material = number, table
    definition.material_density = ctypes.addressof(density)
    definition._keep = (table, density)


def _make_bonds(mesh: Any, bonds: list[tuple[Any, tuple[int, int], float]]) -> tuple[int, Any]:
    lists = [(index_array(vert, "bonds"), tets, stiffness) for vert, tets, stiffness in bonds]
    table, done = (c.OmTissueBond * max(1, sum(len(vert) for vert, _, _ in lists)))(), 0
    for vert, (first, end), stiffness in lists:
        lib.om_tissue_make_bonds(ctypes.byref(mesh), len(vert), vert.ctypes.data, first, end, stiffness,
                                 ctypes.byref(table[done]))
        done += len(vert)
    return done, table


_NO_MATERIAL = ('material="{}": materials have no names here, because the same organ differs by a factor of ten between people '
                'and studies; give young="3 kPa", poisson=0.45 and law="neo-hookean", with the values of your source')
_FALLS = ("the tissue is held by nothing and falls: attach it (the mesh's set \"attachment\", or set_attachment), grasp it, give it "
          "a ground (Contact), or set gravity=(0, 0, 0)")


_SOFT = 50.0  # Pa; brain, the softest organ, has some hundred
_LONG = 2.0  # m; a longer mesh was probably meant in millimetres


def check_material(options: dict[str, Any]) -> None:
    """Raise TypeError, which says what works, where a material was named."""
    if "material" in options:
        raise TypeError(_NO_MATERIAL.format(options["material"]))


def warn_of_softness(young: Any) -> None:
    """Warn of a modulus that was probably meant in kPa; below 0 is the patient's own."""
    if isinstance(young, (int, float)) and 0 < young < _SOFT:
        warn_user(f'young: {young:g} Pa is softer than any organ; moduli are in Pa, {young:g} kPa is {1e3 * young:g} or "{young:g} kPa"')


def mesh_of(mesh: Any) -> Any:
    """A mesh or a patient as it is; anything else raises TypeError, which says what makes one of it."""
    if isinstance(mesh, (TetMesh, Patient)):
        return mesh
    remedy = "TetMesh(x, tet) is one of arrays, TetMesh.load(path) of a file"
    if isinstance(mesh, (str, os.PathLike, Volume)):
        remedy = 'build_patient(volume or path, edge="6 mm") makes a patient of a label map or a closed surface, TetMesh.load(path) reads a mesh'
    elif isinstance(mesh, Surface):
        remedy = 'a surface has no inside: surface.save("organ.stl"), then build_patient("organ.stl", edge="6 mm", unit="m")'
    raise TypeError(f"mesh: a TetMesh or a Patient is needed, not {type(mesh).__name__}; {remedy}")


def warn_of_fall() -> None:
    """Warn of tissue that nothing holds."""
    warn_user(_FALLS)


class Tissue(Owner):
    """Tissue of a mesh: positions (m), forces (N) and time of one simulation.

        tissue = Tissue(mesh, young=3000, law="neo-hookean")
        tissue.grasp(point)                     # the vertices within 5 mm
        tissue.move(point + [0, 0, 0.01])
        tissue.step(0.02)
        tissue.forces().pull[0]                 # N
    """

    def __init__(self, mesh: TetMesh | Patient, engine: str | Engine = "fem", *, young: float | str | None = None,
                 poisson: float | None = None, law: str | c.OmLaw | None = None,
                 materials: list[dict[str, Any]] | dict[str, Any] | None = None, file: str | None = None,
                 numbers: dict[str, float] | None = None, bonds: list[tuple[Any, tuple[int, int], float]] | None = None,
                 **options: Any) -> None:
        """
        mesh: its set "attachment" is held; of a Patient the mesh and the materials are taken.
        engine: "fem", "pbd", "xpbd", "springs", "chainmail", "umesh" with the `file` of a trained network, or an Engine.
        young (Pa, or words: "3 kPa"), poisson, law: of all tissue; default 3000, 0.45, "corotational".
        materials: a dictionary of fields of OmMaterial for each label, with "label" (-1: all others) and "density"; one alone holds for all.
        numbers: of the engine, such as {"cluster_spacing": 0.0127} (m).
        bonds: springs between bodies of the mesh, for each a tuple: vertices of one body, (first, end) of the tetrahedra of the
        other one, N/m of each vertex.
        options: other fields of OmTissueDef: density (kg/m^3), gravity (m/s^2), attachment_stiffness (N/m), rayleigh_mass,
        rayleigh_stiffness, max_newton, element ("linear", "shell", or "quadratic", the default of "fem"), solver={"nworker": 2, ...}.
        """
        check_material(options)
        mesh_of(mesh)
        if young is not None:
            young = quantity(young, "stress", "young")
        warn_of_softness(young)
        if "density" in options:
            options["density"] = quantity(options["density"], "density", "density")
        plain = {k: v for k, v in (("young", young), ("poisson", poisson), ("law", law)) if v is not None}
        if isinstance(mesh, Patient):
            materials, mesh = materials or mesh.materials, mesh.mesh
        long = float(np.ptp(mesh.x, axis=0).max(initial=0)) if len(mesh.x) else 0.0
        if long > _LONG:
            warn_user(f"the mesh is {long:g} m long: positions are in metres; if these are millimetres, multiply mesh.x by 0.001 (from_meshio and "
                      "from_pyvista take unit=0.001)")
        arguments = {"engine": engine, "materials": materials, "file": file, "numbers": numbers, "bonds": bonds, **plain, **options}
        raw, table = mesh._as_c(), find_engine(engine)
        definition = lib.om_tissue_default_def(table, ctypes.byref(raw))
        definition.assign(options)
        if materials:
            _make_materials(definition, mesh, materials, plain)
        else:
            definition.material_default.assign(plain)
        if bonds:
            definition.nbond, definition.bond = _make_bonds(raw, bonds)
        if file or numbers:
            values = (c.OmEngineNumber * max(1, len(numbers or {})))()
            for value, (name, number) in zip(values, (numbers or {}).items()):
                value.name, value.value = name.encode(), number
            given = c.OmEngineInput(file=file.encode() if file else None, nnumber=len(numbers or {}), number=values)
            definition.input = ctypes.pointer(given)
        model = Handle(create(lib.om_tissue_create, ctypes.byref(definition)), lib.om_tissue_destroy, engine)
        self._setup(mesh, arguments, model)

    def _setup(self, mesh: TetMesh, arguments: dict[str, Any], model: Handle) -> None:
        self._arguments, self._model, self._given, self._mesh = arguments, model, mesh, mesh
        if lib.om_tissue_mesh(model.address).contents.nvert != len(mesh.x):  # with midpoints
            self._mesh = TetMesh._copy(lib.om_tissue_mesh(model.address).contents)
        self._handle = Handle(create(lib.om_tissue_state_create, model.address), lib.om_tissue_state_destroy, model)
        self._work = Handle(create(lib.om_tissue_work_create, model.address), lib.om_tissue_work_destroy, model)
        self._busy = Busy("Tissue")
        self._is_looked_at = False
        shape = (len(self._mesh.x), 3)
        self._x = view(self._handle, lib.om_tissue_x(self._c), np.float64, shape)
        self._v = view(self._handle, lib.om_tissue_v(self._c), np.float64, shape)

    def copy(self) -> Tissue:
        """A second simulation of the same model, in the same state; it may run in another thread."""
        twin = Tissue.__new__(Tissue)
        with self._busy:
            state = self._snapshot()
        twin._setup(self._given, self._arguments, self._model)
        twin.restore(state)
        return twin

    def close(self) -> None:
        """Give up model, state and work. Views of positions keep the memory that they show."""
        self._handle = None
        self.__dict__.update(_model=None, _work=None, _x=None, _v=None)

    # ---- what there is ----

    @property
    def mesh(self) -> TetMesh:
        """The mesh at rest, to which arrays of vertices and elements belong. Its first vertices are those of the given mesh.
        With quadratic elements midpoints of edges follow, each tetrahedron of the given mesh is eight, and the set
        "attachment" has the midpoints between attached vertices."""
        return self._mesh

    def _make_tet10(self) -> Any:
        """Quadratic elements in their present shape, to be freed with om_tet10_mesh_done; None of linear elements."""
        self._c
        if self._mesh is self._given:
            return None
        raw = c.OmTet10Mesh()
        lib.om_tissue_make_tet10(self._model_c, self._x.ctypes.data, ctypes.byref(raw))
        return raw

    def save(self, path: str | os.PathLike[str], unit: float = 1.0) -> None:
        """Write the present shape (.vtu, .vtk, .msh) with labels and sets: tetrahedra of ten nodes, or of four where
        elements are linear. unit: m per unit of the file."""
        with self._busy:
            if self._mesh is self._given:
                TetMesh(self.x.copy(), self._mesh.tet, self._mesh.label, self._mesh.sets).save(path, unit)
                return
            raw = self._make_tet10()
            try:
                lib.om_tet10_mesh_save(ctypes.byref(raw), path_of(path), unit)
            finally:
                lib.om_tet10_mesh_done(ctypes.byref(raw))

    @property
    def x(self) -> np.ndarray:
        """Positions of the vertices of `mesh`, m (nvert x 3): a view that every step changes; copy it to keep values.
        Read-only, see set_x."""
        if self._handle is None:
            raise Closed("this Tissue is closed")
        return self._x

    @x.setter
    def x(self, _: Any) -> None:
        raise AttributeError("x is a view of the simulation: set_x(x) replaces the positions")

    @property
    def v(self) -> np.ndarray:
        """Velocities, m/s (nvert x 3): a view, as x."""
        if self._handle is None:
            raise Closed("this Tissue is closed")
        return self._v

    @property
    def time(self) -> float:
        """s."""
        return lib.om_tissue_time(self._c)

    @property
    def mass(self) -> np.ndarray:
        """Lumped masses, kg (nvert)."""
        self._c
        return view(self._model, lib.om_tissue_mass(self._model.address), np.float64, (len(self._mesh.x),))

    @property
    def external_force(self) -> np.ndarray:
        """N (nvert x 3), zero at first: a view to write into; the values stay until they are changed."""
        return view(self._handle, lib.om_tissue_external_force(self._c), np.float64, self._mesh.x.shape, writable=True)

    @property
    def attached(self) -> np.ndarray:
        """True where a vertex is attached (nvert): a view."""
        return view(self._handle, lib.om_tissue_attached(self._c), np.bool_, (len(self._mesh.x),))

    @property
    def held_by(self) -> np.ndarray:
        """The arm that grasps each vertex, -1: none (nvert): a view."""
        return view(self._handle, lib.om_tissue_held_by(self._c), np.int8, (len(self._mesh.x),))

    @property
    def surface_vert(self) -> np.ndarray:
        """Vertices of the boundary, ascending."""
        self._c
        number = ctypes.c_int()
        address = lib.om_tissue_surface_vert(self._model.address, ctypes.byref(number))
        return view(self._model, address, np.int32, (number.value,))

    # ---- changing it ----

    def set_x(self, x: Any, v: Any = None) -> None:
        """Replace positions, m, and velocities, m/s (None: zero); (nvert x 3)."""
        x = array_of(x, np.float64, self._mesh.x.shape, "x")
        v = None if v is None else array_of(v, np.float64, self._mesh.x.shape, "v")
        with self._busy:
            lib.om_tissue_set_x(self._model_c, self._c, x.ctypes.data, None if v is None else v.ctypes.data)

    def set_attachment(self, vert: Any, anchor: Any = None, stiffness: Any = None) -> None:
        """Replace all attachments.

        vert: vertex numbers, or a mask. anchor: m (nvert x 3); None: the rest positions. stiffness: N/m of the spring of each
        vertex, one number or (nvert), 0: fixed; None: as the definition says.
        """
        vert = index_array(vert, "vert", len(self._mesh.x))
        anchor = None if anchor is None else array_of(anchor, np.float64, (len(vert), 3), "anchor")
        if stiffness is not None:
            stiffness = np.ascontiguousarray(np.broadcast_to(np.asarray(stiffness, np.float64), (len(vert),)))
        with self._busy:
            lib.om_tissue_set_attachment(self._model_c, self._c, len(vert), vert.ctypes.data,
                                         None if anchor is None else anchor.ctypes.data,
                                         None if stiffness is None else stiffness.ctypes.data)

    def grasp(self, tip: Any, arm: int = 0, radius: float | str = 0.005) -> int:
        """Grasp the vertices within `radius` m of the tip, which they follow rigidly; their number is returned.

        tip: a point, m (3), a pose (4 x 4), or (point, quaternion x y z w). radius: above 0.1 m it is refused.
        """
        radius = length(radius, "radius")
        held = ctypes.c_int()
        with self._busy:
            lib.om_tissue_grasp(self._model_c, self._c, arm, pose(tip), radius, ctypes.byref(held))
        return held.value

    def move(self, tip: Any, arm: int = 0) -> None:
        """Goal of the tool for the end of the next step; as of grasp."""
        with self._busy:
            lib.om_tissue_move_grasp(self._c, arm, pose(tip))

    def release(self, arm: int = 0) -> None:
        """Open the tool."""
        with self._busy:
            lib.om_tissue_release(self._c, arm_of(arm))

    def step(self, dt: float = 0.02, strict: bool = True) -> StepReport:
        """One implicit Euler step of `dt` s.

        A step that did not converge has advanced with the best iterate. It raises NotConverged (`result` is the report), or
        with strict=False returns the report, whose `status` and `message` say so.
        """
        report = StepReport()
        self._look_at_supports()
        with self._busy:
            forget_message()
            status = lib.om_tissue_step(self._model_c, self._c, self._work.address, quantity(dt, "time", "dt"), ctypes.byref(report))
        return outcome(status, with_status(report, status), strict)

    def _look_at_supports(self, has_support: bool = False) -> None:
        """Before the first step alone: most falls are forgotten attachments. has_support: a ground carries it."""
        if self._is_looked_at:
            return
        self._is_looked_at = True
        if has_support:
            return
        held = self.attached.any() or (self.held_by >= 0).any() or self.external_force.any()
        if not held and np.frombuffer(lib.om_tissue_gravity(self._model_c), np.float64).any():
            warn_of_fall()

    def find_rest(self, tolerance: float = 1e-5, max_iterations: int = 100, strict: bool = True) -> StepReport:
        """Static equilibrium under weight, external forces, attachments and tools. `strict` as of step."""
        report = StepReport()
        self._look_at_supports()
        with self._busy:
            forget_message()
            status = lib.om_tissue_find_rest(self._model_c, self._c, self._work.address, tolerance, max_iterations,
                                             ctypes.byref(report))
        return outcome(status, with_status(report, status), strict)

    def reset(self) -> None:
        """Back to the rest shape, at rest, nothing grasped."""
        with self._busy:
            lib.om_tissue_state_reset(self._model_c, self._c)

    # ---- measuring ----

    def forces(self) -> TissueForces:
        """Resultants on the tissue, N: grasp and pull (arms x 3), attachment, contact, external, weight (3)."""
        out = TissueForces()
        with self._busy:
            lib.om_tissue_get_forces(self._model_c, self._c, ctypes.byref(out))
        return out

    def internal_force(self) -> np.ndarray:
        """Elastic force on each vertex, N (nvert x 3)."""
        return self._vertex_force(lib.om_tissue_get_internal_force)

    def attachment_force(self) -> np.ndarray:
        """Force on each vertex by its attachment, N (nvert x 3)."""
        return self._vertex_force(lib.om_tissue_get_attachment_force)

    def holding_force(self) -> np.ndarray:
        """Force on each vertex by tools, attachments and contact, N (nvert x 3)."""
        return self._vertex_force(lib.om_tissue_get_holding_force)

    def _vertex_force(self, function: Any) -> np.ndarray:
        out = np.zeros(self._mesh.x.shape)
        with self._busy:
            function(self._model_c, self._c, out.ctypes.data)
        return out

    def measure(self, kind: str | c.OmTissueMeasure = "von_mises") -> np.ndarray:
        """A measure of every element of `mesh` (ntet): "von_mises" (Pa), "principal_stretch", "strain", "volume_ratio",
        "energy_density" (J/m^3)."""
        out = np.zeros(len(self._mesh.tet))
        number = find_enum(c.OmTissueMeasure, kind)
        with self._busy:
            lib.om_tissue_get_measure(self._model_c, self._c, number, out.ctypes.data)
        return out

    def plot(self, measure: str | None = None, ax: Any = None, color: Any = _plot.FAT) -> Any:
        """Draw the present shape with matplotlib, attached and grasped vertices marked; the axes are returned. measure: colours the
        surface, as of measure()."""
        self._c  # noqa: B018 - a closed one draws nothing
        values = None if measure is None else self.measure(measure)
        return _plot.deformed(ax, self.mesh, self.x, self.attached, self.held_by, measure, values, color)

    def to_pyvista(self, *measures: str) -> Any:
        """The present shape as a pyvista.UnstructuredGrid, with attached, held_by, displacement (m), and measures of the elements."""
        self._c  # noqa: B018 - a closed one draws nothing
        moved = TetMesh(self.x.copy(), self.mesh.tet, self.mesh.label, self.mesh.sets)
        return _plot.deformed_grid(self, moved.to_pyvista(), measures)

    def energy(self) -> c.OmTissueEnergy:
        """elastic, kinetic, gravity, spring: J."""
        out = c.OmTissueEnergy()
        with self._busy:
            lib.om_tissue_get_energy(self._model_c, self._c, ctypes.byref(out))
        return out

    def embed(self, points: Any) -> Embedding:
        """Bind points of the rest shape, m (n x 3), to the elements that contain them or are nearest."""
        points = array_of(points, np.float64, (None, 3), "points")
        raw = c.OmEmbedding()
        lib.om_tissue_embed(self._model_c, len(points), points.ctypes.data, ctypes.byref(raw))
        return Embedding(Handle(raw, lambda e: lib.om_embedding_done(ctypes.byref(e))), len(self._mesh.x))

    # ---- snapshots ----

    @property
    def hash(self) -> int:
        """Of the state: equal for the same bytes."""
        return lib.om_tissue_state_hash(self._c)

    def _snapshot(self) -> bytes:
        return ctypes.string_at(self._c, lib.om_tissue_state_size(self._model_c))

    def snapshot(self) -> bytes:
        """Everything that changes, for restore of this tissue, of a copy, or of one with the same definition."""
        with self._busy:
            return self._snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Return to a snapshot."""
        size = lib.om_tissue_state_size(self._model_c)
        if len(snapshot) != size or snapshot[:12] != ctypes.string_at(self._c, 12):
            raise ValueError("the snapshot is of another model")
        with self._busy:
            ctypes.memmove(self._c, snapshot, size)

    def __getstate__(self) -> dict[str, Any]:
        return {"mesh": self._given, "arguments": self._arguments, "snapshot": self.snapshot()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        arguments = dict(state["arguments"])
        self.__init__(state["mesh"], arguments.pop("engine"), **arguments)  # type: ignore[misc]
        self.restore(state["snapshot"])

    @property
    def _model_c(self) -> Any:
        self._c
        return self._model.address

    def __repr__(self) -> str:
        if self._handle is None:
            return "Tissue(closed)"
        return f"Tissue({self._mesh!r}, engine {getattr(self._arguments['engine'], 'name', self._arguments['engine'])!r}, time {self.time:g} s)"


class Embedding:
    """Points that elements carry."""

    def __init__(self, handle: Handle, nvert: int) -> None:
        self._handle, self._nvert = handle, nvert
        raw = handle.address
        self.tet = copied(raw.tet, np.int32, (raw.npoint,))  # -1: of particles
        self.weights = copied(raw.bary, np.float64, (raw.npoint, 4))

    def eval(self, x: Any) -> np.ndarray:
        """Positions of the points, m (n x 3), for vertex positions x (nvert x 3)."""
        x = array_of(x, np.float64, (self._nvert, 3), "x")
        out = np.zeros((len(self.tet), 3))
        lib.om_embedding_eval(ctypes.byref(self._handle.address), x.ctypes.data, out.ctypes.data)
        return out
