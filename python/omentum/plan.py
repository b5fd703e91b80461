"""The task planner: what to grasp and where to pull, with proof of optimality and reasons."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _capi as c
from ._lib import Busy, Handle, Owner, copied, create, forget_message, lib, outcome, path_of, text_of


class Situation(c.OmSituation):
    """What the planner knows: fields of OmSituation.

        now = Situation(5)
        now.mark("is_above_roi", [(3, 3)])
        now.mark("is_fixed", [(1, 1), (2, 1)])
    """

    def __init__(self, n: int = 5, spacing: float = 0.024) -> None:
        """An untouched tissue of n x n blocks whose centres are `spacing` m apart; nothing is fixed."""
        super().__init__()
        lib.om_situation_init(ctypes.byref(self), n, spacing)

    def block(self, ix: int, iy: int) -> int:
        """Number of block (ix, iy), both counted from 1."""
        number = lib.om_block_at(ctypes.byref(self), ix, iy)
        if number < 0:
            raise ValueError(f"there is no block ({ix}, {iy}) in a grid of {self.n} x {self.n}")
        return number

    def mark(self, name: str, blocks: Any, value: Any = True) -> None:
        """Set a field of blocks, such as "is_fixed", "is_above_roi" or "reachable", for a list of (ix, iy)."""
        array = getattr(self, name)
        for ix, iy in blocks:
            array[self.block(ix, iy)] = value

    @classmethod
    def _copy(cls, raw: Any) -> Situation:
        out = cls.__new__(cls)
        ctypes.memmove(ctypes.byref(out), ctypes.byref(raw), ctypes.sizeof(raw))
        if raw.center:
            centers = copied(ctypes.cast(raw.center, ctypes.c_void_p).value, np.float64, (raw.n * raw.n, 3))
            out.center = centers.ctypes.data
            out._centers = centers
        return out


@dataclass
class Action:
    """One action of a plan. block: (ix, iy) counted from 1, or None; text: for people."""

    verb: str
    arm: int
    block: tuple[int, int] | None
    time: int
    text: str


def _action_text(plan: Any, i: int) -> str:
    return text_of(lambda out: lib.om_plan_print_action(ctypes.byref(plan), i, out))


@dataclass
class Plan:
    """The best plan. outcome: OK, UNSAT (no plan exists) or TIMEOUT (not proven to be the best)."""

    outcome: c.OmStatus
    actions: list[Action]
    grasp: tuple[int, int] | None  # block that is newly grasped
    cost: tuple[int, ...]
    is_optimal: bool
    ground_time: float  # s
    solve_time: float  # s
    raw: Any = field(repr=False)

    def __bool__(self) -> bool:
        return bool(self.actions)

    def __str__(self) -> str:
        return text_of(lambda out: lib.om_plan_print(ctypes.byref(self.raw), out)) or "no action"

    @classmethod
    def _of(cls, raw: Any) -> Plan:
        def at(block: int) -> tuple[int, int] | None:
            return (block % raw.n + 1, block // raw.n + 1) if block >= 0 else None

        actions = []
        for i in range(raw.naction):
            item = raw.action[i]
            text = _action_text(raw, i)
            actions.append(Action(c.OmPlanVerb(item.verb).name.lower(), item.arm, at(item.block), item.time, text))
        return cls(c.OmStatus(raw.outcome), actions, at(raw.grasp_block), tuple(int(v) for v in raw.cost), raw.is_optimal,
                   raw.ground_time, raw.solve_time, raw)


class Planner(Owner):
    """The planner; plan = Planner().solve(situation). For one thread at a time."""

    def __init__(self, program: str | os.PathLike[str] | None = None, **settings: Any) -> None:
        """program: a file in place of the built-in logic program. settings: fields of OmPlannerDef, such as horizon,
        max_lift, conflict_limit, time_limit (s)."""
        definition = lib.om_planner_default_def()
        definition.assign(settings)
        if program is not None:
            definition.program = path_of(program)
        self._handle = Handle(create(lib.om_planner_create, ctypes.byref(definition)), lib.om_planner_destroy)
        self._busy = Busy("Planner")

    def solve(self, situation: c.OmSituation, strict: bool = True) -> Plan:
        """The best plan. Without any it raises NoSolution, out of its budget TimeLimit (`result` is the plan so far); with
        strict=False the plan is returned, and its `outcome` says so."""
        raw = c.OmPlan()
        with self._busy:
            forget_message()
            status = lib.om_planner_solve(self._c, ctypes.byref(situation), ctypes.byref(raw))
        if status == c.OmStatus.UNSAT:
            lib.om_error(status, b"%s", b"no plan exists: Planner.explain has the reasons")
        return outcome(status, Plan._of(raw), strict)

    def explain(self, situation: c.OmSituation, plan: Plan, others: int = 5) -> str:
        """Why this plan, and why not the `others` nearest grasping points (-1: all)."""
        with self._busy:
            return text_of(lambda out: lib.om_planner_explain(self._c, ctypes.byref(situation), ctypes.byref(plan.raw), others, out))
