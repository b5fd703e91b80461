"""Tissue retraction: whole runs, and the deliberative loop tick by tick with listeners in Python."""
from __future__ import annotations

import ctypes
import os
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any, Callable

import numpy as np

from . import _capi as c
from . import plot as _plot
from ._convert import find_enum, functions_of
from ._lib import Busy, Handle, Interrupts, Owner, Progress, ProgressFunction, create, hdf5, lib, path_of, refuse_fork, status_of
from .plan import Plan, Planner, Situation
from .preplan import Preplan
from .scene import Body, Scene, scene_of
from .world import World

_SAMPLE_NAMES = ("time", "visibility", "force", "force_world", "height", "speed_rate")


@dataclass
class RetractResult:
    """How a retraction ended. outcome: "exposed", "in_view_at_start", "gave_up", "no_plan_left", "cancelled", "aborted",
    "held"; "running": the loop has not ended, and is_exposed is False.

    samples: dictionary of arrays over time: time (s), visibility, force and force_world (N), height (m), speed_rate.
    actions, updates: a dictionary of the fields of OmRetractAction and OmRetractUpdate each. summary: all other fields of
    OmRetractResult.
    """

    outcome: str
    is_exposed: bool
    reason: str
    samples: dict[str, np.ndarray]
    actions: list[dict[str, Any]]
    updates: list[dict[str, Any]]
    summary: dict[str, Any]

    def plot(self, ax: Any = None) -> Any:
        """Draw force and visible share over time with matplotlib; the axes are returned."""
        return _plot.run(ax, self.samples, self.outcome)

    @classmethod
    def _of(cls, raw: Any, is_running: bool = False) -> RetractResult:
        table = np.array([[getattr(raw.sample[i], n) for n in _SAMPLE_NAMES] for i in range(raw.nsample)]).reshape(-1, len(_SAMPLE_NAMES))
        summary = raw.as_dict()
        if is_running:  # C has 0, exposed, until the end
            summary["outcome"] = None
        return cls("running" if is_running else lib.om_retract_outcome_text(int(raw.outcome)).decode(), raw.is_exposed, raw.reason,
                   {name: table[:, k].copy() for k, name in enumerate(_SAMPLE_NAMES)},
                   [raw.action[i].as_dict() for i in range(raw.naction)], [raw.belief.update[i].as_dict() for i in range(raw.belief.nupdate)],
                   summary)


def retract(scene: Scene | str | os.PathLike[str], out_dir: str | os.PathLike[str] | None = None, program: str | os.PathLike[str] | None = None,
            preplan: Preplan | None = None, supervise: Callable[[Loop], Any] | None = None,
            progress: bool | ProgressFunction | None = None, layout: int | None = None, **settings: Any) -> RetractResult:
    """Run the retraction of a scene to its end: sense, plan, act, watch the force; monitor and learn, if the scene says so.

    out_dir: folder for report.html, run.json and run.vtkhdf; None: nothing is written. program: a logic program in place of
    the built-in one. preplan: the plan before the operation, followed first. supervise: a person or a program that watches:
    called with the loop after every tick, commands by loop.command. layout: replaces scene.seed, of attachments, region and noise.
    settings: other fields of OmRetractDef: nworker,
    needs_approval, records_observations, ...
    """
    refuse_fork("a retraction")
    scene = scene_of(scene)
    if layout is not None:
        scene = scene.copy()
        scene.seed = layout
    definition = lib.om_retract_default_def(ctypes.byref(scene))
    definition.assign(settings)
    definition.out_dir = None if out_dir is None else path_of(out_dir)
    definition.program = None if program is None else path_of(program)
    if preplan is not None:
        definition.preplan = ctypes.pointer(preplan.raw)
    if supervise is not None:
        definition.supervise = functions_of(c.OmRetractDef)["supervise"](_supervisor(supervise))
    raw = c.OmRetractResult()
    try:
        with hdf5 if out_dir is not None else nullcontext(), Progress(progress) as listener:
            lib.om_retract_run(ctypes.byref(definition), listener.pointer, ctypes.byref(raw))
        return RetractResult._of(raw)
    finally:
        lib.om_retract_result_done(ctypes.byref(raw))


