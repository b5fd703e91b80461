"""Tasks to learn, and environments that run side by side: NumPy alone. omentum.gym and omentum.sb3 build on them."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _capi as c
from ._convert import array_of, unknown
from ._lib import Busy, Handle, Invalid, Owner, create, lib, refuse_fork
from .volume import picture_array


def rl_tasks() -> dict[str, str]:
    """Names of the tasks, and what they are about."""
    found: dict[str, str] = {}
    while kind := lib.om_rl_task_kind(len(found)):
        found[kind.contents.name.decode()] = kind.contents.about.decode()
    return found


def task_name(name: str) -> str:
    """The name of a task of its own or of Gymnasium: "omentum/CartPole-v0" is "cart-pole"."""
    if not name.startswith("omentum/"):
        return name
    short = name.removesuffix("-v0").split("/", 1)[1]
    found = {gym_name(task): task for task in rl_tasks()}
    if name not in found:
        raise Invalid(unknown("omentum", "environment", short, [n[8:-3] for n in found]) + "; names are such as omentum/Retract-v0")
    return found[name]


def gym_name(task: str) -> str:
    """The name of a task in Gymnasium: of "cart-pole" it is "omentum/CartPole-v0"."""
    return f"omentum/{''.join(part.capitalize() for part in task.split('-'))}-v0"


class RlTask(Owner):
    """A task: constant, shared by any number of environments.

        task = RlTask("retract", reward="thesis", points=8)

    The name may be that of Gymnasium: "omentum/Retract-v0".

    name, nobservation, bounds (least and largest value of an observation), nchoice (choices of each component of an action), max_step, nstart (starts of the evaluation),
    info_names; score_name: the info that counts, and says `success` where it reaches the target, None: the return; target: score at which the task counts as solved;
    picture_shape: where an observation is a picture, its (height, width, 3), values 0 to 1; else None.
    """

    def __init__(self, name: str, **settings: Any) -> None:
        """settings: of the task, as of `omentum rl`; True is 1, False is 0."""
        table = (c.OmRlSetting * max(1, len(settings)))()
        for raw, (key, value) in zip(table, settings.items()):
            raw.key, raw.value = key.encode(), str(int(value) if isinstance(value, (bool, np.bool_)) else value).encode()
        pointer = ctypes.POINTER(c.OmRlTask)()
        name = task_name(name)
        lib.om_rl_task_create(name.encode(), table, len(settings), ctypes.byref(pointer))
        self._handle = Handle(pointer, lib.om_rl_task_destroy)
        raw = pointer.contents
        self.name, self.settings = name, settings
        self.nobservation: int = raw.nobservation
        self.bounds: tuple[float, float] = (raw.obs_lo, raw.obs_hi)
        self.nchoice: list[int] = raw.nchoice[:raw.naction].tolist()
        self.max_step: int = raw.max_step
        self.nstart: int = raw.nstart
        self.info_names = [raw.info_name[i].decode() for i in range(raw.ninfo)]
        self.score_name = raw.score_name.decode() if raw.score_name else None
        self.target: float = raw.target
        self.picture_shape: tuple[int, int, int] | None = (raw.picture_height, raw.picture_width, 3) if raw.picture_width else None
        self.has_picture = bool(raw.ops.contents.render)
        self.has_expert = bool(raw.ops.contents.expert)

    def _with_success(self, info: dict[str, Any]) -> dict[str, Any]:
        """Infos and, of a task with a score, `success`: 1 where the score has reached the target, else 0."""
        if self.score_name is not None and self.target == self.target:
            info["success"] = np.multiply(info[self.score_name] >= self.target, 1.0)
        return info

    def __repr__(self) -> str:
        return f"RlTask({self.name!r}, {self.nobservation} observed, choices {self.nchoice})"


@dataclass
class RlStep:
    """What a step gave, arrays of its own. observation: float32 (nenv x nobservation), of the next episode where one ended; reward,
    terminated, truncated: (nenv).

    Of episodes that ended, other rows are zero: final_observation (nenv x nobservation), final_info: by name (nenv), final_return,
    final_length (nenv).
    """

    observation: np.ndarray
    reward: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    final_observation: np.ndarray
    final_info: dict[str, np.ndarray] = field(repr=False)
    final_return: np.ndarray = field(repr=False)
    final_length: np.ndarray = field(repr=False)


class RlVec(Owner):
    """Environments of one task side by side. Episode k of environment i is a function of (seed, i, k) and the actions, with any
    number of threads.

        vec = RlVec(RlTask("retract"), nenv=8, seed=1)
        observation = vec.reset()
        step = vec.step(actions)                                # (nenv x components of an action)
    """

    def __init__(self, task: RlTask, nenv: int = 8, seed: int = 1, nworker: int = 0, has_autoreset: bool = True) -> None:
        """nworker: threads, 0: one a processor. has_autoreset: where an episode ends, the next one begins in the same step; else the
        environment must be reset first."""
        if task.has_picture:
            refuse_fork("a camera")
        definition = lib.om_rl_vec_default_def(task._c)
        definition.nenv, definition.seed, definition.nworker, definition.has_autoreset = nenv, seed, nworker, has_autoreset
        self._handle = Handle(create(lib.om_rl_vec_create, ctypes.byref(definition)), lib.om_rl_vec_destroy, task._handle)
        self._busy = Busy("RlVec")
        self.task, self.nenv = task, nenv
        self._rng = lib.om_rng_init(seed, 1 << 63)

    def seed(self, seed: int) -> None:
        """Another seed: the next reset begins episode 0 of this seed."""
        with self._busy:
            lib.om_rl_vec_set_seed(self._c, seed)
            self._rng = lib.om_rng_init(seed, 1 << 63)

    def reset(self, seed: int | None = None) -> np.ndarray:
        """Begin the next episode of every environment, or episode 0 of a seed; observations, float32 (nenv x nobservation)."""
        if seed is not None:
            self.seed(seed)
        out = np.zeros((self.nenv, self.task.nobservation), np.float32)
        with self._busy:
            lib.om_rl_vec_reset(self._c, out.ctypes.data)
        return out

    def reset_one(self, env: int, start: int = -1) -> np.ndarray:
        """Begin the next episode of one environment; its observation (nobservation). start: of the evaluation, -1: drawn."""
        out = np.zeros(self.task.nobservation, np.float32)
        with self._busy:
            lib.om_rl_vec_reset_one(self._c, env, start, out.ctypes.data)
        return out

    def step(self, action: Any) -> RlStep:
        """Step every environment. action: whole numbers (nenv x components); a row that begins with -1 waits."""
        task, n = self.task, self.nenv
        action = array_of(np.reshape(action, (n, len(task.nchoice))), np.int32, (n, len(task.nchoice)), "action")
        final_info = np.zeros((n, len(task.info_names)))
        shape = (n, task.nobservation)
        out = RlStep(np.zeros(shape, np.float32), np.zeros(n), np.zeros(n, np.bool_), np.zeros(n, np.bool_), np.zeros(shape, np.float32),
                     {name: final_info[:, k] for k, name in enumerate(task.info_names)}, np.zeros(n), np.zeros(n, np.int32))
        raw = c.OmRlStep(
            obs=out.observation.ctypes.data, reward=out.reward.ctypes.data, is_terminated=out.terminated.ctypes.data,
            is_truncated=out.truncated.ctypes.data, final_obs=out.final_observation.ctypes.data, final_info=final_info.ctypes.data,
            final_return=out.final_return.ctypes.data, final_length=out.final_length.ctypes.data)
        with self._busy:
            lib.om_rl_vec_step(self._c, action.ctypes.data, ctypes.byref(raw))
        task._with_success(out.final_info)
        return out

    def observe(self) -> np.ndarray:
        """Observations now, after a reset of every environment, float32 (nenv x nobservation)."""
        out = np.zeros((self.nenv, self.task.nobservation), np.float32)
        with self._busy:
            lib.om_rl_vec_observe(self._c, out.ctypes.data)
        return out

    def info(self, env: int = 0) -> dict[str, float]:
        """The infos of an environment now, such as exposure, force (N; NaN: clusters have no forces) and success (1 or 0)."""
        values = np.zeros(len(self.task.info_names))
        if not (self._c and values.size):
            return {}
        with self._busy:
            lib.om_rl_vec_info(self._c, env, values.ctypes.data)
        return {name: float(value) for name, value in self.task._with_success(dict(zip(self.task.info_names, values.tolist()))).items()}

    def render(self, env: int = 0) -> np.ndarray:
        """A picture of an environment: bytes (height x width x 3)."""
        raw = c.OmPicture()
        try:
            with self._busy:
                lib.om_rl_vec_render(self._c, env, ctypes.byref(raw))
            return picture_array(raw)
        finally:
            lib.om_picture_done(ctypes.byref(raw))

    def expert(self) -> np.ndarray:
        """Actions of the task's scripted expert, with the noise of a person (nenv x components)."""
        out = np.zeros((self.nenv, len(self.task.nchoice)), np.int32)
        with self._busy:
            for i in range(self.nenv):
                lib.om_rl_vec_expert(self._c, i, ctypes.byref(self._rng), out[i].ctypes.data)
        return out

    def snapshot(self) -> bytes:
        """Everything that changes."""
        block = np.zeros(lib.om_rl_vec_size(self._c), np.uint8)
        with self._busy:
            lib.om_rl_vec_save(self._c, block.ctypes.data)
        return block.tobytes()

    def restore(self, snapshot: bytes) -> None:
        """Return to a snapshot of the same task, seed and number of environments."""
        if len(snapshot) != lib.om_rl_vec_size(self._c):
            raise ValueError("the snapshot is of other environments")
        with self._busy:
            lib.om_rl_vec_restore(self._c, snapshot)


__all__ = ["RlStep", "RlTask", "RlVec", "rl_tasks"]
