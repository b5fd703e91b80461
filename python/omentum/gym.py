"""The tasks as environments of Gymnasium. Importing this module registers them:

    import gymnasium
    import omentum.gym
    env = gymnasium.make("omentum/Retract-v0", reward="thesis", render_mode="rgb_array")
    envs = gymnasium.make_vec("omentum/Retract-v0", num_envs=8)      # the native vector of environments

"omentum/CartPole-v0", "omentum/Reach-v0", "omentum/Retract-v0". Settings of a task are keyword arguments. Works with Gymnasium 0.29 and
later; the vector of environments needs 1.1 or later.
"""
from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from .rl import RlTask, RlVec, rl_tasks


def _spaces(task: RlTask) -> tuple[gymnasium.spaces.Box, gymnasium.spaces.MultiDiscrete]:
    return gymnasium.spaces.Box(-np.inf, np.inf, (task.nobservation,), np.float32), gymnasium.spaces.MultiDiscrete(task.nchoice)


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
        return self._vec.reset_one(0, (options or {}).get("start", -1)), self._info(False)

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One step of the task."""
        if self._vec is None:
            raise gymnasium.error.ResetNeeded("reset comes before step")
        step = self._vec.step(action)
        terminated, truncated = bool(step.terminated[0]), bool(step.truncated[0])
        if terminated or truncated:
            return step.final_observation[0], float(step.reward[0]), terminated, truncated, self._info(True)
        return step.observation[0], float(step.reward[0]), False, False, self._info(False)

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

        Where an episode ends, the next one begins in the same step (AutoresetMode.SAME_STEP): infos["final_obs"], infos["final_info"].
        """

        metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "autoreset_mode": AutoresetMode.SAME_STEP}

        def __init__(self, task: str, num_envs: int = 1, render_mode: str | None = None, nworker: int = 0, **settings: Any) -> None:
            self.task = RlTask(task, **settings)
            self.metadata = {**_metadata(self.task, render_mode), "autoreset_mode": AutoresetMode.SAME_STEP}
            self.num_envs, self.render_mode, self._nworker = num_envs, render_mode, nworker
            self.single_observation_space, self.single_action_space = _spaces(self.task)
            self.observation_space = batch_space(self.single_observation_space, num_envs)
            self.action_space = batch_space(self.single_action_space, num_envs)
            self._vec: RlVec | None = None

        def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict[str, Any]]:
            """Begin an episode in every environment. seed: one number for all of them."""
            if seed is not None and not isinstance(seed, (int, np.integer)):
                raise ValueError("one seed holds for all environments: episode k of environment i is drawn from (seed, i, k)")
            super().reset(seed=seed)
            if self._vec is None:
                self._vec = RlVec(self.task, self.num_envs, int(self.np_random.integers(2**31)) if seed is None else int(seed), self._nworker)
                seed = None
            return self._vec.reset(seed), {}

        def step(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
            """A step of every environment."""
            if self._vec is None:
                raise gymnasium.error.ResetNeeded("reset comes before step")
            step = self._vec.step(actions)
            infos: dict[str, Any] = {}
            ended = step.terminated | step.truncated
            if ended.any():
                final = np.full(self.num_envs, None, dtype=object)
                for i in np.flatnonzero(ended):
                    final[i] = step.final_observation[i]
                values: dict[str, Any] = dict(step.final_info)
                values.update({"_" + name: ended.copy() for name in step.final_info})
                infos = {"final_obs": final, "_final_obs": ended.copy(), "final_info": values, "_final_info": ended.copy()}
            return step.observation, step.reward, step.terminated, step.truncated, infos

        def render(self) -> tuple[np.ndarray, ...] | None:
            """With render_mode "rgb_array" a picture of each environment."""
            if self.render_mode is None or self._vec is None:
                return None
            return tuple(self._vec.render(i) for i in range(self.num_envs))

        def close_extras(self, **_: Any) -> None:
            """Give up the environments."""
            self._vec = None

    return VectorEnv


def make_vector_env(**arguments: Any) -> Any:
    """The native vector of environments: task, num_envs, render_mode, nworker, settings. For gymnasium.make_vec."""
    return _vector_env()(**arguments)


def register() -> None:
    """Register the tasks: "omentum/Retract-v0" of task "retract"."""
    for task in rl_tasks():
        name = f"omentum/{''.join(part.capitalize() for part in task.split('-'))}-v0"
        if name not in gymnasium.registry:
            # the limit of steps is the task's own, so no wrapper adds one
            gymnasium.register(name, entry_point="omentum.gym:Env", vector_entry_point="omentum.gym:make_vector_env", kwargs={"task": task})


register()

__all__ = ["Env", "make_vector_env", "register"]
