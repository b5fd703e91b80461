"""The native vector of environments for Stable-Baselines3.

    from stable_baselines3 import PPO
    from omentum.sb3 import VecEnv
    model = PPO("MlpPolicy", VecEnv("retract", 16))
    model.learn(200_000)
"""
from __future__ import annotations

import time
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv as Base

from .gym import _spaces
from .rl import RlTask, RlVec


class VecEnv(Base):
    """Environments of one task. Infos of an episode's end: "terminal_observation", "TimeLimit.truncated", "episode" (so no Monitor is
    needed), and the infos of the task."""

    def __init__(self, task: str, num_envs: int = 8, seed: int = 1, nworker: int = 0, **settings: Any) -> None:
        """nworker: threads, 0: one a processor. settings: of the task."""
        self.task = RlTask(task, **settings)
        self._vec = RlVec(self.task, num_envs, seed, nworker)
        self._actions: Any = None
        self._seed: int | None = None
        self._begin = time.time()
        self.render_mode = "rgb_array" if self.task.has_picture else None
        super().__init__(num_envs, *_spaces(self.task))

    def reset(self) -> np.ndarray:
        """Begin an episode in every environment; after seed(s) the first one of seed s."""
        seed, self._seed = self._seed, None
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return self._vec.reset(seed)

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions for step_wait."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Step every environment."""
        step = self._vec.step(self._actions)
        done = step.terminated | step.truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(done):
            infos[i] = {name: float(values[i]) for name, values in step.final_info.items()}
            infos[i]["terminal_observation"] = step.final_observation[i]
            infos[i]["TimeLimit.truncated"] = bool(step.truncated[i])
            infos[i]["episode"] = {"r": float(step.final_return[i]), "l": int(step.final_length[i]), "t": time.time() - self._begin}
        return step.observation, step.reward.astype(np.float32), done, infos

    def seed(self, seed: int | None = None) -> list[int | None]:
        """The next reset begins with this seed; episode k of environment i is drawn from (seed, i, k)."""
        self._seed = seed
        return [seed] * self.num_envs

    def get_images(self) -> list[np.ndarray | None]:
        """A picture of each environment."""
        return [self._vec.render(i) if self.task.has_picture else None for i in range(self.num_envs)]

    def close(self) -> None:
        """Give up the environments."""
        self._vec.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute, the same for all environments."""
        return [getattr(self, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused: the environments are no Python objects."""
        raise AttributeError("environments of a native vector have no attributes to set; settings are given when it is made")

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Refused: the environments are no Python objects."""
        raise AttributeError("environments of a native vector have no methods of their own")

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """False: nothing wraps an environment."""
        return [False] * len(list(self._get_indices(indices)))


__all__ = ["VecEnv"]
