"""The twin follows the camera: the attachments that explain scans."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _capi as c
from ._convert import array_of
from ._lib import Busy, Handle, Owner, Progress, ProgressFunction, copied, create, lib, path_of, pose, refuse_fork
from .learned import BanetNet
from .scan import Scan
from .scene import Body, Scene, Site, scene_of


@dataclass
class Acquisition:
    """What an update needs from one moment. grasps: (arm, pose when the jaw closed, pose now) of each tool that holds tissue;
    x_twin: the twin's positions then, m (nnode x 3): vertices of the site's mesh and, of quadratic elements, midpoints of
    edges, as Body.nodes; None: found as the equilibrium under the grasps. rest: the tissue before the tools moved it, by the same
    camera: errors of the camera show there.
    """

    scan: Scan
    grasps: list[tuple[int, Any, Any]]
    x_twin: np.ndarray | None = None
    time: float = 0.0
    rest: Scan | None = None


@dataclass
class Estimate:
    """Attachments that explain scans; arrays of the twin's vertices. Use it only if is_accepted; else `reason` says why not.

    attached: bool. probability: of being attached. uncertainty: 1: the scans say nothing about this vertex. stiffness: N/m of
    springs. verdicts: OmMatchVerdict of each acquisition; one whose is_good is False was left out, its `reason` says why. x: the twin at rest with them, m (nacquisition x nnode x 3), as Acquisition.x_twin. look_next: m, where a view informs most, or None.
    summary: the other fields of OmMatchEstimate, such as after_median (m).
    """

    is_accepted: bool
    reason: str
    attached: np.ndarray
    probability: np.ndarray
    uncertainty: np.ndarray
    stiffness: np.ndarray
    x: np.ndarray
    look_next: np.ndarray | None
    verdicts: list[Any]
    summary: dict[str, Any] = field(repr=False)

    @classmethod
    def _copy(cls, raw: Any) -> Estimate:
        n = raw.nvert
        return cls(raw.is_accepted, raw.reason, copied(raw.attached, np.bool_, (n,)), copied(raw.probability, np.float64, (n,)),
                   copied(raw.uncertainty, np.float64, (n,)), copied(raw.stiffness, np.float64, (n,)),
                   copied(raw.x, np.float64, (raw.nacquisition, raw.nnode, 3)), raw.look_next.copy() if raw.has_look_next else None,
                   [c.OmMatchVerdict.from_buffer_copy(raw.verdict[i]) for i in range(raw.nacquisition)], raw.as_dict())


class Matcher(Owner):
    """Finds the attachments of a twin from scans, by physics, and with a network by both.

        matcher = Matcher(scene, twin.site, net=BanetNet.load())
        estimate = matcher.update([Acquisition(scan, [(0, pose_grasp, pose_now)], twin.nodes)])
        if estimate.is_accepted: adopt(twin, estimate)
    """

    def __init__(self, scene: Scene | str | os.PathLike[str], site: Site, net: BanetNet | None = None, **fields: Any) -> None:
        """fields of OmMatchDef, such as candidate (vertices that may be attached), nhypothesis, seed, nworker."""
        scene = scene_of(scene)
        candidate = fields.pop("candidate", None)
        definition = lib.om_match_default_def(ctypes.byref(scene), ctypes.byref(site._c))
        definition.assign(fields)
        if candidate is not None:
            candidate = np.ascontiguousarray(candidate, dtype=np.int32)
            definition.candidate, definition.ncandidate = candidate.ctypes.data, len(candidate)
        match = Handle(create(lib.om_match_create, ctypes.byref(definition)), lib.om_match_destroy, site._handle, scene)
        setting = lib.om_banet_update_default_def(match.address)
        if net is not None:
            refuse_fork("a network")
            setting.net = net._c
        keep = (match, net._handle if net is not None else None)
        self._handle = Handle(create(lib.om_banet_updater_create, ctypes.byref(setting)), lib.om_banet_updater_destroy, *keep)
        self._nnode = lib.om_match_view(match.address).contents.mesh.contents.nvert
        self._busy = Busy("Matcher")

    def update(self, acquisitions: list[Acquisition], progress: bool | ProgressFunction | None = None) -> Estimate:
        """Estimate the attachments that explain the scans. Acquisitions are of different moments of one operation."""
        table, keep = (c.OmAcquisition * max(1, len(acquisitions)))(), []
        for raw, item in zip(table, acquisitions):
            _fill(raw, item)
            if item.x_twin is not None:
                x = array_of(item.x_twin, np.float64, (self._nnode, 3), "x_twin")
                raw.x_twin = x.ctypes.data
                keep.append(x)
        out = c.OmMatchEstimate()
        try:
            with self._busy, Progress(progress) as listener:
                lib.om_banet_update(self._c, len(acquisitions), table, listener.pointer, ctypes.byref(out), None)
            return Estimate._copy(out)
        finally:
            lib.om_match_estimate_done(ctypes.byref(out))


def adopt(body: Body, estimate: Estimate, seconds: float = c.OM_MATCH_ADOPT_TIME, dt: float = 0.02) -> None:
    """Step a body for `seconds` s while its attachments become those of an estimate, without a jump."""
    attached = np.ascontiguousarray(estimate.attached, dtype=np.uint8)
    stiffness = np.ascontiguousarray(estimate.stiffness, dtype=np.float64)
    adoption = Handle(create(lib.om_match_adoption_create, len(attached)), lib.om_match_adoption_destroy)
    lib.om_match_adoption_begin(adoption.address, body._c, attached.ctypes.data, stiffness.ctypes.data, seconds)
    while lib.om_match_adoption_is_active(adoption.address):
        lib.om_match_adoption_step(adoption.address, body._c, dt)
        body.step(dt, strict=False)


def load_acquisition(path: str | os.PathLike[str], site: Site | None = None) -> Acquisition:
    """Read a file of an acquisition, as `omentum update` takes it (om_acquisition_load). site: to find tissue in pictures."""
    raw = c.OmAcquisition()
    lib.om_acquisition_load(path_of(path), ctypes.byref(site._c) if site is not None else None, None, ctypes.byref(raw))
    scan, rest = Scan.__new__(Scan), None
    scan._own(c.OmScan.from_buffer_copy(raw.scan))
    if raw.rest:
        rest = Scan.__new__(Scan)
        rest._own(c.OmScan.from_buffer_copy(raw.rest.contents))
        lib.om_free(ctypes.cast(raw.rest, ctypes.c_void_p))
    grasps = [(raw.grasp[i].arm, c.OmPose.from_buffer_copy(raw.grasp[i].pose_world_grasp),
               c.OmPose.from_buffer_copy(raw.grasp[i].pose_world_now)) for i in range(raw.ngrasp)]
    return Acquisition(scan, grasps, None, raw.time, rest)


def save_acquisition(path: str | os.PathLike[str], acquisition: Acquisition) -> None:
    """Write a file (.yaml) for `omentum update`, and the cloud beside it. x_twin is not written."""
    raw = c.OmAcquisition()
    _fill(raw, acquisition)
    lib.om_acquisition_save(ctypes.byref(raw), path_of(path))


def _fill(raw: Any, acquisition: Acquisition) -> None:
    """An OmAcquisition that borrows the scan."""
    ctypes.memmove(ctypes.byref(raw.scan), ctypes.byref(acquisition.scan._c), ctypes.sizeof(c.OmScan))
    if acquisition.rest is not None:
        raw.rest = ctypes.pointer(acquisition.rest._c)
    if len(acquisition.grasps) > c.OM_MAX_ARM:
        raise ValueError(f"an acquisition has at most {c.OM_MAX_ARM} grasps, not {len(acquisition.grasps)}")
    raw.ngrasp, raw.time = len(acquisition.grasps), acquisition.time
    for grasp, (arm, begin, now) in zip(raw.grasp, acquisition.grasps):
        grasp.arm = arm
        for target, source in ((grasp.pose_world_grasp, pose(begin)), (grasp.pose_world_now, pose(now))):
            target.p, target.q = source.p, source.q
