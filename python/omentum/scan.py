"""Measured surfaces: scans from the pictures of a depth camera, and from points."""
from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from . import _capi as c
from . import plot as _plot
from ._convert import array_of, length, need
from ._lib import Handle, Owner, lib, pose, view, warn_user
from .scene import Site
from .world import Observation, World


class Scan(Owner):
    """The part of the tissue's surface that a camera sees. x: m (npoint x 3); normal: unit, towards the camera, zero: not
    known (npoint x 3); tri: triangles (ntri x 3); pixel: OmScanPixel of each pixel, or None. Views.
    """

    def __init__(self, x: Any, normal: Any = None, tri: Any = None, camera: c.OmCamera | None = None, noise: float = 0.0) -> None:
        """camera: of the picture; noise: m, standard deviation of a point along its ray, 0: not known."""
        x = array_of(x, np.float64, (None, 3), "x")
        tri = array_of(np.zeros((0, 3)) if tri is None else tri, np.int32, (None, 3), "tri")
        raw = c.OmScan()
        lib.om_scan_init(len(x), len(tri), ctypes.byref(raw))
        self._own(raw)
        self.x[...] = x
        if normal is not None:
            self.normal[...] = array_of(normal, np.float64, x.shape, "normal")
        self.tri[...] = tri
        raw.noise = noise
        if camera is not None:
            raw.has_camera = True
            ctypes.memmove(ctypes.byref(raw.camera), ctypes.byref(camera), ctypes.sizeof(c.OmCamera))
        lib.om_scan_check(ctypes.byref(raw))

    def _own(self, raw: Any) -> None:
        self._handle = Handle(raw, lambda scan: lib.om_scan_done(ctypes.byref(scan)))

    @classmethod
    def from_observation(cls, observation: Observation, site: Site, world: World | None = None, **fields: Any) -> Scan:
        """The tissue in the depth picture of an observation, and its colour where it has one.

        site: the robot's own. world: whose kinematics show the tools; None: no tools are known. fields of OmScanDef, and
        of OmCloudDef.
        """
        definition = lib.om_scan_default_def(lib.om_site_spacing(ctypes.byref(site._c)))
        space = lib.om_cloud_default_def(world._c if world is not None else None, ctypes.byref(site._c))
        in_space = {name: fields.pop(name) for name in ("clearance", "tool_margin", "reach") if name in fields}
        definition.assign(fields, also=("clearance", "tool_margin", "reach"))
        space.assign(in_space)
        raw, picture = c.OmScan(), c.OmObservation()
        try:
            observation._write(picture)
            lib.om_scan_from_observation(ctypes.byref(definition), ctypes.byref(space), ctypes.byref(picture), ctypes.byref(raw))
        finally:
            lib.om_observation_done(ctypes.byref(picture))
        scan = cls.__new__(cls)
        scan._own(raw)
        return scan

    @classmethod
    def from_depth(cls, depth: Any, camera: c.OmCamera, mask: Any = None, box: Any = None, spacing: float | str = 0.003,
                   time: float = 0.0, **fields: Any) -> Scan:
        """The tissue in a depth picture of any depth camera. Every pixel with a depth is taken for tissue, so leave out what is
        none by `mask` or `box`; Scan.from_observation knows tools, board and organ, and tells tissue by its colour.

        depth: (height x width), m along the camera's z; 0, NaN: no depth.
        mask: (height x width), true where the picture shows tissue; None: everywhere.
        box: ((x, y, z), (x, y, z)), the corners of the space in which tissue can be, m; None: everywhere.
        spacing: m, mean distance of neighbouring points. fields: others of OmScanDef, such as max_jump, min_area, noise_a.
        """
        shape = (camera.height, camera.width)
        depth = np.array(array_of(depth, np.float32, shape, "depth"))
        if mask is not None:
            depth[~array_of(mask, np.bool_, shape, "mask")] = 0
        largest = depth[np.isfinite(depth)].max(initial=0)
        if largest > 20:
            raise ValueError(f"depth: {largest:g} m is the largest; depths are in metres, 250 mm is 0.25")
        low, high = ((-1e3,) * 3, (1e3,) * 3) if box is None else box
        definition = lib.om_scan_default_def(length(spacing, "spacing"))
        definition.use_color = False
        definition.assign(fields)
        if largest <= 0:
            warn_user("depth: no pixel has one (0 and NaN are none), so the scan is empty; does the mask show the tissue?")
        field, picture, raw = c.OmScanField(), c.OmDepthPicture(), c.OmScan()
        field.pose_task_world = pose(np.eye(4))
        field.lo, field.hi = low, high
        picture.time, picture.depth = time, depth.ctypes.data
        ctypes.memmove(ctypes.byref(picture.camera), ctypes.byref(camera), ctypes.sizeof(c.OmCamera))
        lib.om_scan_from_picture(ctypes.byref(definition), ctypes.byref(field), ctypes.byref(picture), ctypes.byref(raw))
        scan = cls.__new__(cls)
        scan._own(raw)
        return scan

    def plot(self, ax: Any = None) -> Any:
        """Draw its triangles, or its points where it has none, with matplotlib; the axes are returned."""
        self._c  # noqa: B018 - a closed one draws nothing
        ax = _plot.axes_3d(ax)
        if len(self.tri):
            _plot.triangles(ax, self.x, self.tri)
        else:
            _plot.dots(ax, self.x, "points", _plot.FLESH)
        _plot.fit(ax, 1e3 * self.x)
        return ax

    def to_pyvista(self) -> Any:
        """A pyvista.PolyData, m, with `normal` at its points."""
        self._c  # noqa: B018 - a closed one draws nothing
        pyvista = need("pyvista", "to_pyvista()")
        poly = pyvista.PolyData(self.x.copy(), np.insert(self.tri, 0, 3, axis=1).ravel()) if len(self.tri) else pyvista.PolyData(self.x.copy())
        poly.point_data["normal"] = self.normal.copy()
        return poly

    @property
    def x(self) -> np.ndarray:
        """Points, m (npoint x 3)."""
        return view(self._handle, self._c.x, np.float64, (self._c.npoint, 3), True)

    @property
    def normal(self) -> np.ndarray:
        """Unit normals, zero: not known (npoint x 3)."""
        return view(self._handle, self._c.normal, np.float64, (self._c.npoint, 3), True)

    @property
    def tri(self) -> np.ndarray:
        """Triangles (ntri x 3)."""
        return view(self._handle, self._c.tri_vert, np.int32, (self._c.ntri, 3), True)

    @property
    def pixel(self) -> np.ndarray | None:
        """What each pixel shows (height x width): OmScanPixel."""
        raw = self._c
        return view(self._handle, raw.pixel, np.uint8, (raw.camera.height, raw.camera.width)) if raw.pixel else None