def _supervisor(function: Callable[[Loop], Any]) -> Any:
    def call(_ctx: Any, address: int) -> int:
        loop = Loop._borrow(address)
        try:
            function(loop)
            return 0
        except BaseException as error:
            return status_of(error, "supervise")
        finally:
            loop._inside = False
            loop.close()

    return call


_HOOKS = functions_of(c.OmLoopListener)


class Listener:
    """What a loop tells. Derive from it; all methods do nothing here. An exception in one of them ends the tick.

    A listener may read the loop and command it; it does not tick or close the loop.
    """

    def on_begin(self, loop: Loop) -> Any:
        """Before the first tick."""

    def on_tick(self, loop: Loop, sample: dict[str, float]) -> Any:
        """After each tick; sample: time (s), visibility, force, force_world (N), height (m), speed_rate."""

    def on_plan(self, loop: Loop, situation: Situation, plan: Plan) -> Any:
        """A new plan, also one without actions."""

    def on_action_begin(self, loop: Loop, action: dict[str, Any]) -> Any:
        """An action begins: verb, arm, block, time."""

    def on_action_end(self, loop: Loop, action: dict[str, Any]) -> Any:
        """An action ended: fields of OmRetractAction."""

    def on_update(self, loop: Loop, event: Any) -> Any:
        """An estimate of the twin's attachments: OmUpdateEvent, valid during the call."""

    def on_command(self, loop: Loop, command: c.OmLoopCommand) -> Any:
        """A command took effect: kind, block, value."""

    def on_hold(self, loop: Loop, hold: str, reason: str) -> Any:
        """The loop stops and waits for a person; hold: "warning", "stale", "late", ..."""

    def on_warning(self, loop: Loop, was: int, frame: c.OmMonitorFrame) -> Any:
        """The warning state of the monitor changed from `was`, 0 to 3."""

    def on_end(self, loop: Loop, result: RetractResult) -> Any:
        """The loop has ended."""


