"""The tasks as environments of Gymnasium. Where the package is installed Gymnasium knows them; importing this module registers
them, too:

    import gymnasium
    env = gymnasium.make("omentum/Retract-v0", reward="thesis", render_mode="rgb_array")
    envs = gymnasium.make_vec("omentum/Retract-v0", num_envs=8)      # the native vector of environments

One environment for each task: "omentum/CartPole-v0", "omentum/Reach-v0", "omentum/Retract-v0", .. Settings of a task are keyword arguments.
Works with Gymnasium 0.29 and later; the vector of environments needs 1.1 or later.
"""
from __future__ import annotations

from typing import Any

import numpy as np

from ._convert import need
from .rl import RlTask, RlVec, gym_name, rl_tasks

need("gymnasium", "omentum.gym")
import gymnasium  # noqa: E402 - behind the error that says how to get it


def _spaces(task: RlTask) -> tuple[gymnasium.spaces.Box, gymnasium.spaces.MultiDiscrete]:
    box: Any
    if task.picture_shape:
        box = gymnasium.spaces.Box(0, 255, task.picture_shape, np.uint8)
    else:
        box = gymnasium.spaces.Box(*task.bounds, (task.nobservation,), np.float32)
    return box, gymnasium.spaces.MultiDiscrete(task.nchoice)


def _seen(task: RlTask, observation: np.ndarray) -> np.ndarray:
    """The observation as its space has it: a picture is bytes (.. x height x width x 3)."""
    if not task.picture_shape:
        return observation
    return np.rint(observation * 255).astype(np.uint8).reshape(*observation.shape[:-1], *task.picture_shape)


def _metadata(task: RlTask, render_mode: str | None) -> dict[str, Any]:
    modes = ["rgb_array"] if task.has_picture else []
    if render_mode not in (None, *modes):
        raise ValueError(f"task {task.name} has no render_mode {render_mode!r}")
    return {"render_modes": modes, "render_fps": 50}  # a step is 20 ms


class Env(gymnasium.Env):
    """One environment. Infos: those of the task, at the end of an episode, and with every step if `has_info`.

    reset(seed=s) begins the first episode of seed s; reset() the next one. reset(options={"start": k}) begins at start k of the evaluation.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}

    def __init__(self, task: str, render_mode: str | None = None, has_info: bool = False, **settings: Any) -> None:
        self.task = RlTask(task, **settings)
        self.metadata = _metadata(self.task, render_mode)
        self.render_mode, self.has_info = render_mode, has_info
        self.observation_space, self.action_space = _spaces(self.task)
        self._vec: RlVec | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode. options: "start", of the evaluation."""
        super().reset(seed=seed)
        if self._vec is None:  # not in __init__: the environment may be made in one process and used in another
            if seed is None:
                seed = int(self.np_random.integers(2**31))
            self._vec = RlVec(self.task, 1, seed, 1, has_autoreset=False)
        elif seed is not None:
            self._vec.seed(seed)
        return _seen(self.task, self._vec.reset_one(0, (options or {}).get("start", -1))), self._info(False)

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One step of the task."""
        if self._vec is None:
            raise gymnasium.error.ResetNeeded("reset comes before step")
        step = self._vec.step(action)
        terminated, truncated = bool(step.terminated[0]), bool(step.truncated[0])
        is_end = terminated or truncated
        observation = _seen(self.task, (step.final_observation if is_end else step.observation)[0])
        return observation, float(step.reward[0]), terminated, truncated, self._info(is_end)

    def _info(self, is_end: bool) -> dict[str, Any]:
        return self._vec.info(0) if self._vec is not None and (is_end or self.has_info) else {}

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """With render_mode "rgb_array" a picture, bytes (height x width x 3)."""
        if self.render_mode is None or self._vec is None:
            return None
        return self._vec.render(0)

    def expert(self) -> np.ndarray:
        """The action of the task's scripted expert, with the noise of a person."""
        if self._vec is None:
            raise gymnasium.error.ResetNeeded("reset comes before expert")
        return self._vec.expert()[0]

    def close(self) -> None:
        """Give up the environment."""
        self._vec = None


