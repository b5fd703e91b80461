"""PPO of Stable-Baselines3 on the task retract: a second source for the figures of omentum's own PPO.

    python3 ppo_sb3.py                             # settings of weights/README.md, 100,352 steps
    python3 ppo_sb3.py --seed 2 --steps 50000

Prints the exposure of the tumour from the 7 x 7 starts with moves of 0.5 mm, as `omentum rl eval -t retract -s max_step=700`.
"""
import argparse
import time

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from omentum.sb3 import VecEnv, evaluate_starts


def train(steps, seed, clip_reward=10, **settings):
    """PPO with the settings of retract_ppo.safetensors; rewards are divided by the deviation of their discounted sum, and clipped."""
    env = VecNormalize(VecEnv("retract", 16, seed=seed, move_mm=2, max_step=150, **settings), norm_obs=False, clip_reward=clip_reward)
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=128, n_epochs=10, gamma=0.99, gae_lambda=0.95, ent_coef=5e-3, clip_range=0.2,
                clip_range_vf=0.2, learning_rate=lambda left: 1e-3 * left, policy_kwargs={"net_arch": [128, 128]}, seed=seed, device="cpu")
    return model.learn(steps)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--reward", default="exposure", help="exposure or thesis")
    parser.add_argument("--clip-reward", type=float, default=10, help="limit of a divided reward, or inf")
    parser.add_argument("--output", help="file of the model")
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    begin = time.process_time()
    model = train(options.steps, options.seed, options.clip_reward, reward=options.reward)
    done = time.process_time()
    if options.output:
        model.save(options.output)
    recent = [episode["r"] for episode in model.ep_info_buffer]
    print(f"mean return of the last {len(recent)} episodes of training: {sum(recent) / max(1, len(recent)):.2f}")
    exposure = evaluate_starts(model, "retract", max_step=700)["exposure"]
    print("\n".join(" ".join(f"{value:5.2f}" for value in row) for row in exposure.reshape(7, 7)))
    print(f"{model.num_timesteps} steps, {done - begin:.0f} s of processor time: mean TE {exposure.mean():.3f}, lowest {exposure.min():.2f}")
    return exposure


if __name__ == "__main__":
    main()
