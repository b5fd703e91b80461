"""BC and GAIL of the package imitation 1.0.1 on demonstrations of `omentum rl demo`, as a second source for omentum's own.

    tools/python_env.sh python/requirements_imitation.txt build/python_imitation
    omentum rl demo -t reach -s fixed_horizon=1 -n 35 -o demos.hdf5
    OM_PYTHON=build/python_imitation tools/python_run.sh python/examples/gail_imitation.py reach demos.hdf5

GAIL there wants episodes of one length: demonstrations and training have fixed_horizon=1. The evaluation has not.
"""
import argparse
import time

import h5py
import numpy as np
import torch
from imitation.algorithms.adversarial.gail import GAIL
from imitation.algorithms.bc import BC
from imitation.data.types import Trajectory
from imitation.rewards.reward_nets import BasicRewardNet
from imitation.util import logger
from imitation.util.networks import RunningNorm
from stable_baselines3 import PPO

from omentum.sb3 import VecEnv, evaluate_starts


def read_demos(path):
    """Trajectories of a file in the layout of robomimic. It has no observation behind the last action, so that action is left out."""
    trajectories = []
    with h5py.File(path, "r") as file:
        for k in range(len(file["data"])):
            demo = file[f"data/demo_{k}"]
            actions = np.asarray(demo["actions"], np.int64)[:-1]
            trajectories.append(Trajectory(np.asarray(demo["obs/state"]), actions, None, terminal=False))
    return trajectories


def clone(model, demos, epochs, seed):
    """Behaviour cloning of the model's policy."""
    env = model.get_env()
    BC(observation_space=env.observation_space, action_space=env.action_space, rng=np.random.default_rng(seed), policy=model.policy,
       demonstrations=demos, batch_size=64, optimizer_kwargs={"lr": 1e-3}, device="cpu",
       custom_logger=logger.configure(None, [])).train(n_epochs=epochs, progress_bar=False)


def imitate(model, demos, steps):
    """GAIL: the model's PPO is rewarded by a discriminator of observation and action."""
    env = model.get_env()
    reward = BasicRewardNet(env.observation_space, env.action_space, normalize_input_layer=RunningNorm)
    trainer = GAIL(demonstrations=demos, demo_batch_size=512, n_disc_updates_per_round=8, venv=env, gen_algo=model, reward_net=reward,
                   custom_logger=logger.configure(None, []))
    trainer.train(steps)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task")
    parser.add_argument("demos", help="HDF5 of omentum rl demo, of the same task and settings")
    parser.add_argument("-s", "--set", action="append", default=[], metavar="KEY=VALUE", help="a setting of the task in training")
    parser.add_argument("-e", "--eval-set", action="append", default=[], metavar="KEY=VALUE", help="a setting of the task in the evaluation")
    parser.add_argument("--steps", type=int, default=80_000, help="of GAIL")
    parser.add_argument("--rate", type=float, default=1e-3, help="learning rate of PPO")
    parser.add_argument("--clone-epochs", type=int, default=0, help="of behaviour cloning before GAIL")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    torch.manual_seed(options.seed)
    np.random.seed(options.seed)
    training = dict(item.split("=", 1) for item in options.set)
    env = VecEnv(options.task, 16, seed=options.seed, fixed_horizon=1, **training)
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=128, n_epochs=10, gamma=0.99, gae_lambda=0.95, ent_coef=5e-3, clip_range=0.2,
                learning_rate=options.rate, policy_kwargs={"net_arch": [128, 128]}, seed=options.seed, device="cpu")
    demos = read_demos(options.demos)
    score, figures, begin = env.task.score_name or "return", {}, time.process_time()
    for method in ["BC"] * (options.clone_epochs > 0) + ["GAIL"] * (options.steps > 0):
        if method == "BC":
            clone(model, demos, options.clone_epochs, options.seed)
        else:
            imitate(model, demos, options.steps)
        seconds = time.process_time() - begin
        found = evaluate_starts(model, options.task, **dict(item.split("=", 1) for item in options.eval_set))
        figures[method] = found[score]
        print(f"{method}: {score} {found[score].mean():.3f}, lowest {found[score].min():.2f}, {found['length'].mean():.1f} steps; "
              f"{len(demos)} demonstrations, {seconds:.0f} s of processor time", flush=True)
        begin = time.process_time()
    return figures


if __name__ == "__main__":
    main()
