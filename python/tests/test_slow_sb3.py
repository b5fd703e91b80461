"""Stable-Baselines3: its vector of environments, and its PPO as a second source for the figures of omentum's own."""
import json
import os
import pathlib
import re
import subprocess

import numpy as np
import pytest

import omentum as om

PROGRAM = os.environ.get("OMENTUM_PROGRAM")
STEPS = 100_000
pytest.importorskip("gymnasium")
pytest.importorskip("stable_baselines3")


def test_both_learn_the_cart_pole(tmp_path):
    """The same settings and environments; 20 episodes of other seeds, deterministic. A random policy reaches 20 to 25."""
    import torch
    from stable_baselines3 import PPO

    from omentum.sb3 import VecEnv
    torch.set_num_threads(1)
    model = PPO("MlpPolicy", VecEnv("cart-pole", 16, seed=1), n_steps=64, batch_size=256, n_epochs=3, gae_lambda=0.95, ent_coef=5e-3,
                clip_range=0.2, clip_range_vf=0.2, learning_rate=lambda left: 1.2e-3 * left, policy_kwargs={"net_arch": [128, 128]}, seed=1,
                device="cpu")
    model.learn(STEPS)
    vec = om.RlVec(om.RlTask("cart-pole"), 20, seed=77)
    observation, total = vec.reset(), np.zeros(20)
    for _ in range(500):
        step = vec.step(model.predict(observation, deterministic=True)[0])
        observation = step.observation
        first = (total == 0) & (step.terminated | step.truncated)
        total[first] = step.final_return[first]
    assert total.min() > 0
    theirs = total.mean()
    print(f"mean return of 20 episodes: {theirs}")
    assert theirs > 450
    if PROGRAM:
        environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
        subprocess.run([PROGRAM, "rl", "train", "-t", "cart-pole", "-n", str(STEPS), "--rate", "1.2e-3", "-q", "-o", tmp_path / "cart"],
                       check=True, env=environment)
        done = subprocess.run([PROGRAM, "rl", "eval", "-t", "cart-pole", "-p", tmp_path / "cart" / "policy.safetensors", "-n", "20", "--json", "-q"],
                              capture_output=True, text=True, check=False, env=environment)
        ours = json.loads(done.stdout)["figures"]["return"]
        assert ours > 450 and abs(ours - theirs) < 50


def test_ppo_learns_to_retract(capsys):
    """The example, as measured in doc/gym.md: 0.425 with seed 1. A policy that does not grasp, or grasps anywhere, exposes nothing."""
    import importlib.util
    path = pathlib.Path(__file__).resolve().parents[1] / "examples" / "ppo_sb3.py"
    spec = importlib.util.spec_from_file_location("ppo_sb3", path)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    exposure = example.main(["--clip-reward", "inf"])
    said = capsys.readouterr().out
    print(said)
    assert exposure.shape == (49,) and "100352 steps" in said
    assert exposure.mean() > 0.3


def test_ppo_learns_from_pictures():
    """A smoke test (5.7): the losses are finite, and every layer changes. No target."""
    import torch
    from stable_baselines3 import PPO

    from omentum.sb3 import VecEnv
    torch.set_num_threads(1)
    env = VecEnv("retract", 4, seed=1, picture=1, move_mm=2, max_step=40)
    model = PPO("CnnPolicy", env, n_steps=64, batch_size=64, n_epochs=2, learning_rate=1e-3, seed=1, device="cpu")
    assert model.policy.features_extractor.cnn[0].in_channels == 3
    before = {name: value.clone() for name, value in model.policy.state_dict().items()}
    model.learn(2048)
    losses = {name: value for name, value in model.logger.name_to_value.items() if name.startswith("train/")}
    print(losses)
    assert {"train/loss", "train/value_loss", "train/policy_gradient_loss"} <= set(losses) and np.isfinite(list(losses.values())).all()
    after = model.policy.state_dict()
    assert all(torch.isfinite(value).all() and not torch.equal(value, before[name]) for name, value in after.items())