class Loop(Owner):
    """The deliberative loop, one tick at a time.

        scene = Scene.load("scenes/sheet.yaml")
        world = SimulatedWorld(scene)
        world.reset()
        result = Loop(scene, world, listeners=[MyListener()]).run()
    """

    def __init__(self, scene: Scene | str | os.PathLike[str], world: World, twin: Body | None = None, planner: Planner | None = None,
                 truth: Body | None = None, listeners: list[Listener] | None = None, preplan: Preplan | None = None, **settings: Any) -> None:
        """
        scene: its task has limits, speeds and grid. world: at its start. twin: at rest; None: a body of the scene, which settles here.
        planner: None: that of the built-in program.
        truth: recorded, never acted on. listeners: called in this order. preplan: followed first. settings: other fields of
        OmLoopDef: is_attended, needs_approval, max_age, ...
        """
        scene = scene_of(scene)
        if twin is None:
            twin = Body(scene)
            twin.settle(scene.task.time_step, strict=False)
        planner = Planner() if planner is None else planner
        definition = lib.om_loop_default_def(ctypes.byref(scene.task), world._c, twin._c, planner._c)
        definition.assign(settings)
        if preplan is not None:
            definition.preplan = ctypes.pointer(preplan.raw)
        if truth is not None:
            definition.truth = truth._c
        listeners = listeners or []
        table = (c.OmLoopListener * max(1, len(listeners)))()
        for entry, listener in zip(table, listeners):
            self._connect(entry, listener)
        definition.listener, definition.nlistener = table, len(listeners)
        self._busy = Busy("Loop")
        self._inside = False
        keep = (table, world._handle, twin._handle, planner._handle, scene, world, truth, listeners)
        self._handle = Handle(create(lib.om_loop_create, ctypes.byref(definition)), lib.om_loop_destroy, *keep)

    @classmethod
    def _borrow(cls, address: int) -> Loop:
        """The loop of a run, for the time of a call."""
        loop = cls.__new__(cls)
        loop._handle, loop._busy, loop._inside = Handle(address, lambda _: None), Busy("Loop"), True
        return loop

    def _connect(self, entry: Any, listener: Listener) -> None:
        """Functions of C for the methods of a listener."""
        def hook(name: str, convert: Any) -> Any:
            method = getattr(listener, name)

            def call(_ctx: Any, _loop: Any, *values: Any) -> int:
                self._inside = True
                try:
                    method(self, *convert(*values))
                    return 0
                except BaseException as error:
                    return status_of(error, name)
                finally:
                    self._inside = False

            return _HOOKS[name](call)

        converts = {
            "on_begin": lambda: (), "on_tick": lambda sample: (sample.contents.as_dict(),),
            "on_plan": lambda situation, plan: (Situation._copy(situation.contents), Plan._of(c.OmPlan.from_buffer_copy(plan.contents))),
            "on_action_begin": lambda action: (_action(action.contents),),
            "on_action_end": lambda action: (_action(action.contents),),
            "on_end": lambda result: (RetractResult._of(result.contents),),
            "on_update": lambda event: (event.contents,),
            "on_command": lambda command: (c.OmLoopCommand.from_buffer_copy(command.contents),),
            "on_hold": lambda hold, reason: (c.OmHold(hold).name.lower(), (reason or b"").decode()),
            "on_warning": lambda was, frame: (was, c.OmMonitorFrame.from_buffer_copy(frame.contents)),
        }
        for name, convert in converts.items():
            if getattr(type(listener), name, None) is not getattr(Listener, name):
                setattr(entry, name, hook(name, convert))

    def tick(self) -> None:
        """Advance world and twin by one time step, then decide what the arms do next."""
        if self._inside:
            raise RuntimeError("a function that the loop calls does not tick it")
        with self._busy:
            lib.om_loop_tick(self._c)

    def run(self) -> RetractResult:
        """Tick to the end. Ctrl-C stops the arms; the loop ends as cancelled, then KeyboardInterrupt is raised."""
        with Interrupts(ends_calls=False) as interrupts:  # a tick is whole: the loop stops the arms itself
            while self.phase != "ended":
                if interrupts.is_set:
                    self.command("cancel")
                    break
                self.tick()
        return self.result

    def command(self, kind: str, **fields: Any) -> None:
        """Command the loop: "pause", "resume", "abort", "cancel", and the other kinds of OmLoopCommandKind."""
        command = c.OmLoopCommand()
        command.kind = find_enum(c.OmLoopCommandKind, kind)
        command.assign(fields)
        lib.om_loop_command(self._c, ctypes.byref(command))

    @property
    def phase(self) -> str:
        """ "begin", "verify", "plan", "act", "look", "ended", or another of OmLoopPhase."""
        return c.OmLoopPhase(lib.om_loop_phase(self._c)).name.lower()

    @property
    def hold(self) -> str:
        """Why the loop holds: "none", "warning", "stale", "late", ..."""
        return c.OmHold(lib.om_loop_hold(self._c)).name.lower()

    @property
    def is_paused(self) -> bool:
        """Whether it is paused."""
        return lib.om_loop_is_paused(self._c)

    @property
    def ntick(self) -> int:
        """Ticks so far."""
        return lib.om_loop_ntick(self._c)

    @property
    def sample(self) -> dict[str, float]:
        """Of the last tick, as in Listener.on_tick."""
        return lib.om_loop_sample(self._c).as_dict()

    def force(self, arm: int = 0) -> float:
        """By the twin, N; 0: the arm holds nothing; NaN: the engine has no forces."""
        return lib.om_loop_force(self._c, arm)

    @property
    def result(self) -> RetractResult:
        """The result so far; its outcome is "running" until the loop has ended."""
        return RetractResult._of(lib.om_loop_result(self._c).contents, self.phase != "ended")

    def close(self) -> None:
        """Give up the loop; within a listener this is refused."""
        if self._inside:
            raise RuntimeError("a listener does not close its loop; command it: loop.command('abort')")
        super().close()


def _action(raw: Any) -> dict[str, Any]:
    out = raw.as_dict()
    out["verb"] = c.OmPlanVerb(raw.verb).name.lower()
    return out


__all__ = ["Listener", "Loop", "RetractResult", "retract"]