def _vector_env() -> Any:
    """The class of the vector of environments, of this version of Gymnasium."""
    from gymnasium.vector import AutoresetMode, VectorEnv as Base
    from gymnasium.vector.utils import batch_space

    class VectorEnv(Base):
        """The native vector of environments: steps run on threads, with the same results for any number of them.

        Where an episode ends, the next one begins in the same step (AutoresetMode.SAME_STEP): infos["final_obs"], infos["final_info"]. With
        autoreset_mode="NextStep" it begins in the next step, which ignores the action and has reward 0; with "Disabled" reset must begin it.

        reset(options={"start": k}) begins at starts of the evaluation, a number or one for each environment; {"reset_mask": mask} resets
        some environments, the others go on.
        """

        metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "autoreset_mode": AutoresetMode.SAME_STEP}

        def __init__(self, task: str, num_envs: int = 1, render_mode: str | None = None, nworker: int = 0, has_info: bool = False,
                     autoreset_mode: Any = AutoresetMode.SAME_STEP, **settings: Any) -> None:
            self.task = RlTask(task, **settings)
            self._mode = AutoresetMode(autoreset_mode)
            self.metadata = {**_metadata(self.task, render_mode), "autoreset_mode": self._mode}
            self.num_envs, self.render_mode, self.has_info, self._nworker = num_envs, render_mode, has_info, nworker
            self.single_observation_space, self.single_action_space = _spaces(self.task)
            self.observation_space = batch_space(self.single_observation_space, num_envs)
            self.action_space = batch_space(self.single_action_space, num_envs)
            self._ended = np.zeros(num_envs, np.bool_)
            self._vec: RlVec | None = None

        def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
            """Begin an episode in every environment, or in some. seed: one number for all of them."""
            if seed is not None and not isinstance(seed, (int, np.integer)):
                raise ValueError("one seed holds for all environments: episode k of environment i is drawn from (seed, i, k)")
            mask, start = self._options(options or {})
            if not mask.all() and (seed is not None or self._vec is None):
                raise ValueError("reset_mask: a seed, and the first reset, are for all environments")
            super().reset(seed=seed)
            if self._vec is None:
                first = int(self.np_random.integers(2**31)) if seed is None else int(seed)
                self._vec = RlVec(self.task, self.num_envs, first, self._nworker, self._mode == AutoresetMode.SAME_STEP)
            elif seed is not None:
                self._vec.seed(int(seed))
            if mask.all() and (start < 0).all():
                observation = self._vec.reset()
            else:
                observation = np.zeros((self.num_envs, self.task.nobservation), np.float32) if mask.all() else self._vec.observe()
                for i in np.flatnonzero(mask):
                    observation[i] = self._vec.reset_one(int(i), int(start[i]))
            self._ended[mask] = False
            return _seen(self.task, observation), self._infos(mask)

        def _options(self, options: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
            """Which environments begin, and at which start."""
            mask = np.asarray(options.get("reset_mask", np.ones(self.num_envs, np.bool_)))
            if mask.dtype != np.bool_ or mask.shape != (self.num_envs,) or not mask.any():
                raise ValueError(f"reset_mask: {self.num_envs} booleans, not all of them false")
            return mask, np.broadcast_to(np.asarray(options.get("start", -1), int), (self.num_envs,))

        def _infos(self, mask: np.ndarray) -> dict[str, Any]:
            """Infos of the task now, with has_info."""
            infos: dict[str, Any] = {}
            if self.has_info and self._vec is not None:
                for i in np.flatnonzero(mask):
                    infos = self._add_info(infos, self._vec.info(int(i)), int(i))
            return infos

        def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
            """A step of every environment."""
            if self._vec is None:
                raise gymnasium.error.ResetNeeded("reset comes before step")
            if self._mode == AutoresetMode.NEXT_STEP and self._ended.any():
                actions = np.array(actions, np.int32).reshape(self.num_envs, -1)
                for i in np.flatnonzero(self._ended):
                    self._vec.reset_one(int(i))
                    actions[i] = -1  # the environment waits
            step = self._vec.step(actions)
            self._ended = step.terminated | step.truncated
            observation, last = _seen(self.task, step.observation), _seen(self.task, step.final_observation)
            infos: dict[str, Any] = {}
            if self._mode == AutoresetMode.SAME_STEP:
                infos = self._infos(np.ones(self.num_envs, np.bool_))
                for i in np.flatnonzero(self._ended):
                    final = {name: float(values[i]) for name, values in step.final_info.items()}
                    infos = self._add_info(infos, {"final_obs": last[i], "final_info": final}, int(i))
            else:  # observations and infos are those of the episode that ends
                observation[self._ended] = last[self._ended]
                infos = self._infos(~self._ended)
                for i in np.flatnonzero(self._ended):
                    infos = self._add_info(infos, {name: float(values[i]) for name, values in step.final_info.items()}, int(i))
            return observation, step.reward, step.terminated, step.truncated, infos

        def render(self) -> tuple[np.ndarray, ...] | None:
            """With render_mode "rgb_array" a picture of each environment."""
            if self.render_mode is None or self._vec is None:
                return None
            return tuple(self._vec.render(i) for i in range(self.num_envs))

        def expert(self) -> np.ndarray:
            """Actions of the task's scripted expert, with the noise of a person (num_envs x components)."""
            if self._vec is None:
                raise gymnasium.error.ResetNeeded("reset comes before expert")
            return self._vec.expert()

        def close_extras(self, **_: Any) -> None:
            """Give up the environments."""
            self._vec = None

    return VectorEnv


def make_vector_env(**arguments: Any) -> Any:
    """The native vector of environments: task, num_envs, render_mode, nworker, has_info, autoreset_mode, settings. For gymnasium.make_vec."""
    return _vector_env()(**arguments)


def register() -> None:
    """Register the tasks: "omentum/Retract-v0" of task "retract"."""
    for task in rl_tasks():
        name = gym_name(task)
        if name not in gymnasium.registry:
            # the limit of steps is the task's own, so no wrapper adds one
            gymnasium.register(name, entry_point="omentum.gym:Env", vector_entry_point="omentum.gym:make_vector_env", kwargs={"task": task})


register()

__all__ = ["Env", "make_vector_env", "register"]
