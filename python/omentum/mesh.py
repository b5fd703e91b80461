"""Surfaces and tetrahedral meshes as NumPy arrays, with their files, meshio and PyVista."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _capi as c
from ._convert import array_of, find_enum, index_array, need
from . import plot as _plot
from ._lib import copied, lib, path_of, vec3


class SurfaceRepair(c.OmSurfaceRepair):
    """OmSurfaceRepair: volume, overlap and negative (m^3), share of triangles mended, npart, ncavity; str: its notes."""

    @property
    def found(self) -> dict[str, int]:
        """Defects found, by kind: {"hole": 2, "winding": 30}."""
        counts = {kind.name.lower(): self.defect[kind].count for kind in c.OmDefect if kind != c.OmDefect.NDEFECT}
        return {kind: count for kind, count in counts.items() if count}

    @property
    def notes(self) -> list[str]:
        """A sentence for each kind of defect: how many, where the first is (RAS mm), what was done."""
        text = ctypes.create_string_buffer(512)
        out = []
        for kind in c.OmDefect:
            lib.om_surface_repair_words(ctypes.byref(self), int(kind), text, len(text))
            out.append(text.value.decode())
        return [line for line in out if line]

    def __str__(self) -> str:
        return "\n".join(self.notes)


@dataclass
class Surface:
    """Triangles. x: vertex positions, m (nvert x 3); tri: vertices, counter-clockwise from outside (ntri x 3)."""

    x: np.ndarray
    tri: np.ndarray

    def __post_init__(self) -> None:
        self.x = array_of(self.x, np.float64, (None, 3), "x")
        self.tri = array_of(self.tri, np.int32, (None, 3), "tri")
        if self.tri.size and not 0 <= self.tri.min() <= self.tri.max() < len(self.x):
            raise ValueError(f"tri has a vertex that does not exist: there are {len(self.x)}")

    @classmethod
    def load(cls, path: str | os.PathLike[str], unit: float = 0.0, space: str = "none") -> Surface:
        """Read STL, OBJ, PLY, OFF, VTP, or the boundary of a volume mesh.

        unit: m per unit of the file; 0: as the file says, else a millimetre. space: "ras", "lps", or "none": as the file
        says, else RAS.
        """
        raw, frame = c.OmSurface(), c.OmMeshFrame(unit=unit)
        frame.space = space
        lib.om_surface_load_frame(path_of(path), frame, 0, ctypes.byref(raw), None)
        return cls._take(raw)

    def save(self, path: str | os.PathLike[str], unit: float = 1.0) -> None:
        """Write .stl, .obj, .ply, .off or .vtk. unit: m per unit of the file."""
        lib.om_surface_save(ctypes.byref(self._as_c()), path_of(path), unit)

    @property
    def volume(self) -> float:
        """Enclosed volume, m^3."""
        return lib.om_surface_volume(ctypes.byref(self._as_c()))

    def normals(self) -> np.ndarray:
        """Unit normals of the vertices, weighted by the angles of their triangles (nvert x 3)."""
        out = np.zeros_like(self.x)
        lib.om_surface_normals(ctypes.byref(self._as_c()), out.ctypes.data)
        return out

    def require_closed(self) -> None:
        """Raise Invalid with the first open, non-manifold or flipped edge."""
        lib.om_surface_require_closed(ctypes.byref(self._as_c()))

    def repaired(self, mode: str = "mend", **limits: float) -> tuple[Surface, SurfaceRepair]:
        """A surface that bounds a solid, and what was mended.

        mode: "mend" what has one meaning; "all": also many defects, large holes and edges that stay open; "strict": raise
        Invalid at the first defect. limits: merge, max_hole, max_share of OmSurfaceRepairDef. Raises Invalid, with kind,
        place and remedy, if it cannot be mended.
        """
        self.__post_init__()
        definition = lib.om_surface_repair_default_def()
        definition.assign({"mode": find_enum(c.OmRepairMode, mode), **limits})
        raw, report = c.OmSurface(), SurfaceRepair()
        lib.om_surface_init(ctypes.byref(raw), len(self.x), len(self.tri))
        try:
            ctypes.memmove(raw.x, self.x.ctypes.data, self.x.nbytes)
            ctypes.memmove(raw.tri_vert, self.tri.ctypes.data, self.tri.nbytes)
            lib.om_surface_repair(ctypes.byref(definition), ctypes.byref(raw), ctypes.byref(report))
            return self._copy(raw), report
        finally:
            lib.om_surface_done(ctypes.byref(raw))

    def plot(self, ax: Any = None, color: Any = _plot.FLESH) -> Any:
        """Draw it with matplotlib; the axes are returned."""
        ax = _plot.axes_3d(ax)
        _plot.triangles(ax, self.x, self.tri, color)
        _plot.fit(ax, 1e3 * self.x)
        return ax

    def to_meshio(self) -> Any:
        """A meshio.Mesh."""
        meshio = need("meshio", "to_meshio()")
        return meshio.Mesh(self.x, [("triangle", self.tri)])

    @classmethod
    def from_meshio(cls, mesh: Any, unit: float = 1.0) -> Surface:
        """The triangles of a meshio.Mesh, without vertices that no triangle has. unit: m per unit."""
        tri = [b.data for b in mesh.cells if b.type == "triangle"]
        if not tri:
            raise ValueError("the mesh has no triangles (cells of type 'triangle')")
        used, number = np.unique(np.concatenate(tri), return_inverse=True)
        return cls(unit * np.asarray(mesh.points, float)[used, :3], number.reshape(-1, 3))

    def to_pyvista(self) -> Any:
        """A pyvista.PolyData."""
        pyvista = need("pyvista", "to_pyvista()")
        return pyvista.PolyData(self.x, np.insert(self.tri, 0, 3, axis=1).ravel())

    @classmethod
    def from_pyvista(cls, mesh: Any) -> Surface:
        """From a pyvista.DataSet in metres; polygons become triangles."""
        pyvista = need("pyvista", "from_pyvista()")
        if not isinstance(mesh, pyvista.PolyData):
            mesh = mesh.extract_surface()
        mesh = mesh.triangulate()
        return cls(np.asarray(mesh.points, dtype=np.float64), np.asarray(mesh.faces).reshape(-1, 4)[:, 1:])

    def _as_c(self) -> Any:
        self.__post_init__()
        raw = c.OmSurface(nvert=len(self.x), ntri=len(self.tri), x=self.x.ctypes.data, tri_vert=self.tri.ctypes.data)
        raw._keep = (self.x, self.tri)
        return raw

    @classmethod
    def _copy(cls, raw: Any) -> Surface:
        return cls(copied(raw.x, np.float64, (raw.nvert, 3)), copied(raw.tri_vert, np.int32, (raw.ntri, 3)))

    @classmethod
    def _take(cls, raw: Any) -> Surface:
        """Copy, and free the arrays of C."""
        try:
            return cls._copy(raw)
        finally:
            lib.om_surface_done(ctypes.byref(raw))


@dataclass
class TetMesh:
    """Linear tetrahedra: plain arrays, which may be changed and pickled; calls check and copy them.

    x: vertex positions, m (nvert x 3). tet: vertices, (b - a) x (c - a) . (d - a) > 0 (ntet x 4). label: material of each
    element (ntet). sets: named vertices, ascending; "attachment" is held by default.
    """

    x: np.ndarray
    tet: np.ndarray
    label: np.ndarray | None = None
    sets: dict[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.x = array_of(self.x, np.float64, (None, 3), "x")
        self.tet = array_of(self.tet, np.int32, (None, 4), "tet")
        if self.label is None:
            self.label = np.zeros(len(self.tet), dtype=np.int32)
        self.label = array_of(self.label, np.int32, (len(self.tet),), "label")
        self.sets = {name: np.unique(index_array(vert, name)) for name, vert in self.sets.items()}

    @classmethod
    def box(cls, size: Any, cells: Any, low: Any = (0, 0, 0)) -> TetMesh:
        """A box of `size` m (3) from the corner `low`, of `cells` (3) cells of six tetrahedra each."""
        raw, low = c.OmTetMesh(), np.asarray(low, dtype=float)
        nx, ny, nz = (int(n) for n in cells)
        lib.om_tet_mesh_box(vec3(low, "low"), vec3(low + np.asarray(size, float), "size"), nx, ny, nz, ctypes.byref(raw))
        return cls._take(raw)

    def joined(self, *others: TetMesh) -> TetMesh:
        """This mesh and others as one, of several bodies: vertices and elements in this order, sets of one name joined."""
        whole = self
        for other in others:
            raw = c.OmTetMesh()
            lib.om_tet_mesh_join(ctypes.byref(whole._as_c()), ctypes.byref(other._as_c()), ctypes.byref(raw))
            whole = TetMesh._take(raw)
        return whole

    @classmethod
    def load(cls, path: str | os.PathLike[str], unit: float = 0.0, space: str = "none", flip: bool = False,
             straighten: bool = False) -> TetMesh:
        """Read Gmsh .msh, VTK .vtk or .vtu. Arguments as of Surface.load; flip turns inverted elements around. Of tetrahedra
        of ten nodes the vertices are read; straighten: also where edges are curved."""
        raw, frame = c.OmTetMesh(), c.OmMeshFrame(unit=unit)
        frame.space = space
        flags = (c.OM_MESH_FLIP if flip else 0) | (c.OM_MESH_STRAIGHTEN if straighten else 0)
        lib.om_tet_mesh_load_frame(path_of(path), frame, flags, ctypes.byref(raw), None)
        return cls._take(raw)

    def save(self, path: str | os.PathLike[str], unit: float = 1.0) -> None:
        """Write .vtu, .vtk or .msh with labels and sets. unit: m per unit of the file."""
        lib.om_tet_mesh_save(ctypes.byref(self._as_c()), path_of(path), unit)

    @property
    def volume(self) -> float:
        """m^3."""
        return lib.om_tet_mesh_volume(ctypes.byref(self._as_c()))

    def validate(self) -> None:
        """Raise Invalid with the first wrong index, position or element."""
        lib.om_tet_mesh_validate(ctypes.byref(self._as_c()))

    def quality(self) -> c.OmMeshQuality:
        """Angles (rad), edges (m), parts and layers."""
        out = c.OmMeshQuality()
        lib.om_tet_mesh_quality(ctypes.byref(self._as_c()), ctypes.byref(out))
        return out

    def boundary(self) -> tuple[Surface, np.ndarray]:
        """The boundary, outward, and the mesh vertex of each of its vertices."""
        raw, vert = c.OmSurface(), ctypes.c_void_p()
        lib.om_tet_mesh_boundary(ctypes.byref(self._as_c()), ctypes.byref(raw), ctypes.byref(vert))
        try:
            number = raw.nvert
            return Surface._take(raw), copied(vert.value, np.int32, (number,))
        finally:
            lib.om_free(vert)

    def contact_surface(self, ntri: int = 1004) -> Surface:
        """The boundary as about `ntri` triangles of like size, for Press(surface=...)."""
        raw = c.OmSurface()
        lib.om_contact_surface_make(ctypes.byref(self._as_c()), ntri, ctypes.byref(raw))
        return Surface._take(raw)

    def welded(self, tolerance: float = 0.0) -> tuple[TetMesh, c.OmTetMeshWeld]:
        """Faces of the boundary that lie on each other joined, where a mesh is cracked, and how many: nvert, nface, first.

        tolerance: m; 0: 1e-6 of the diagonal of the box. Vertices that coincide elsewhere stay apart.
        """
        raw, report = c.OmTetMesh(), c.OmTetMeshWeld()
        lib.om_tet_mesh_copy(ctypes.byref(self._as_c()), ctypes.byref(raw))
        try:
            lib.om_tet_mesh_weld(ctypes.byref(raw), tolerance, ctypes.byref(report))
            return self._copy(raw), report
        finally:
            lib.om_tet_mesh_done(ctypes.byref(raw))

    def refined(self) -> TetMesh:
        """Every element replaced by eight."""
        raw = c.OmTetMesh()
        lib.om_tet_mesh_copy(ctypes.byref(self._as_c()), ctypes.byref(raw))
        try:
            lib.om_tet_mesh_refine(ctypes.byref(raw))
            return self._copy(raw)
        finally:
            lib.om_tet_mesh_done(ctypes.byref(raw))

    # ---- other libraries ----

    def plot(self, ax: Any = None, color: Any = _plot.FAT) -> Any:
        """Draw the boundary and the vertices of the set "attachment" with matplotlib; the axes are returned."""
        ax = self.boundary()[0].plot(ax, color)
        if len(attached := self.sets.get("attachment", ())):
            _plot.dots(ax, self.x[attached], "attachment", _plot.BLUE)
            ax.legend(loc="upper right")
        return ax

    def to_meshio(self) -> Any:
        """A meshio.Mesh: labels as cell data `tet_label`, sets as point data of 0 and 1."""
        meshio = need("meshio", "to_meshio()")
        marks = {name: np.isin(np.arange(len(self.x)), vert).astype(np.uint8) for name, vert in self.sets.items()}
        return meshio.Mesh(self.x, [("tetra", self.tet)], point_data=marks, cell_data={"tet_label": [np.asarray(self.label)]})

    @classmethod
    def from_meshio(cls, mesh: Any, unit: float = 1.0) -> TetMesh:
        """The tetrahedra of a meshio.Mesh; point data of bytes or booleans become sets. unit: m per unit."""
        blocks = [(i, b) for i, b in enumerate(mesh.cells) if b.type == "tetra"]
        if not blocks:
            raise ValueError("the mesh has no tetrahedra (cells of type 'tetra')")
        tet = np.concatenate([b.data for _, b in blocks])
        label = None
        if "tet_label" in mesh.cell_data:
            label = np.concatenate([mesh.cell_data["tet_label"][i] for i, _ in blocks])
        return cls(unit * np.asarray(mesh.points, float)[:, :3], tet, label, _marked(mesh.point_data))

    def to_pyvista(self) -> Any:
        """A pyvista.UnstructuredGrid with `tet_label` and the sets."""
        pyvista = need("pyvista", "to_pyvista()")
        grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: self.tet}, self.x)
        grid.cell_data["tet_label"] = np.asarray(self.label)
        for name, vert in self.sets.items():
            grid.point_data[name] = np.isin(np.arange(len(self.x)), vert).astype(np.uint8)
        return grid

    @classmethod
    def from_pyvista(cls, grid: Any, unit: float = 1.0) -> TetMesh:
        """The tetrahedra of a pyvista.UnstructuredGrid."""
        is_tet = np.asarray(grid.celltypes) == 10
        if not is_tet.any():
            raise ValueError("the grid has no tetrahedra")
        label = np.asarray(grid.cell_data["tet_label"])[is_tet] if "tet_label" in grid.cell_data else None
        return cls(unit * np.asarray(grid.points, float), grid.cells_dict[10], label, _marked(grid.point_data))

    # ---- C ----

    def _as_c(self) -> Any:
        """An OmTetMesh that borrows the arrays."""
        self.__post_init__()
        sets = (c.OmMeshSet * max(1, len(self.sets)))()
        for raw, (name, vert) in zip(sets, self.sets.items()):
            raw.name, raw.nvert, raw.vert = name, len(vert), vert.ctypes.data
        mesh = c.OmTetMesh(nvert=len(self.x), ntet=len(self.tet), nset=len(self.sets), x=self.x.ctypes.data,
                           tet_vert=self.tet.ctypes.data, tet_label=self.label.ctypes.data)  # type: ignore[union-attr]
        mesh.set = ctypes.cast(sets, ctypes.POINTER(c.OmMeshSet))
        mesh._keep = (self.x, self.tet, self.label, dict(self.sets), sets)
        return mesh

    @classmethod
    def _copy(cls, raw: Any) -> TetMesh:
        sets = {raw.set[i].name: copied(raw.set[i].vert, np.int32, (raw.set[i].nvert,)) for i in range(raw.nset)}
        return cls(copied(raw.x, np.float64, (raw.nvert, 3)), copied(raw.tet_vert, np.int32, (raw.ntet, 4)),
                   copied(raw.tet_label, np.int32, (raw.ntet,)), sets)

    @classmethod
    def _take(cls, raw: Any) -> TetMesh:
        """Copy, and free the arrays of C."""
        try:
            return cls._copy(raw)
        finally:
            lib.om_tet_mesh_done(ctypes.byref(raw))

    def __repr__(self) -> str:
        sets = ", ".join(f"{name} {len(vert)}" for name, vert in self.sets.items())
        return f"TetMesh({len(self.x)} vertices, {len(self.tet)} tetrahedra{'; ' + sets if sets else ''})"


def _marked(point_data: Any) -> dict[str, np.ndarray]:
    """Sets of vertices from point data that hold only 0 and 1."""
    sets = {}
    for name in point_data:
        values = np.asarray(point_data[name])
        if values.ndim == 1 and values.dtype in (np.uint8, np.bool_) and np.isin(values, (0, 1)).all():
            sets[str(name)] = np.flatnonzero(values)
    return sets
