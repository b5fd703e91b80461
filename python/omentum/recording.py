"""Recordings: runs over time as VTKHDF files, written by the library, read with h5py as NumPy, or as PyVista objects."""
from __future__ import annotations

import ctypes
import os
from typing import Any, Iterator

import numpy as np

from . import _capi as c
from . import plot as _plot
from ._convert import array_of, need
from ._lib import FileFailed, Handle, Invalid, Owner, create, hdf5, lib, path_of
from .mesh import TetMesh
from .tissue import Tissue


class Recorder(Owner):
    """Writes positions of a mesh, and arrays, over time; ParaView opens the file (.vtkhdf) as a time series.

        with Recorder("lift.vtkhdf", tissue.mesh, cell={"von_mises": 1}) as recorder:
            recorder.add(tissue.time, tissue.x, von_mises=tissue.measure())

    The file appears at the end of the `with` block, or by end(); after an exception nothing is left. In place of the mesh
    a Tissue may be given: of element="quadratic" the recording then has tetrahedra of ten nodes, not eight linear ones for
    each, and of the values of these eight, as Tissue.measure() has them, the mean.
    """

    def __init__(self, path: str | os.PathLike[str], mesh: TetMesh | Tissue, point: dict[str, int] | None = None,
                 cell: dict[str, int] | None = None) -> None:
        """point, cell: names and numbers of components of arrays on vertices and on elements that each step brings."""
        ten = None
        if isinstance(mesh, Tissue):
            ten, mesh = mesh._make_tet10(), mesh.mesh
        ncell = ten.nelem if ten else len(mesh.tet)
        self._cells = set(cell or {}) if ten else set()  # of eight parts each
        self._shapes = {name: (len(mesh.x), n) for name, n in (point or {}).items()}
        self._shapes.update({name: (ncell, n) for name, n in (cell or {}).items()})
        arrays = (c.OmMeshArray * max(1, len(self._shapes)))()
        for raw, (name, shape) in zip(arrays, self._shapes.items()):
            raw.name, raw.ncomp, raw.is_cell = name.encode(), shape[1], name in (cell or {})
            raw.type = int(c.OmArrayType.DOUBLE)
        self._nvert = len(mesh.x)
        try:
            with hdf5:
                if ten:
                    both = c.OmRecordingArrays(array=arrays, narray=len(self._shapes))
                    address = create(lib.om_recording_begin_tet10, path_of(path), ctypes.byref(ten), b"mesh", None, 0,
                                     ctypes.byref(both))
                else:
                    address = create(lib.om_recording_begin, path_of(path), ctypes.byref(mesh._as_c()), arrays,
                                     len(self._shapes))
        finally:
            if ten:
                lib.om_tet10_mesh_done(ctypes.byref(ten))
        self._handle = Handle(address, lib.om_recording_abort)

    def add(self, time: float, x: Any, **values: Any) -> None:
        """Append a step: time (s) above the last one, positions, m (nvert x 3), and every array."""
        if set(values) != set(self._shapes):
            raise ValueError(f"a step brings the arrays {sorted(self._shapes)}, not {sorted(values)}")
        x = array_of(x, np.float64, (self._nvert, 3), "x")
        for name in self._cells:
            n, ncomp = self._shapes[name]
            if np.size(values[name]) == 8 * n * ncomp:
                values[name] = np.reshape(values[name], (n, 8, ncomp)).mean(axis=1)
        arrays = [array_of(np.reshape(values[n], (-1, shape[1])), np.float64, shape, n) for n, shape in self._shapes.items()]
        pointers = (ctypes.c_void_p * max(1, len(arrays)))(*(a.ctypes.data for a in arrays))
        with hdf5:
            lib.om_recording_add_step(self._c, time, x.ctypes.data, pointers)

    def end(self) -> None:
        """Finish the file; the recorder is closed."""
        handle, address = self._handle, self._c
        handle.address, self._handle = None, None  # type: ignore[union-attr]
        with hdf5:
            lib.om_recording_end(address)

    def __exit__(self, kind: Any, *_: Any) -> None:
        if kind is None and not self.is_closed:
            self.end()
        self.close()


