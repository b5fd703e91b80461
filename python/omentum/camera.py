"""Cameras: shaded pictures, depth with noise, point clouds, visibility, by ray casting."""
from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from . import _capi as c
from ._convert import array_of, find_enum, index_array, length
from ._lib import Busy, Handle, Owner, create, lib, pose as pose_of, pose_matrix, refuse_fork, vec3
from .mesh import Surface


_DISTORTION = ("k1", "k2", "p1", "p2", "k3")


class Camera(c.OmCamera):
    """A camera: z forward, x right, y down in its frame. Fields of OmCamera; `lens` is that of OpenCV plus half a pixel.

        Camera(fx=600, fy=600, cx=320, cy=240, width=640, height=480, pose=pose_world_camera)    # of a calibration
        Camera(eye, target, up)                                                                  # that looks at something
    """

    def __init__(self, eye: Any = None, target: Any = None, up: Any = (0, 0, 1), *, pose: Any = None, pose_world_camera: Any = None,
                 width: int | None = None, height: int | None = None, fov: float = np.pi / 3, fx: float | None = None, fy: float | None = None,
                 cx: float | None = None, cy: float | None = None, distortion: Any = (), near: float | str = 0.01, far: float | str = 2.0,
                 lens: dict[str, float] | None = None) -> None:
        """
        eye, target, up: m, where the camera is, what it looks at, what is above; or pose: (4 x 4), from the camera to the world, m, or
        (point, quaternion x y z w); pose_world_camera is the same. None of them: at the origin, looking along z.
        width, height: pixels, default 640 x 480, needed with fx. fov: vertical, rad. near, far: range of depth along z, m.
        fx, fy, cx, cy: pixels, of a calibration by OpenCV or ROS, where the centre of the first pixel is (0, 0); fy: default fx; cx, cy:
        default the middle. They replace fov. distortion: k1, k2, p1, p2, k3, or fewer of them.
        lens: fx, fy, cx, cy in pixels, k1, k2, p1, p2, k3, as OmCamera has them (the corner of the first pixel is (0, 0)).
        """
        given = {name: value for name, value in (("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)) if value is not None}
        if given or np.size(distortion):
            lens = self._calibrated(given, distortion, width, height, lens)
        width, height = 640 if width is None else width, 480 if height is None else height
        super().__init__(width=width, height=height, fov=fov, near_m=length(near, "near", np.inf), far_m=length(far, "far", 20.0))
        pose = pose_world_camera if pose is None else pose
        if pose is not None and (eye is not None or target is not None):
            raise ValueError("pose says where the camera is: leave out eye and target")
        if pose is not None or (given and eye is None and target is None):
            place = pose_of(np.eye(4) if pose is None else pose)
        else:
            eye, target = (0, 0, 0) if eye is None else eye, (0, 0, 1) if target is None else target
            place = lib.om_pose_look_at(vec3(eye, "eye"), vec3(target, "target"), vec3(up, "up"))
        self.pose_world_camera.p, self.pose_world_camera.q = place.p, place.q
        self.lens.assign(lens or {})
        lib.om_camera_check(ctypes.byref(self))

    @staticmethod
    def _calibrated(given: dict[str, float], distortion: Any, width: Any, height: Any, lens: Any) -> dict[str, float]:
        """The lens of intrinsics as OpenCV has them."""
        if lens is not None:
            raise ValueError(f"lens, or {', '.join(given) or 'distortion'}: not both")
        if "fx" not in given:
            raise ValueError(f"{', '.join(given) or 'distortion'} without fx: the focal length in pixels is needed")
        if width is None or height is None:
            raise ValueError("fx, fy, cx and cy belong to a size of the picture: width and height, in pixels, are needed")
        values = np.ravel(np.asarray(distortion, dtype=float))
        if len(values) > len(_DISTORTION):
            raise ValueError(f"distortion has {len(values)} values: {', '.join(_DISTORTION)} are known")
        lens = {"fx": given["fx"], "fy": given.get("fy", given["fx"]), "cx": given.get("cx", 0.5 * (width - 1)) + 0.5,
                "cy": given.get("cy", 0.5 * (height - 1)) + 0.5}
        return {**lens, **dict(zip(_DISTORTION, values.tolist()))}

    @classmethod
    def from_matrix(cls, matrix: Any, width: int, height: int, pose_world_camera: Any = None, distortion: Any = (),
                    near: float = 0.01, far: float = 2.0) -> Camera:
        """The camera of a calibration by OpenCV, or of a ROS CameraInfo.

        matrix: (3 x 3) with fx, fy, cx, cy in pixels; the centre of the first pixel is (0, 0), as OpenCV has it.
        pose_world_camera: (4 x 4), z forward, x right, y down, m; None: at the origin, looking along z.
        distortion: k1, k2, p1, p2, k3, or fewer of them.
        """
        matrix = array_of(matrix, np.float64, (3, 3), "matrix")
        if matrix[0, 1] != 0 or not np.array_equal(matrix[2], (0, 0, 1)):
            raise ValueError("matrix: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] is needed")
        return cls(fx=matrix[0, 0], fy=matrix[1, 1], cx=matrix[0, 2], cy=matrix[1, 2], distortion=distortion, pose=pose_world_camera,
                   width=width, height=height, near=near, far=far)

    @classmethod
    def _copy(cls, raw: Any) -> Camera:
        camera = cls.__new__(cls)
        ctypes.memmove(ctypes.byref(camera), ctypes.byref(raw), ctypes.sizeof(raw))
        return camera

    @property
    def matrix(self) -> np.ndarray:
        """Pose in the world (4 x 4)."""
        return pose_matrix(self.pose_world_camera)

    def project(self, points: Any) -> np.ndarray:
        """Pixel coordinates (n x 2), pixel centres at .5, of points in the world, m (n x 3); NaN: not in front."""
        points = array_of(np.atleast_2d(points), np.float64, (None, 3), "points")
        out, u, v = np.full((len(points), 2), np.nan), ctypes.c_double(), ctypes.c_double()
        for i, p in enumerate(points):
            if lib.om_camera_project(ctypes.byref(self), vec3(p), ctypes.byref(u), ctypes.byref(v)):
                out[i] = u.value, v.value
        return out

    def ray(self, u: float, v: float) -> np.ndarray:
        """Unit direction in the world of the ray through pixel coordinates (u, v)."""
        return np.frombuffer(lib.om_camera_ray(ctypes.byref(self), u, v), np.float64).copy()

    def cloud(self, depth: Any, normal: Any = None, ids: Any = None, only: int = -1) -> tuple[np.ndarray, np.ndarray | None]:
        """Points in the world, m (n x 3), and their normals or None, of a depth picture, m (height x width).

        normal: (height x width x 3), ids: (height x width), both as of SenseScene.depth; only: the object, -1: all.
        """
        shape = (self.height, self.width)
        depth = array_of(depth, np.float32, shape, "depth")
        normal = None if normal is None else array_of(normal, np.float32, (*shape, 3), "normal")
        ids = None if ids is None else array_of(ids, np.int32, shape, "ids")
        x = np.empty((depth.size, 3))
        out = None if normal is None else np.empty((depth.size, 3))
        n = lib.om_depth_to_cloud(ctypes.byref(self), depth.ctypes.data, None if ids is None else ids.ctypes.data,
                                  None if normal is None else normal.ctypes.data, only, x.ctypes.data,
                                  None if out is None else out.ctypes.data)
        return x[:n].copy(), None if out is None else out[:n].copy()

    def add_noise(self, depth: Any, frame: int = 0, seed: int = 0, normal: Any = None, **settings: float) -> np.ndarray:
        """A depth picture with the noise of a depth camera: settings a (m), b (1/m), min_grazing, dropout."""
        noisy = np.array(depth, dtype=np.float32, order="C")
        array_of(noisy, np.float32, (self.height, self.width), "depth")
        if normal is not None:
            normal = array_of(normal, np.float32, (self.height, self.width, 3), "normal")
        noise = lib.om_depth_noise_default(seed)
        noise.assign(settings)
        if normal is None:
            noise.min_grazing = 0
        lib.om_depth_add_noise(ctypes.byref(noise), ctypes.byref(self), frame, None if normal is None else normal.ctypes.data,
                               noisy.ctypes.data)
        return noisy


class SenseScene(Owner):
    """Triangles to look at.

        scene = SenseScene()
        tissue = scene.add(surface, "tissue")
        picture = scene.render(Camera(eye, target))            # (height x width x 3) bytes
        scene.update(tissue, x)                                # moved vertices
    """

    def __init__(self) -> None:
        refuse_fork("a camera")
        self._handle = Handle(create(lib.om_sense_scene_create), lib.om_sense_scene_destroy)
        self._busy = Busy("SenseScene")
        self._nvert: list[int] = []
        self._is_changed = False

    def add(self, surface: Surface, look: str | c.OmSensePart | c.OmSenseLook = "tissue") -> int:
        """Add a surface (copied); its number, from 0, is returned.

        look: the part of the operating field that it looks like ("tissue", "organ", "roi", "held", "board", "tool", "shaft"),
        or an OmSenseLook.
        """
        shade: Any = look if isinstance(look, c.OmSenseLook) else lib.om_sense_look(find_enum(c.OmSensePart, look))
        number = ctypes.c_int()
        with self._busy:
            lib.om_sense_scene_add(self._c, ctypes.byref(surface._as_c()), ctypes.byref(shade), ctypes.byref(number))
        self._nvert.append(len(surface.x))
        self._is_changed = True
        return number.value

    def update(self, number: int, x: Any, vert: Any = None) -> None:
        """New positions, m, of an object: (nvert x 3), or vert[i] of x for its vertex i."""
        if not 0 <= number < len(self._nvert):
            raise ValueError(f"there is no object {number}")
        x = array_of(x, np.float64, (None if vert is not None else self._nvert[number], 3), "x")
        if vert is not None:
            vert = index_array(vert, "vert")
            if len(vert) != self._nvert[number] or (vert.size and not 0 <= vert.min() <= vert.max() < len(x)):
                raise ValueError("vert has a row of x for each vertex of the object")
        with self._busy:
            lib.om_sense_scene_update(self._c, number, x.ctypes.data, None if vert is None else vert.ctypes.data)
        self._is_changed = True

    def show(self, number: int, is_shown: bool) -> None:
        """Show or hide an object."""
        if not 0 <= number < len(self._nvert):
            raise ValueError(f"there is no object {number}")
        lib.om_sense_scene_show(self._c, number, is_shown)
        self._is_changed = True

    def _commit(self) -> Any:
        refuse_fork("a camera")
        if self._is_changed:
            lib.om_sense_scene_commit(self._c)
            self._is_changed = False
        return self._c

    def render(self, camera: c.OmCamera, samples: int = 2, has_shadow: bool = True) -> np.ndarray:
        """A shaded picture: bytes (height x width x 3). samples: rays a pixel along each side, 1 to 4."""
        pixels = np.zeros((camera.height, camera.width, 3), np.uint8)
        raw = c.OmPicture(width=camera.width, height=camera.height, nchannel=3, pixel=pixels.ctypes.data)
        options = lib.om_sense_options_default()
        options.samples, options.has_shadow = samples, has_shadow
        with self._busy:
            lib.om_sense_render(self._commit(), ctypes.byref(camera), ctypes.byref(options), ctypes.byref(raw))
        return pixels

    def depth(self, camera: c.OmCamera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Depth along z, m, 0: nothing (height x width); object numbers, -1: none (height x width); unit normals towards the
        camera (height x width x 3)."""
        shape = (camera.height, camera.width)
        depth, ids = np.zeros(shape, np.float32), np.zeros(shape, np.int32)
        normal = np.zeros((*shape, 3), np.float32)
        with self._busy:
            lib.om_sense_depth(self._commit(), ctypes.byref(camera), 0, depth.ctypes.data, ids.ctypes.data, normal.ctypes.data)
        return depth, ids, normal

    def visibility(self, camera: c.OmCamera, points: Any, normals: Any = None, ignore: tuple[int, ...] = ()) -> c.OmVisibility:
        """Counts of points, m (n x 3), that the camera sees or not, and why. Objects in `ignore` do not hide."""
        points = array_of(points, np.float64, (None, 3), "points")
        normals = None if normals is None else array_of(normals, np.float64, points.shape, "normals")
        out = c.OmVisibility()
        with self._busy:
            lib.om_sense_count_visible(self._commit(), ctypes.byref(camera), points.ctypes.data,
                                       None if normals is None else normals.ctypes.data, len(points),
                                       sum(1 << i for i in ignore), ctypes.byref(out))
        return out


__all__ = ["Camera", "SenseScene"]
