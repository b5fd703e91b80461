"""Trained networks: U-Mesh (deformation of an organ), BA-Net (attachments), and their training data as NumPy."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _capi as c
from ._convert import array_of
from ._lib import (Busy, Handle, Owner, Progress, ProgressFunction, copied, create, data_path, forget_message, hdf5, lib, outcome, path_of,
                   refuse_fork, view, vec3)
from .mesh import Surface, TetMesh
from .patient import Patient


class UmeshNet(Owner):
    """A trained U-Mesh. x: positions of its nodes at rest, m (nnode x 3); is_surface: nodes of the free boundary.

        net = UmeshNet.load("weights.safetensors")
        u, trust = net.predict(mask, u)
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        refuse_fork("a network")
        self._handle = Handle(create(lib.om_umesh_net_load, path_of(path)), lib.om_umesh_net_destroy)
        grid = lib.om_umesh_net_grid(self._c).contents
        mesh = grid.fem.mesh
        self.x = view(self._handle, mesh.x, np.float64, (mesh.nnode, 3))
        self.hexahedra = view(self._handle, mesh.elem_node, np.int32, (mesh.nelem, 8))
        self.is_surface = view(self._handle, grid.is_surface, np.bool_, (mesh.nnode,))
        predictor = create(lib.om_umesh_predictor_create, self._c, 0)
        self._predictor = Handle(predictor, lib.om_umesh_predictor_destroy, self._handle)
        self._busy = Busy("UmeshNet")

    @classmethod
    def load(cls, path: str | os.PathLike[str] | None = None) -> UmeshNet:
        """Read a file of weights; None: the phantom's that comes along."""
        return cls(path if path is not None else data_path("weights/phantom.safetensors"))

    def patch(self, center: Any, size: Any = (0.05, 0.01, 0.01)) -> np.ndarray:
        """Nodes under a probe at the place of the organ's free surface that is nearest to `center`, m: a mask (nnode)."""
        grid = lib.om_umesh_net_grid(self._c)
        patch = lib.om_umesh_find_place(grid, vec3(center, "center"))
        patch.size = size
        mask = np.zeros(len(self.x), np.uint8)
        lib.om_umesh_patch_select(grid, ctypes.byref(patch), mask.ctypes.data)
        return mask.astype(bool)

    def predict(self, mask: Any, u: Any, tolerance: float = c.OM_UMESH_TOLERANCE,
                max_cycle: int = c.OM_UMESH_MAX_CYCLE) -> tuple[np.ndarray, c.OmUmeshTrust]:
        """Displacements of all nodes, m (nnode x 3) of float32, from those of the masked nodes; and how far the input is like
        the training data (is_inside, score, why).

        mask: (nnode). u: m (nnode x 3); only masked rows count. tolerance: m, max_cycle: of the relaxation towards
        equilibrium; 0 cycles: the network alone.
        """
        self._c
        refuse_fork("a network")
        mask = array_of(np.asarray(mask, dtype=bool), np.uint8, (len(self.x),), "mask")
        out = np.where(mask[:, None] > 0, array_of(u, np.float32, self.x.shape, "u"), np.float32(0))
        trust = c.OmUmeshTrust()
        with self._busy:
            lib.om_umesh_predictor_set_refinement(self._predictor.address, tolerance, max_cycle)
            lib.om_umesh_predict(self._predictor.address, mask.ctypes.data, out.ctypes.data, ctypes.byref(trust))
        return out, trust

    def fact(self, key: str) -> str | None:
        """A line of the file's metadata: "seed", "mean_error_mm", ..."""
        text = lib.om_umesh_net_fact(self._c, key.encode())
        return text.decode() if text is not None else None

    def close(self) -> None:
        """Give up the network."""
        super().close()
        self.__dict__.update(_predictor=None)