class Recording:
    """A recording as NumPy arrays; needs h5py.

    times: s (nstep). recording.x(i): positions at step i, m (nvert x 3). recording.array("von_mises", i): an array of
    the file. recording.to_pyvista(i): a pyvista.UnstructuredGrid.
    """

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Recording:
        """The recording of a file, or of the folder of a run."""
        return cls(path)

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """path: a file .vtkhdf, or the folder of a run, which has run.vtkhdf."""
        if os.path.isdir(path):
            path = os.path.join(path, "run.vtkhdf")
        if not os.path.isfile(path):
            raise FileNotFoundError(f"{os.fspath(path)}: no such recording; Recorder writes one, and so does omentum retract -o DIR: DIR/run.vtkhdf")
        h5py = need("h5py", "Recording")
        try:
            self._file = h5py.File(path, "r")
        except OSError as error:
            raise FileFailed(f"{os.fspath(path)}: not a recording (HDF5 says: {error})") from None
        if "VTKHDF/Steps" not in self._file:
            self._file.close()
            raise Invalid(f"{os.fspath(path)}: HDF5, but not a recording of Recorder or of a run: it has no VTKHDF/Steps")
        self._root = self._file["VTKHDF"]
        steps = self._root["Steps"]
        self.times: np.ndarray = steps["Values"][()]
        self.nvert = int(self._root["NumberOfPoints"][0])
        self.ncell = int(self._root["NumberOfCells"][0])
        self.point_names = sorted(self._root["PointData"]) if "PointData" in self._root else []
        self.cell_names = sorted(self._root["CellData"]) if "CellData" in self._root else []

    def __len__(self) -> int:
        return len(self.times)

    def _step(self, i: int) -> int:
        if not -len(self) <= i < len(self):
            raise IndexError(f"step {i} of {len(self)}")
        return i % len(self)

    def x(self, i: int) -> np.ndarray:
        """Positions at step i, m (nvert x 3)."""
        at = int(self._root["Steps/PointOffsets"][self._step(i)])
        return self._root["Points"][at:at + self.nvert]

    def array(self, name: str, i: int) -> np.ndarray:
        """An array of vertices or cells at step i."""
        kind, n = ("PointData", self.nvert) if name in self.point_names else ("CellData", self.ncell)
        if name not in self.point_names + self.cell_names:
            raise KeyError(f"the recording has no array {name!r}: it has {self.point_names + self.cell_names}")
        offsets = self._root[f"Steps/{kind}Offsets"]
        at = int(offsets[name][self._step(i)]) if name in offsets else 0
        return self._root[kind][name][at:at + n]

    @property
    def cells(self) -> list[np.ndarray]:
        """Nodes of each cell: 4 or 10 of a tetrahedron, 3 of a triangle."""
        ends = self._root["Offsets"][()]
        return np.split(self._root["Connectivity"][()][:ends[self.ncell]], ends[1:self.ncell])

    def to_pyvista(self, i: int) -> Any:
        """Step i as a pyvista.UnstructuredGrid."""
        pyvista = need("pyvista", "to_pyvista()")
        cells = np.concatenate([np.insert(cell, 0, len(cell)) for cell in self.cells])
        grid = pyvista.UnstructuredGrid(cells, self._root["Types"][:self.ncell], self.x(i))
        for name in self.point_names:
            grid.point_data[name] = self.array(name, i)
        for name in self.cell_names:
            grid.cell_data[name] = self.array(name, i)
        return grid

    def plot(self, name: str | None = None, step: int | None = None, ax: Any = None) -> Any:
        """Draw it with matplotlib; the axes are returned. Over time: the largest displacement since the first step, or the least, the
        mean and the largest value of an array (of vectors: of their norms). With `step`: the shape there, coloured by the array."""
        if step is not None:
            return self._plot_shape(name, step, ax)
        if name is None:
            first = self.x(0)
            far = [1e3 * np.linalg.norm(self.x(i) - first, axis=1).max(initial=0) for i in range(len(self))]
            ax = _plot.axes_2d(ax, "time, s", "largest displacement, mm")
            ax.plot(self.times, far)
            return ax
        ax = _plot.axes_2d(ax, "time, s", name)
        values = [self._numbers(name, i) for i in range(len(self))]
        for label, of in (("largest", np.max), ("mean", np.mean), ("least", np.min)):
            ax.plot(self.times, [of(v) for v in values], label=label)
        ax.legend()
        return ax

    def _numbers(self, name: str, i: int) -> np.ndarray:
        """An array as one number a row."""
        values = np.asarray(self.array(name, i), float)
        return values if values.ndim == 1 else values[:, 0] if values.shape[1] == 1 else np.linalg.norm(values, axis=1)

    def _plot_shape(self, name: str | None, step: int, ax: Any) -> Any:
        x, cells = self.x(step), self.cells
        values = None if name is None else self._numbers(name, step)
        if len(cells[0]) == 3:
            surface, vert, tri = None, np.arange(len(x)), np.array(cells)
            painted = None if values is None else values if name in self.cell_names else values[tri].mean(axis=1)
        else:
            mesh = TetMesh(x, np.array([cell[:4] for cell in cells]))
            surface, vert = mesh.boundary()
            tri = surface.tri
            painted = None if values is None else _plot.of_triangles(mesh, vert, tri, values) if name in self.cell_names else values[vert][tri].mean(axis=1)
        ax = _plot.axes_3d(ax)
        _plot.triangles(ax, x[vert], tri, values=painted, name=name)
        _plot.fit(ax, 1e3 * x[vert])
        ax.set_title(f"{self.times[step]:.3g} s")
        return ax

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __iter__(self) -> Iterator[tuple[float, np.ndarray]]:
        for i, time in enumerate(self.times):
            yield float(time), self.x(i)
