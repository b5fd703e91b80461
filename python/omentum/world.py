"""Worlds: an operating field known by observations and moved by commands. Simulated ones, and your own in Python."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _capi as c
from ._convert import functions_of
from ._lib import Busy, Handle, Owner, Unavailable, arm_of, create, forget_message, lib, make_error, outcome, path_of, pose as pose_of, pose_matrix, refuse_fork, status_of, view
from .camera import Camera
from .scene import Body, Scene, Site, scene_of

VISIBILITY, IMAGE, DEPTH, COLOR = c.OM_OBSERVE_VISIBILITY, c.OM_OBSERVE_IMAGE, c.OM_OBSERVE_DEPTH, c.OM_OBSERVE_COLOR


class Arm(c.OmArmObservation):
    """What an arm measures: the fields of OmArmObservation. `tip` is its OmPose, with p (m) and q (x y z w).

        Arm(pose, jaw=0.5)
    """

    def __init__(self, pose: Any = (0, 0, 0), jaw: float = 0.0, *, jaw_goal: float | None = None, jaw_speed: float = 0.0, is_moving: bool = False,
                 q: Any = None, force: Any = None, torque: Any = None, time: float | None = None) -> None:
        """
        pose: of the tip in the world, a point (3), a matrix (4 x 4), or (point, quaternion x y z w); m. jaw: measured opening, rad.
        jaw_goal: commanded opening; default `jaw`. A jaw that is commanded closed, at rest, and open by more than 3 degrees holds tissue.
        is_moving: whether a commanded motion of the tip is under way. q: measured joints (6): of the arms of a world with `psm`.
        force, torque: N and N m on the tip, in the world's axes; None: not measured. time: s, of the measurement; None: that of the observation.
        """
        super().__init__(jaw=jaw, jaw_speed=jaw_speed, is_moving=is_moving, jaw_goal=jaw if jaw_goal is None else jaw_goal,
                         time=np.nan if time is None else time)
        place = pose_of(pose)
        self.tip.p, self.tip.q = place.p, place.q
        if q is not None:
            self.q = q
        if force is not None or torque is not None:
            self.has_wrench = True
            self.force = (0, 0, 0) if force is None else force
            self.torque = (0, 0, 0) if torque is None else torque

    @property
    def pose(self) -> np.ndarray:
        """Of the tip in the world (4 x 4)."""
        return pose_matrix(self.tip)

    @property
    def is_holding(self) -> bool:
        """Tissue between the jaws, as the loop concludes from what is measured."""
        return lib.om_arm_is_holding(ctypes.byref(self))


@dataclass
class Observation:
    """What was measured, each with its own time (s).

    arms: an Arm for each arm. visibility: visible fraction of the region of interest, 0 to 1. picture: of the endoscope
    (height x width x 3) bytes. depth: m along z of depth_camera, 0 or not finite: none (height x width). color: of the same
    pixels (height x width x 3). Pictures are None where they were not observed.
    """

    time: float = 0.0
    arms: list[Arm] = field(default_factory=list)
    visibility: float = 0.0
    picture: np.ndarray | None = None
    picture_time: float = 0.0
    picture_camera: c.OmCamera | None = None
    depth: np.ndarray | None = None
    depth_time: float = 0.0
    depth_camera: c.OmCamera | None = None
    color: np.ndarray | None = None

    @classmethod
    def _of(cls, raw: Any) -> Observation:
        """Views of the pictures of an OmObservation, which the views keep alive."""
        handle = Handle(raw, lambda o: lib.om_observation_done(ctypes.byref(o)))

        def picture(p: Any) -> np.ndarray | None:
            return view(handle, p.pixel, np.uint8, (p.height, p.width, p.nchannel), True) if p.pixel else None

        depth_camera = raw.rgbd.camera
        shape = (depth_camera.height, depth_camera.width)
        return cls(raw.time, [Arm.from_buffer_copy(raw.arm[i]) for i in range(raw.narm)], raw.visibility,
                   picture(raw.endoscope.color), raw.endoscope.time,
                   Camera._copy(raw.endoscope.camera) if raw.endoscope.camera.width else None,
                   view(handle, raw.rgbd.depth, np.float32, shape, True) if raw.rgbd.depth else None, raw.rgbd.time,
                   Camera._copy(depth_camera) if depth_camera.width else None, picture(raw.rgbd.color))

    def _write(self, raw: Any) -> None:
        """Fill an OmObservation; its arrays are freed by C."""
        raw.time, raw.narm, raw.visibility = self.time, len(self.arms), self.visibility
        for i, arm in enumerate(self.arms):
            ctypes.memmove(ctypes.byref(raw.arm[i]), ctypes.byref(arm), ctypes.sizeof(c.OmArmObservation))
            if np.isnan(raw.arm[i].time):
                raw.arm[i].time = self.time
        raw.endoscope.time, raw.rgbd.time = self.picture_time or self.time, self.depth_time or self.time
        for target, camera in ((raw.endoscope, self.picture_camera), (raw.rgbd, self.depth_camera)):
            if camera is not None:
                ctypes.memmove(ctypes.byref(target.camera), ctypes.byref(camera), ctypes.sizeof(c.OmCamera))
        for target, pixels, name in ((raw.endoscope, self.picture, "picture"), (raw.rgbd, self.color, "color")):
            if pixels is not None:
                pixels = np.ascontiguousarray(pixels, np.uint8)
                if pixels.shape != (target.camera.height, target.camera.width, 3):
                    raise ValueError(f"{name} has shape {pixels.shape}: height x width x 3 of its camera is needed")
                lib.om_picture_init(ctypes.byref(target.color), pixels.shape[1], pixels.shape[0], 3)
                ctypes.memmove(target.color.pixel, pixels.ctypes.data, pixels.nbytes)
        if self.depth is not None:
            depth = np.ascontiguousarray(self.depth, np.float32)
            if depth.shape != (raw.rgbd.camera.height, raw.rgbd.camera.width):
                raise ValueError(f"depth has shape {depth.shape}: height x width of depth_camera is needed")
            raw.rgbd.depth = lib.om_alloc(depth.size, 4)
            if not raw.rgbd.depth:
                raise make_error(c.OmStatus.NO_MEMORY)
            ctypes.memmove(raw.rgbd.depth, depth.ctypes.data, depth.nbytes)


_OPS = functions_of(c.OmWorldOps)


_METHODS = {"move": "move(arm, goal, speed)", "set_jaw": "set_jaw(arm, angle)", "stop": "stop(arm)", "advance": "advance(dt)",
            "observe": "observe(what)"}


class World(Owner):
    """An operating field. Derive from it to operate your own, for example a real robot:

        class MyRobot(om.World):
            def __init__(self):
                super().__init__(narm=2, sources=om.VISIBILITY)
                self.arms = [om.Arm(pose, jaw=0.6), ...]     # measured
            def move(self, arm, goal, speed): ...          # goal: OmPose; m/s. Returns at once
            def set_jaw(self, arm, angle): ...             # rad
            def stop(self, arm): ...
            def advance(self, dt): ...                     # s
            def observe(self, what): return om.Observation(time, self.arms, visibility)
            def reset(self): ...                           # optional

    python/examples/my_robot.py is whole: it runs a retraction to its end. The library checks arguments before it calls these methods. A goal out of reach raises omentum.Invalid, which the loop
    handles. Any other exception ends the call of the library, for example Loop.tick, and is raised there.
    """

    def __init__(self, narm: int = 2, sources: int = VISIBILITY, psm: list[c.OmPsm | None] | None = None) -> None:
        """narm: 1 or 2. sources: sum of VISIBILITY, IMAGE, DEPTH, COLOR. psm: calibrated kinematics of the arms."""
        if not 1 <= narm <= c.OM_MAX_ARM:
            raise ValueError(f"a world has 1 to {c.OM_MAX_ARM} arms, not {narm}")
        missing = [words for name, words in _METHODS.items() if getattr(type(self), name) is getattr(World, name)]
        if missing:
            raise TypeError(f"{type(self).__name__} has no {', no '.join(missing)}: a world needs {', '.join(_METHODS.values())}")
        ops = c.OmWorldOps()
        for name in ("move", "set_jaw", "stop", "advance", "observe", "reset", "destroy"):
            setattr(ops, name, _OPS[name](getattr(self, "_on_" + name)))
        if type(self).reset is World.reset:
            ops.reset = _OPS["reset"]()
        raw = c.OmWorld(ops=ctypes.pointer(ops), narm=narm, sources=sources)
        for i, one in enumerate(psm or []):
            if one is not None:
                raw.psm[i] = ctypes.pointer(one)
        self._busy, self._raw = Busy(type(self).__name__), raw
        self._handle = Handle(ctypes.pointer(raw), lambda _: None, ops, raw, psm)

    # ---- what a controller calls, and a derived class implements ----

    def move(self, arm: int, goal: Any, speed: float) -> None:
        """Command a straight motion of the tip to a pose at `speed` m/s; returns at once."""
        raise NotImplementedError

    def set_jaw(self, arm: int, angle: float) -> None:
        """Command the jaw angle, rad; below 20 degrees it grasps."""
        raise NotImplementedError

    def stop(self, arm: int) -> None:
        """Stop an arm where it is."""
        raise NotImplementedError

    def advance(self, dt: float) -> None:
        """Advance by `dt` s."""
        raise NotImplementedError

    def observe(self, what: int = 0) -> Observation:
        """Observe the arms, and `what`, a sum of VISIBILITY, IMAGE, DEPTH, COLOR."""
        raise NotImplementedError

    def reset(self) -> Any:
        """Bring the world to its start."""
        raise NotImplementedError

    # ---- functions that C calls ----

    def _call(self, method: Any, *arguments: Any) -> int:
        try:
            method(*arguments)
            return 0
        except BaseException as error:
            return status_of(error, type(self).__name__)

    def _on_move(self, _world: Any, arm: int, goal: Any, speed: float) -> int:
        return self._call(self.move, arm, c.OmPose.from_buffer_copy(goal), speed)

    def _on_set_jaw(self, _world: Any, arm: int, angle: float) -> int:
        return self._call(self.set_jaw, arm, angle)

    def _on_stop(self, _world: Any, arm: int) -> None:
        self._call(self.stop, arm)

    def _on_advance(self, _world: Any, dt: float) -> int:
        return self._call(self.advance, dt)

    def _on_observe(self, _world: Any, what: int, raw: Any) -> int:
        return self._call(self._observe_into, what, raw.contents)

    def _observe_into(self, what: int, raw: Any) -> None:
        seen, narm = self.observe(what), self._raw.narm
        if not isinstance(seen, Observation):
            raise TypeError(f"observe() returned {type(seen).__name__}: an omentum.Observation is needed")
        if len(seen.arms) != narm or not all(isinstance(arm, c.OmArmObservation) for arm in seen.arms):
            raise ValueError(f"observe() returned an Observation whose arms are {seen.arms!r}: {narm} of omentum.Arm are needed")
        if what & VISIBILITY and not 0 <= seen.visibility <= 1:  # also NaN
            raise ValueError(f"observe({what}) returned an Observation with visibility {seen.visibility!r}: 0 to 1 is needed, a share, not percent")
        for flag, name in ((IMAGE, "picture"), (DEPTH, "depth"), (COLOR, "color")):
            if what & flag and getattr(seen, name) is None:
                raise ValueError(f"observe({what}) returned an Observation without `{name}`, which sources={self._raw.sources} promises")
        seen._write(raw)

    def _on_reset(self, _world: Any) -> int:
        return self._call(self.reset)

    def _on_destroy(self, _world: Any) -> None:
        """The Python object owns the world."""


class SimulatedWorld(World):
    """The simulated operating field of a scene, with its own mesh, stiffness and noise.

        world = SimulatedWorld(Scene.load("scenes/sheet.yaml"))
        world.reset()
        world.move(0, point, 0.02)
        world.advance(0.02)
        world.observe(om.VISIBILITY).visibility
    """

    def __init__(self, scene: Scene | str | os.PathLike[str], nworker: int = 0) -> None:
        refuse_fork("a simulated world")
        scene = scene_of(scene).copy()  # borrowed by C: later changes of the caller's scene are not for this world
        self.scene, self.site = scene, Site(scene, "world")
        address = create(lib.om_world_create_simulated, ctypes.byref(scene), ctypes.byref(self.site._c), nworker)
        self._take(address, scene, self.site._handle)

    def _take(self, address: Any, *keep: Any) -> None:
        self._busy = Busy(type(self).__name__)
        self._handle = Handle(address, lib.om_world_destroy, *keep)

    def move(self, arm: int, goal: Any, speed: float) -> None:
        lib.om_world_move(self._c, arm, pose_of(goal), speed)

    def set_jaw(self, arm: int, angle: float) -> None:
        lib.om_world_set_jaw(self._c, arm, angle)

    def stop(self, arm: int) -> None:
        lib.om_world_stop(self._c, arm_of(arm))

    def advance(self, dt: float) -> None:
        with self._busy:
            lib.om_world_advance(self._c, dt)

    def observe(self, what: int = 0) -> Observation:
        raw = c.OmObservation()
        with self._busy:
            lib.om_world_observe(self._c, what, ctypes.byref(raw))
        return Observation._of(raw)

    def reset(self, strict: bool = True) -> bool:
        """Arms parked, tissue at rest, time 0. True: the tissue is at rest; if it is not, NotConverged, or False."""
        with self._busy:
            forget_message()
            status = lib.om_world_reset(self._c)
        return outcome(status, status == 0, strict)

    @property
    def truth(self) -> Body:
        """The true body, for evaluation and pictures; a controller must not look."""
        address = lib.om_world_truth(self._c)
        if not address:
            raise Unavailable("this world has no truth: only a simulated one knows it")
        return Body._borrow(address, self.scene, self.site, self._handle)

    def render(self, width: int = 640, height: int = 480) -> np.ndarray:
        """The endoscope's view at any size: bytes (height x width x 3)."""
        raw = c.OmPicture()
        with self._busy:
            lib.om_world_render(self._c, width, height, ctypes.byref(raw))
        handle = Handle(raw, lambda p: lib.om_picture_done(ctypes.byref(p)))
        return view(handle, raw.pixel, np.uint8, (height, width, 3), True)

    def snapshot(self) -> bytes:
        """Everything that changes."""
        block = np.zeros(lib.om_world_state_size(self._c), np.uint8)
        with self._busy:
            lib.om_world_save(self._c, block.ctypes.data)
        return block.tobytes()

    def restore(self, snapshot: bytes) -> None:
        """Return to a snapshot of this world."""
        if len(snapshot) != lib.om_world_state_size(self._c):
            raise ValueError("the snapshot is of another world")
        with self._busy:
            lib.om_world_restore(self._c, snapshot)


