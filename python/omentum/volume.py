"""Volumes (CT, MR, label maps) and pictures."""
from __future__ import annotations

import contextlib
import ctypes
import os
from collections.abc import Iterator
from typing import Any

import numpy as np

from . import _capi as c
from . import plot as _plot
from ._convert import meters_per, need, quantity
from ._lib import Handle, lib, path_of, view, warn_user

_TYPES = {
    c.OmVoxelType.U8: np.uint8, c.OmVoxelType.I8: np.int8, c.OmVoxelType.U16: np.uint16, c.OmVoxelType.I16: np.int16,
    c.OmVoxelType.U32: np.uint32, c.OmVoxelType.I32: np.int32, c.OmVoxelType.U64: np.uint64, c.OmVoxelType.I64: np.int64,
    c.OmVoxelType.F32: np.float32, c.OmVoxelType.F64: np.float64,
}


_MOST = 0.1  # m; no scanner has voxels with such a side: the numbers are millimetres


def _sides(spacing: Any) -> np.ndarray:
    """Sides of a voxel from one number or one for each axis; "0.8 mm" is 0.0008."""
    words = [spacing] if isinstance(spacing, str) or np.ndim(spacing) == 0 else list(spacing)
    sides = np.array([quantity(side, "length", "spacing") for side in words], dtype=float)
    if len(sides) not in (1, 3) or not (np.isfinite(sides).all() and (sides > 0).all()):
        raise ValueError(f"spacing={spacing!r}: one number above 0, or three, for x, y and z, are needed; affine= places turned axes")
    return np.broadcast_to(sides, 3)


def _odd(three: Any) -> int:
    """The axis that differs where the other two are equal; -1: none."""
    return next((k for k in range(3) if three[k - 1] == three[k - 2] != three[k]), -1)


def _look_at_axes(shape: tuple[int, ...], sides: np.ndarray) -> None:
    """Warn where the slices' distance and the number of slices lie on different axes: the array's axes are z, y, x."""
    number, distance = _odd(shape), _odd(sides)
    if -1 < number != distance > -1:
        warn_user(f"axis {number} of the array differs from the other two, and so does spacing {distance}: axes are x, y, z. Arrays of SimpleITK and of "
                  "Slicer's arrayFromVolume are z, y, x: give values.transpose(2, 1, 0)")