def test_the_vector_of_stable_baselines3():
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecMonitor

    from omentum.sb3 import VecEnv
    env = VecEnv("cart-pole", 4, seed=3)
    native = om.RlVec(om.RlTask("cart-pole"), 4, seed=3)
    assert np.array_equal(env.reset(), native.reset())
    for t in range(60):
        action = np.full((4, 1), t % 2 if t < 10 else 1)
        observation, reward, done, infos = env.step(action)
        step = native.step(action)
        assert np.array_equal(observation, step.observation) and np.array_equal(done, step.terminated | step.truncated)
        for i in np.flatnonzero(done):
            assert np.array_equal(infos[i]["terminal_observation"], step.final_observation[i])
            assert infos[i]["episode"]["l"] == step.final_length[i] and infos[i]["TimeLimit.truncated"] is False
    env.seed(9)
    assert np.array_equal(env.reset(), om.RlVec(om.RlTask("cart-pole"), 4, seed=9).reset())
    assert VecMonitor(env).reset().shape == (4, 4) and env.env_is_wrapped(VecMonitor) == [False] * 4
    assert env.env_is_wrapped(Monitor, [0, 1]) == [True] * 2
    env.close()
    with pytest.raises(om.Closed):
        env.reset()


class Straight:
    """Each axis moves towards the goal of reach, unless it is there."""

    def predict(self, observation, deterministic):
        assert deterministic
        away = observation[:, 3:6] - observation[:, :3]
        return 1 + (away > 0.025).astype(int) - (away < -0.025), None


def test_episodes_from_all_starts():
    """Of reach with steps of 0.05: starts lie on 0, 0.5, 1, the goal in the middle. It counts as reached within 0.075: after 9 steps one
    axis has 0.05 left, sqrt(2) 0.05 = 0.071 with two axes; three axes need the last step."""
    from omentum.sb3 import evaluate_starts
    found = evaluate_starts(Straight(), "reach")
    axes = np.array([sum(k // 3**a % 3 != 1 for a in range(3)) for k in range(27)])
    assert found["reached"].tolist() == [1] * 27
    assert found["length"].tolist() == [{0: 1, 1: 9, 2: 9, 3: 10}[n] for n in axes]
    short = evaluate_starts(Straight(), "reach", fixed_horizon=1)
    assert short["length"].tolist() == [80] * 27 and (short["return"] < found["return"] + 1e-12).all()


def test_ppo_of_stable_baselines3_learns_to_reach():
    """Before and after 20,000 steps, a few seconds: twice as much of the return is gained as is left."""
    import stable_baselines3 as sb3
    import torch

    from omentum.sb3 import VecEnv, evaluate_starts
    torch.set_num_threads(1)
    model = sb3.PPO("MlpPolicy", VecEnv("reach", 16, seed=1), n_steps=64, batch_size=256, n_epochs=4, learning_rate=2e-3, gamma=0.95,
                    policy_kwargs={"net_arch": [64, 64]}, seed=1, device="cpu")
    before = evaluate_starts(model, "reach")["return"].mean()
    model.learn(20_000)
    after = evaluate_starts(model, "reach")
    best = evaluate_starts(Straight(), "reach")["return"].mean()
    print(f"return {before:.1f} before, {after['return'].mean():.1f} after, {best:.1f} at most; reached {after['reached'].mean():.2f}")
    assert after["return"].mean() - before > 2 * (best - after["return"].mean())


def blocks():
    page = pathlib.Path(__file__).resolve().parents[2] / "doc" / "gym.md"
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)


def test_the_lines_that_train_run(tmp_path, monkeypatch):
    """With fewer steps and short episodes. python/examples/ppo_sb3.py has the same settings; test_ppo_learns_to_retract runs it."""
    assert len([line for line in blocks()[1].splitlines() if line.strip()]) == 10
    monkeypatch.chdir(tmp_path)
    code = blocks()[1].replace("100_000", "2048").replace("max_step=700", "max_step=20")
    assert code != blocks()[1]
    names = {}
    exec(compile(code, "gym.md", "exec"), names)
    assert names["model"].num_timesteps == 2048 and names["exposure"].shape == (49,) and (tmp_path / "retract.zip").exists()


def test_pictures_are_those_of_gymnasium():
    import gymnasium

    import omentum.gym  # noqa: F401
    from omentum.sb3 import VecEnv
    env = gymnasium.make("omentum/Retract-v0", picture=1, max_step=3)
    seen = [env.reset(seed=2)[0]] + [env.step([2, 1, 0])[0] for _ in range(3)]
    vec = VecEnv("retract", 2, seed=2, picture=1, max_step=3)
    assert np.array_equal(vec.reset()[0], seen[0])
    for _ in range(3):
        _, _, _, infos = vec.step(np.array([[2, 1, 0]] * 2))
    assert np.array_equal(infos[0]["terminal_observation"], seen[3])