class RecordedWorld(SimulatedWorld):
    """A world that passes every call to another one and writes it to a new file; ReplayedWorld answers from the file."""

    def __init__(self, inner: World, path: str | os.PathLike[str]) -> None:
        self._take(create(lib.om_world_create_recorded, inner._c, path_of(path)), inner, inner._handle)

    def end(self) -> None:
        """Complete the log and close the file."""
        lib.om_world_log_end(self._c)


class ReplayedWorld(SimulatedWorld):
    """A world that answers from a log of RecordedWorld; a call that is not the next one of the log is refused."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._take(create(lib.om_world_create_replayed, path_of(path)))


class RobotWorld(SimulatedWorld):
    """A robot on the topics of ROS 2, over DDS: `omentum dvrk SCENE` in another process, or a da Vinci Research Kit.

        world = RobotWorld("scenes/sheet.yaml")         # 5 s for the robot to answer
        world.reset()                                   # homes the arms
        world.move(0, point, 0.02)
        world.advance(0.02)                             # one goal is sent; takes 20 ms of the wall clock

    It observes DEPTH, COLOR and IMAGE, and knows no truth. A fault stops the motion, and every later call raises it again: a pose
    older than `stale` (s), a jump, an arm that is not homed any more. A goal outside of the workspace, `reach` (m) around the
    tissue of the scene, raises Invalid.
    """

    def __init__(self, scene: Scene | str | os.PathLike[str], domain: int = 0, *, network: str | None = None, peer: str | None = None,
                 wait: float = 5.0, stale: float = 0.1, reach: float = 0.15, frames: str | os.PathLike[str] | None = None,
                 instrument: str | os.PathLike[str] | None = None, arm: str | os.PathLike[str] | None = None,
                 arms: tuple[str, str] = ("PSM1", "PSM2"), endoscope: str = "endoscope", depth: str = "depth") -> None:
        """
        frames: file of `omentum register`, where the robot's frames are; None: the robot's tf_static. instrument, arm: files
        of the dVRK for all arms; None: of the instrument that the robot reports, on a Classic arm. arms, endoscope, depth: what
        names of topics begin with.
        """
        refuse_fork("a robot")
        self.scene = scene_of(scene).copy()
        self.site = Site(self.scene, "twin")
        definition = lib.om_dds_world_default_def(ctypes.byref(self.scene))
        definition.site, definition.reach = ctypes.pointer(self.site._c), reach
        definition.dds.domain = domain
        definition.dds.network = network.encode() if network else None
        definition.dds.peer = peer.encode() if peer else None
        definition.wait, definition.stale = wait, stale
        definition.arm[0], definition.arm[1] = (name.encode() for name in arms)
        definition.endoscope, definition.depth = endoscope.encode(), depth.encode()
        definition.instrument_file = None if instrument is None else path_of(instrument)
        definition.arm_file = None if arm is None else path_of(arm)
        table, nframe = (c.OmDdsFrame * c.OM_DDS_MAX_FRAME)(), ctypes.c_int(0)
        if frames is not None:
            lib.om_dds_frames_load(path_of(frames), table, ctypes.byref(nframe))
        definition.frame, definition.nframe = table, nframe.value
        self._take(create(lib.om_world_create_dds, ctypes.byref(definition)), definition, table, self.scene, self.site._handle)