class Volume:
    """A scalar volume: `values[i, j, k]` (nx, ny, nz) and `affine` (4 x 4), which maps (i, j, k, 1) to RAS metres.

    The axes are those of nibabel, in metres instead of millimetres: `Volume(image.get_fdata(), affine=image.affine, unit="mm")`.
    Volumes can be pickled.
    """

    def __init__(self, values: Any, spacing: Any = None, affine: Any = None, unit: str = "m") -> None:
        """
        values: (nx, ny, nz) of any integer or floating type; booleans become bytes.
        spacing: one number or one for each axis; the centre of voxel (0, 0, 0) is the origin.
        affine: (4 x 4) in place of `spacing`.
        unit: of spacing or affine: "m", "cm", "mm" or "um". Voxels with a side above 0.1 m are refused.
        """
        values = np.asarray(values)
        if values.ndim != 3:
            one = ": choose one volume, such as values[..., 0]" if values.ndim > 3 else ""
            raise ValueError(f"a volume has three axes, not {values.ndim}{one}")
        if (spacing is None) == (affine is None):
            raise ValueError("give either spacing or affine, in metres")
        if values.dtype == np.bool_:
            values = values.astype(np.uint8)
        if values.dtype == np.float16:
            values = values.astype(np.float32)
        if affine is None:
            sides = _sides(spacing)
            _look_at_axes(values.shape, sides)
            affine = np.diag([*sides, 1.0])
        self.values = values
        self.affine = np.array(affine, dtype=np.float64)
        if self.affine.shape != (4, 4):
            raise ValueError(f"affine has shape {self.affine.shape}: 4 x 4 is needed")
        self.affine[:3] *= meters_per(unit)
        if unit == "m" and self.spacing.max() > _MOST:
            raise ValueError(f"voxels of {self.spacing.max():g} m: spacing and affine are in metres, 2 mm is 0.002; "
                             'for millimetres add unit="mm"')
        self._type()

    def _type(self) -> c.OmVoxelType:
        for kind, dtype in _TYPES.items():
            if self.values.dtype == dtype:
                return kind
        raise ValueError(f"voxels of type {self.values.dtype} are not known; convert them: values.astype(numpy.int32), or float")

    @classmethod
    def load(cls, path: str | os.PathLike[str], entry: int = -1, max_bytes: int = c.OM_VOLUME_MAX_SIZE) -> Volume:
        """Read NIfTI (.nii, .nii.gz, .hdr) or NRRD (.nrrd, .nhdr), or a folder with a DICOM series where dcm2niix is installed.

        entry: which volume of a file of several, from 0; -1: the only one.
        max_bytes: a larger volume is refused from its header.
        The voxels are a view of the memory that the reader filled, in the type of the file, where its scale is 1.
        """
        raw = c.OmVolume()
        with without_dicom(path) as file:
            lib.om_volume_load_within(file, entry, max_bytes, ctypes.byref(raw))
        return cls._take(raw)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write NRRD (.nrrd): bytes, 16-bit integers, or floats, which become 32-bit."""
        kind = self._type()
        kind = c.OmVoxelType.F32 if kind == c.OmVoxelType.F64 else kind
        lib.om_volume_save(ctypes.byref(self._as_c()), int(kind), path_of(path))

    @classmethod
    def _take(cls, raw: Any) -> Volume:
        """A volume of C; its voxels are freed with the last view."""
        handle = Handle(raw, lambda volume: lib.om_volume_done(ctypes.byref(volume)))
        shape = tuple(int(n) for n in raw.grid.dim)
        values = view(handle, raw.voxel, _TYPES[raw.type], shape[::-1], writable=True).T
        if (raw.slope, raw.inter) != (1.0, 0.0):
            values = raw.slope * values + raw.inter
        affine = np.eye(4)
        affine[:3, :3], affine[:3, 3] = raw.grid.axis, raw.grid.origin
        volume = cls.__new__(cls)  # a file states its own unit
        volume.values, volume.affine = values, affine
        return volume

    def _as_c(self) -> Any:
        """An OmVolume that borrows the voxels."""
        kind = self._type()
        voxels = np.asfortranarray(self.values)
        raw = c.OmVolume(type=int(kind), voxel=voxels.ctypes.data, slope=1.0, inter=0.0)
        raw.grid.dim = voxels.shape
        raw.grid.axis, raw.grid.origin = self.affine[:3, :3], self.affine[:3, 3]
        raw._keep = voxels
        return raw

    @property
    def spacing(self) -> np.ndarray:
        """Sides of a voxel, m (3)."""
        return np.linalg.norm(self.affine[:3, :3], axis=0)

    def plot(self, axis: int = 2, index: int | None = None, ax: Any = None) -> Any:
        """Draw a slice with matplotlib, the one in the middle unless `index` says another; the axes are returned."""
        if axis not in (0, 1, 2):
            raise ValueError(f"axis {axis}: 0, 1 or 2")
        number = self.values.shape[axis]
        index = number // 2 if index is None else index
        if not 0 <= index < number:
            raise IndexError(f"slice {index} of {number}")
        across, along = [k for k in range(3) if k != axis]
        side = 1e3 * self.spacing
        ax = _plot.axes_2d(ax, f"{'ijk'[across]}, mm", f"{'ijk'[along]}, mm")
        extent = (0, side[across] * self.values.shape[across], 0, side[along] * self.values.shape[along])
        ax.imshow(np.take(self.values, index, axis).T, cmap="gray", origin="lower", extent=extent)
        ax.set_title(f"{'ijk'[axis]} = {index} of {number}")
        return ax

    def to_pyvista(self) -> Any:
        """A pyvista.ImageData, m, with `values` at its points; a pyvista.StructuredGrid where the axes are turned."""
        pyvista = need("pyvista", "to_pyvista()")
        sides = np.diag(self.affine[:3, :3])
        if np.array_equal(self.affine[:3, :3], np.diag(sides)) and (sides > 0).all():
            grid = pyvista.ImageData(dimensions=self.values.shape, spacing=tuple(sides), origin=tuple(self.affine[:3, 3]))
        else:
            at = np.stack(np.meshgrid(*map(np.arange, self.values.shape), indexing="ij"), axis=-1) @ self.affine[:3, :3].T + self.affine[:3, 3]
            grid = pyvista.StructuredGrid(*np.moveaxis(at, -1, 0))
        grid.point_data["values"] = self.values.ravel(order="F")
        return grid

    def labels(self) -> dict[int, int]:
        """Labels above 0 and their number of voxels."""
        found, count = np.unique(self.values, return_counts=True)
        return {int(v): int(n) for v, n in zip(found, count) if v > 0}

    def __repr__(self) -> str:
        side = ", ".join(f"{1e3 * s:.3g}" for s in self.spacing)
        return f"Volume({'x'.join(map(str, self.values.shape))} {self.values.dtype}, voxels of ({side}) mm)"


@contextlib.contextmanager
def without_dicom(path: str | os.PathLike[str]) -> Iterator[bytes]:
    """The path of a file; of a DICOM series that of a volume in a temporary folder, which dcm2niix writes."""
    given = path_of(path)
    if not lib.om_dicom_is_there(given):
        yield given
        return
    series = c.OmDicomSeries()
    lib.om_dicom_convert(given, c.OmDicomSay(), None, ctypes.byref(series))
    try:
        yield series.path.encode() if isinstance(series.path, str) else series.path
    finally:
        lib.om_dicom_done(ctypes.byref(series))


def picture_array(picture: Any) -> np.ndarray:
    """A copy of an OmPicture: (height, width, channels) of bytes; (0, 0, 0) if it is empty."""
    shape = (picture.height, picture.width, picture.nchannel)
    return view(None, picture.pixel, np.uint8, shape).copy()


def picture_as_c(picture: Any) -> Any:
    """An OmPicture that borrows the pixels."""
    pixels = np.ascontiguousarray(picture)
    if pixels.dtype != np.uint8 or pixels.ndim not in (2, 3):
        raise ValueError("a picture is an array of bytes (height, width, channels)")
    pixels = pixels.reshape(*pixels.shape[:2], -1)
    raw = c.OmPicture(width=pixels.shape[1], height=pixels.shape[0], nchannel=pixels.shape[2], pixel=pixels.ctypes.data)
    raw._keep = pixels
    return raw


def save_png(path: str | os.PathLike[str], picture: Any) -> None:
    """Write a picture (height, width) or (height, width, 1, 3 or 4) of bytes as PNG."""
    lib.om_picture_save_png(ctypes.byref(picture_as_c(picture)), path_of(path))


def load_png(path: str | os.PathLike[str]) -> np.ndarray:
    """Read a PNG as (height, width, 3) of bytes."""
    raw = c.OmPicture()
    lib.om_picture_load_png(path_of(path), ctypes.byref(raw))
    try:
        return picture_array(raw)
    finally:
        lib.om_picture_done(ctypes.byref(raw))
