#!/usr/bin/env python3
"""The numbers of test/rl/rl_sb3_numbers.inc: one descent of PPO by Stable-Baselines3 on a batch made by formulas.

    tools/rl_sb3_numbers.py > test/rl/rl_sb3_numbers.inc

Needs stable-baselines3 (2.9.2 was used), gymnasium and torch. The formulas are those of test/rl/test_rl_ppo.c.
"""
import gymnasium
import numpy as np
import stable_baselines3
import torch
from stable_baselines3.common.buffers import RolloutBuffer

NOBS, NWIDTH, N, NENV = 7, 16, 48, 4
CHOICES = [3, 2, 4]


class Task(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-10, 10, (NOBS,), np.float32)
    action_space = gymnasium.spaces.MultiDiscrete(CHOICES)

    def reset(self, seed=None, options=None):
        return np.zeros(NOBS, np.float32), {}

    def step(self, action):
        return np.zeros(NOBS, np.float32), 0.0, False, False, {}


def wave(n, a, b, scale):
    return (scale * np.sin(a + b * np.arange(n, dtype=np.float64))).astype(np.float32)


def set_weights(policy):
    """Layer by layer: actor 0, 1, head, then critic 0, 1, head; weight, bias."""
    e = policy.mlp_extractor
    layers = [e.policy_net[0], e.policy_net[2], policy.action_net, e.value_net[0], e.value_net[2], policy.value_net]
    with torch.no_grad():
        for k, layer in enumerate(layers):
            w = wave(layer.weight.numel(), k, 0.7, 0.3)
            layer.weight.copy_(torch.from_numpy(w).reshape(layer.weight.shape))
            layer.bias.copy_(torch.from_numpy(wave(layer.bias.numel(), k + 0.5, 1.3, 0.1)))
    return layers


def gradients(layers):
    """Of the actor, then of the critic, flat: weight and bias of each layer."""
    flat = [np.concatenate([np.concatenate([l.weight.grad.numpy().ravel(), l.bias.grad.numpy().ravel()])
                            for l in layers[3 * k:3 * k + 3]]) for k in range(2)]
    return flat


def descend(clip_value, max_norm, normalise):
    ppo = stable_baselines3.PPO(
        "MlpPolicy", stable_baselines3.common.env_util.make_vec_env(Task, n_envs=1), n_steps=N, batch_size=N, n_epochs=1,
        clip_range=0.2, clip_range_vf=clip_value or None, ent_coef=0.01, vf_coef=0.5, max_grad_norm=max_norm,
        learning_rate=1e-3, normalize_advantage=normalise, device="cpu",
        policy_kwargs={"net_arch": {"pi": [NWIDTH, NWIDTH], "vf": [NWIDTH, NWIDTH]}, "activation_fn": torch.nn.Tanh})
    layers = set_weights(ppo.policy)
    b = ppo.rollout_buffer
    b.reset()
    b.observations = wave(N * NOBS, 0.2, 0.9, 1.0).reshape(N, 1, NOBS)
    action = np.array([[(3 * i + k) % c for k, c in enumerate(CHOICES)] for i in range(N)], np.float32)
    b.actions = action.reshape(N, 1, len(CHOICES))
    b.values = wave(N, 0.4, 1.1, 0.5).reshape(N, 1)
    b.log_probs = (-3.2 + wave(N, 0.6, 1.7, 0.3)).astype(np.float32).reshape(N, 1)
    b.advantages = wave(N, 0.8, 2.1, 1.5).reshape(N, 1)
    b.returns = wave(N, 1.0, 2.7, 1.2).reshape(N, 1)
    b.full, b.pos, b.generator_ready = True, N, False
    ppo._logger = stable_baselines3.common.logger.configure(None, [])
    ppo.train()
    v = ppo.logger.name_to_value
    losses = [v["train/policy_gradient_loss"], v["train/value_loss"], -v["train/entropy_loss"], v["train/approx_kl"],
              v["train/clip_fraction"]]
    after = [float(layers[0].weight[0, 0]), float(layers[5].bias[0])]
    return losses, gradients(layers), after


def gae():
    b = RolloutBuffer(N // NENV, Task.observation_space, gymnasium.spaces.Discrete(2), "cpu", gae_lambda=0.9, gamma=0.95,
                      n_envs=NENV)
    n = N // NENV
    b.reset()
    b.rewards = wave(N, 0.3, 0.8, 1.0).reshape(n, NENV)
    b.values = wave(N, 0.7, 0.6, 0.8).reshape(n, NENV)
    end = np.array([i % 7 == 3 for i in range(N)], np.float32).reshape(n, NENV)  # the episode ended after the step
    b.episode_starts = np.vstack([np.zeros((1, NENV), np.float32), end[:-1]])
    b.compute_returns_and_advantage(torch.from_numpy(wave(NENV, 0.9, 0.5, 0.7)), end[-1])
    return b.advantages.ravel(), b.returns.ravel()


def show(name, values):
    text = ", ".join(f"{float(x):.9g}" for x in values)
    lines, line = [], "   "
    for word in text.split(" "):
        if len(line) + len(word) + 1 > 100:
            lines.append(line)
            line = "   "
        line += " " + word
    lines.append(line)
    print(f"static const double {name}[{len(values)}] = {{")
    print("\n".join(lines) + "};")


def main():
    print(f"// Made by tools/rl_sb3_numbers.py with stable-baselines3 {stable_baselines3.__version__}, "
          f"torch {torch.__version__.split('+')[0]}.")
    for k, case in enumerate([(0.0, 1e9, False), (0.2, 1e9, True), (0.2, 0.1, True)]):
        losses, grad, after = descend(*case)
        show(f"loss_{k}", losses)
        show(f"actor_{k}", grad[0][::5])
        show(f"critic_{k}", grad[1][::5])
        show(f"after_{k}", after)
    advantage, target = gae()
    show("gae_advantage", advantage)
    show("gae_target", target)


main()
