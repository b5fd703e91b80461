"""The native vector of environments for Stable-Baselines3.

    from stable_baselines3 import PPO
    from omentum.sb3 import VecEnv, evaluate_starts
    model = PPO("MlpPolicy", VecEnv("retract", 16))
    model.learn(200_000)
    print(evaluate_starts(model, "retract")["exposure"].mean())
"""
from __future__ import annotations

import time
from typing import Any

import numpy as np
from ._convert import need

need("stable_baselines3", "omentum.sb3")
from stable_baselines3.common.monitor import Monitor  # noqa: E402 - behind the error that says how to get it
from stable_baselines3.common.vec_env import VecEnv as Base  # noqa: E402

from .gym import _seen, _spaces  # noqa: E402
from .rl import RlTask, RlVec  # noqa: E402


class VecEnv(Base):
    """Environments of one task. Infos of an episode's end: "terminal_observation", "TimeLimit.truncated", "episode" (so no Monitor is
    needed), and the infos of the task."""

    def __init__(self, task: str, num_envs: int = 8, seed: int = 1, nworker: int = 0, **settings: Any) -> None:
        """task: "retract", or its name in Gymnasium: "omentum/Retract-v0". nworker: threads, 0: one a processor. settings: of the task."""
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
        self.reset_infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        return _seen(self.task, self._vec.reset(seed))

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
            if "success" in infos[i]:
                infos[i]["is_success"] = bool(infos[i]["success"])  # what Stable-Baselines3 reports as the rate of success
            infos[i]["terminal_observation"] = _seen(self.task, step.final_observation[i])
            infos[i]["TimeLimit.truncated"] = bool(step.truncated[i])
            infos[i]["episode"] = {"r": float(step.final_return[i]), "l": int(step.final_length[i]), "t": time.time() - self._begin}
        return _seen(self.task, step.observation), step.reward.astype(np.float32), done, infos

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
        """True for Monitor, whose infos "episode" are there; nothing else wraps an environment."""
        return [issubclass(wrapper_class, Monitor)] * len(list(self._get_indices(indices)))


def evaluate_starts(model: Any, task: str, seed: int = 1000, nworker: int = 0, **settings: Any) -> dict[str, np.ndarray]:
    """One episode from each start of the evaluation, as `omentum rl eval`: the model acts by predict(.., deterministic=True).

    Returns "return", "length" and the infos of the task at the end of each episode, arrays (starts).
    """
    made = RlTask(task, **settings)
    vec = RlVec(made, made.nstart, seed, nworker, has_autoreset=False)
    observation = np.stack([vec.reset_one(i, i) for i in range(made.nstart)])
    names = ["return", "length", *made.info_names]
    result = {name: np.zeros(made.nstart) for name in names}
    acting = np.ones(made.nstart, np.bool_)
    while acting.any():
        action = np.asarray(model.predict(_seen(made, observation), deterministic=True)[0]).reshape(made.nstart, -1)
        step = vec.step(np.where(acting[:, None], action, -1))  # an episode that is over waits
        observation = step.observation
        ended = step.terminated | step.truncated
        for name, value in zip(names, [step.final_return, step.final_length, *step.final_info.values()]):
            result[name][ended] = value[ended]
        acting &= ~ended
    return result


__all__ = ["VecEnv", "evaluate_starts"]