class BanetNet(Owner):
    """A trained BA-Net: probability that a vertex of a surface is attached, from displacements of its visible part.

        net = BanetNet.load()
        attached = net.attached(net.estimate(surface, u, seen))
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        refuse_fork("a network")
        self._handle = Handle(create(lib.om_banet_net_load, path_of(path)), lib.om_banet_net_destroy)

    @classmethod
    def load(cls, path: str | os.PathLike[str] | None = None) -> BanetNet:
        """Read a file of weights; None: those that come along."""
        return cls(path if path is not None else data_path("weights/banet.safetensors"))

    @property
    def threshold(self) -> float:
        """One threshold for all bodies, of intersections of views (thesis 4.4); `attached` fits it to each body."""
        return lib.om_banet_net_threshold(self._c)

    @staticmethod
    def attached(probability: Any) -> np.ndarray:
        """The set of greatest expected Dice coefficient, True where attached (nvert).

        probability: of the vertices that may be attached (nvert), as of estimate.
        """
        probability = array_of(probability, np.float64, (None,), "probability")
        threshold = ctypes.c_double()
        lib.om_banet_choose_threshold(len(probability), probability.ctypes.data, c.OM_BANET_NEARLY, ctypes.byref(threshold))
        return probability >= threshold.value

    @property
    def nparameter(self) -> int:
        """Number of weights."""
        return lib.om_banet_net_size(self._c)

    def estimate(self, surface: Surface, u: Any, seen: Any, side: float | None = None) -> np.ndarray:
        """Probability of attachment of each vertex of a closed surface at rest (nvert).

        u: measured displacement of the vertices, m (nvert x 3). seen: how well each was seen, 0 to 1 (nvert). side: of the
        grid, m; None: as the thickness of the body asks.
        """
        refuse_fork("a network")
        raw = surface._as_c()
        u = array_of(u, np.float64, surface.x.shape, "u")
        seen = array_of(seen, np.float64, (len(surface.x),), "seen")
        out = np.zeros(len(surface.x))
        side = lib.om_banet_default_side(ctypes.byref(raw)) if side is None else side
        lib.om_banet_estimate(self._c, side, ctypes.byref(raw), u.ctypes.data, seen.ctypes.data, out.ctypes.data)
        return out

    def fact(self, key: str) -> str | None:
        """A line of the file's metadata: "command", "seed", "validation_dsc", ..."""
        text = lib.om_banet_net_fact(self._c, key.encode())
        return text.decode() if text is not None else None


# ---- training data ------------------------------------------------------------------------------------


@dataclass
class BanetSample:
    """A random body, pulled to its equilibrium, and what a camera knows of it. Arrays of the surface's vertices.

    mesh: before the pull. surface: its boundary. attached, grasped: truth. u: displacement as measured, m (nvert x 3), 0 where
    not seen. seen: how well, 0 to 1. x: equilibrium of the mesh, m. summary: the other fields of OmBanetSample.
    """

    mesh: TetMesh
    surface: Surface
    attached: np.ndarray
    grasped: np.ndarray
    u: np.ndarray
    seen: np.ndarray
    x: np.ndarray
    summary: dict[str, Any]


def make_banet_sample(index: int, seed: int, strict: bool = True, **fields: Any) -> BanetSample | None:
    """Sample `index` of a seed; fields of OmBanetSampleDef, such as way="exact". It depends on these arguments alone."""
    definition, raw = lib.om_banet_sample_default_def(seed), c.OmBanetSample()
    definition.assign(fields)
    forget_message()
    status = lib.om_banet_sample_make(ctypes.byref(definition), index, ctypes.byref(raw))
    if status > 0:
        return outcome(status, None, strict)
    n = raw.surface.nvert
    try:
        return BanetSample(TetMesh._copy(raw.mesh), Surface._copy(raw.surface), copied(raw.attached, np.bool_, (n,)),
                           copied(raw.grasped, np.bool_, (n,)), copied(raw.u, np.float64, (n, 3)), copied(raw.seen, np.float64, (n,)),
                           copied(raw.x, np.float64, (raw.mesh.nvert, 3)),
                           {k: v for k, v in raw.as_dict().items() if k not in ("mesh", "surface")})
    finally:
        lib.om_banet_sample_done(ctypes.byref(raw))


