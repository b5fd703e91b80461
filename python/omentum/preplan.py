"""The plan before the operation: every grasping point is tried in the twin."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass, field
from typing import Any

from . import _capi as c
from ._lib import Progress, ProgressFunction, lib, path_of, refuse_fork, text_of
from .plan import Plan
from .scene import Scene, scene_of


@dataclass
class Preplan:
    """What each grasping point reached in the twin. chosen: (ix, iy) counted from 1, or None.

    points: of each block, by (ix, iy): verdict ("chosen", "hidden", "attached", ...), visibility, force (N), npull, fold,
    naction. plan: the actions of the chosen point. print(preplan) shows the map.
    """

    chosen: tuple[int, int] | None
    is_exposing: bool
    reason: str
    points: dict[tuple[int, int], dict[str, Any]]
    plan: Plan
    raw: Any = field(repr=False)

    @classmethod
    def _of(cls, raw: Any) -> Preplan:
        def at(block: int) -> tuple[int, int]:
            return block % raw.n + 1, block // raw.n + 1

        points = {}
        for block in range(raw.n * raw.n):
            point = raw.point[block]
            points[at(block)] = {**point.as_dict(), "fold": c.OmPlanVerb(point.fold).name.lower(),
                                 "verdict": lib.om_preplan_verdict_word(int(point.verdict)).decode()}
        plan = c.OmPlan()
        lib.om_preplan_make_plan(ctypes.byref(raw), ctypes.byref(plan))
        return cls(at(raw.chosen) if raw.chosen >= 0 else None, raw.is_exposing, raw.reason, points, Plan._of(plan), raw)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Preplan:
        """Read a plan file."""
        raw = c.OmPreplan()
        lib.om_preplan_load(path_of(path), ctypes.byref(raw))
        return cls._of(raw)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the plan file, JSON."""
        lib.om_preplan_save(ctypes.byref(self.raw), path_of(path))

    def __str__(self) -> str:
        return text_of(lambda out: lib.om_preplan_print(ctypes.byref(self.raw), out))


def preplan(scene: Scene | str | os.PathLike[str], progress: bool | ProgressFunction | None = None, **settings: Any) -> Preplan:
    """Try every grasping point of a scene in its twin, and choose. settings: fields of OmPreplanDef, such as nworker."""
    refuse_fork("a plan before the operation")
    scene = scene_of(scene)
    definition, raw = lib.om_preplan_default_def(ctypes.byref(scene)), c.OmPreplan()
    definition.assign(settings)
    with Progress(progress) as listener:
        lib.om_preplan_run(ctypes.byref(definition), listener.pointer, ctypes.byref(raw))
    return Preplan._of(raw)
