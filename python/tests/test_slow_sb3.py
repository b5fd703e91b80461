"""PPO of Stable-Baselines3 learns on the native environments: a second source for the figures of omentum's own PPO."""
import json
import os
import pathlib
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