class BanetData(Owner):
    """A data set of BA-Net: len(data) samples; data[i] is (input, target, weight) as the network reads them.

    summary: OmBanetSummary of `generate`, else empty. input: (5, nz, ny, nx) of float32: signed distance and displacement in voxels, seen. target: 1 at attached cells; weight: 1 at
    cells that enter the loss; (nz, ny, nx).
    """

    def __init__(self, folder: str | os.PathLike[str], max_sample: int = 0) -> None:
        """folder: as `omentum banet generate` writes it. max_sample: 0: all."""
        raw = c.OmBanetData()
        self.summary: dict[str, Any] = {}
        with hdf5:
            lib.om_banet_data_load(path_of(folder), max_sample, ctypes.byref(raw))
        self._handle = Handle(raw, lambda data: lib.om_banet_data_done(ctypes.byref(data)))

    @classmethod
    def generate(cls, folder: str | os.PathLike[str], nsample: int, seed: int, sample: dict[str, Any] | None = None,
                 progress: bool | ProgressFunction | None = None, **fields: Any) -> BanetData:
        """Make the missing samples of a data set in a folder, as `omentum banet generate`, and read it.

        sample: fields of OmBanetSampleDef, such as {"way": "exact"}. fields of OmBanetDataDef: shard, npicture, nworker, ...
        """
        place, summary = path_of(folder), c.OmBanetSummary()
        definition = lib.om_banet_data_default_def(seed, place)  # borrows `place`
        definition.nsample = nsample
        definition.assign({**fields, "sample": sample or {}})
        with hdf5, Progress(progress) as listener:
            lib.om_banet_generate(ctypes.byref(definition), listener.pointer, ctypes.byref(summary))
        data = cls(folder)
        data.summary = summary.as_dict()
        return data

    def __len__(self) -> int:
        return self._c.nsample

    def __getitem__(self, i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.cells(i)

    def cells(self, i: int, dim: Any = None, symmetry: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As data[i], in a grid of `dim` cells (nx, ny, nz; None: the sample's own), turned by one of 16 symmetries."""
        if not 0 <= i < len(self):
            raise IndexError(f"sample {i} of {len(self)}")
        cells = self._c.sample[i]
        size = (ctypes.c_int * 3)(*(int(n) for n in (cells.grid.dim if dim is None else dim)))
        shape = tuple(size)[::-1]
        value, target, weight = (np.zeros(s, np.float32) for s in ((c.OM_BANET_NCHANNEL, *shape), shape, shape))
        lib.om_banet_cells_expand(ctypes.byref(cells), size, None, symmetry, value.ctypes.data, target.ctypes.data, weight.ctypes.data)
        return value, target, weight

    def facts(self, i: int) -> dict[str, Any]:
        """How sample i was drawn and solved: OmBanetFacts."""
        if not 0 <= i < len(self):
            raise IndexError(f"sample {i} of {len(self)}")
        return self._c.sample[i].fact.as_dict()


class UmeshData(Owner):
    """A data set of U-Mesh. mask: nodes of the patch (nsample x nnode); u: displacements, m (nsample x nnode x 3); x: nodes at
    rest, m (nnode x 3): views. summary: OmUmeshSummary of `generate`, else empty."""

    def __init__(self, folder: str | os.PathLike[str], max_sample: int = 0) -> None:
        """folder: as `omentum umesh generate` writes it. max_sample: 0: all."""
        raw = c.OmUmeshData()
        self.summary: dict[str, Any] = {}
        with hdf5:
            lib.om_umesh_data_load(path_of(folder), max_sample, ctypes.byref(raw))
        self._handle = Handle(raw, lambda data: lib.om_umesh_data_done(ctypes.byref(data)))
        n, nnode = raw.nsample, raw.grid.fem.mesh.nnode
        self.x = view(self._handle, raw.grid.fem.mesh.x, np.float64, (nnode, 3))
        self.mask = view(self._handle, raw.mask, np.bool_, (n, nnode))
        self.u = view(self._handle, raw.u, np.float32, (n, nnode, 3))

    @classmethod
    def generate(cls, folder: str | os.PathLike[str], nsample: int, seed: int = 1, organ: Patient | Surface | None = None, nelem: int = 2174,
                 progress: bool | ProgressFunction | None = None, **fields: Any) -> UmeshData:
        """Make the missing samples of a data set in a folder, as `omentum umesh generate`, and read it.

        organ: a patient of one material or a closed surface; None: the phantom. nelem: elements of its grid. fields of
        OmUmeshDataDef: max_force (N), press_share, shard, npicture, nworker, ...
        """
        shape = lib.om_umesh_organ_default_def()
        shape.nelem = nelem
        raw = organ._as_c() if isinstance(organ, Surface) else None
        if raw is not None:
            shape.surface = ctypes.pointer(raw)
        elif isinstance(organ, Patient):
            shape.patient = ctypes.pointer(organ._handle.address)
        made = Handle(create(lib.om_umesh_organ_create, ctypes.byref(shape)), lib.om_umesh_organ_destroy)
        place, summary = path_of(folder), c.OmUmeshSummary()
        definition = lib.om_umesh_data_default_def(made.address, place)  # borrows `place`
        definition.nsample, definition.seed = nsample, seed
        definition.assign(fields)
        with hdf5, Progress(progress) as listener:
            lib.om_umesh_generate(ctypes.byref(definition), listener.pointer, ctypes.byref(summary))
        data = cls(folder)
        data.summary = summary.as_dict()
        return data

    def __len__(self) -> int:
        return self._c.nsample
