"""Tasks to learn: environments from NumPy, of Gymnasium, and for Stable-Baselines3."""
import warnings

import numpy as np
import pytest

import omentum as om

TASKS = list(om.rl_tasks())


def run(vec, nstep, seed=3):
    rng = np.random.default_rng(seed)
    return [vec.step(rng.integers(0, vec.task.nchoice, (vec.nenv, len(vec.task.nchoice)))) for _ in range(nstep)]


def same(a, b):
    return all(np.array_equal(x.observation, y.observation) and np.array_equal(x.reward, y.reward) and np.array_equal(x.terminated, y.terminated)
               for x, y in zip(a, b))


# ---- NumPy alone ----


@pytest.mark.parametrize("name", TASKS)
def test_environments_do_not_depend_on_threads(name, alive):
    task = om.RlTask(name)
    runs = []
    for nworker in (1, 3):
        vec = om.RlVec(task, 5, seed=7, nworker=nworker)
        first = vec.reset()
        assert first.shape == (5, task.nobservation) and first.dtype == np.float32 and np.isfinite(first).all()
        runs.append(run(vec, 120))
    assert same(*runs)
    half = vec.snapshot()
    onwards = run(vec, 30, 9)
    vec.restore(half)
    assert same(run(vec, 30, 9), onwards)
    with pytest.raises(ValueError, match="snapshot"):
        vec.restore(half[:-1])
    vec.close()
    with pytest.raises(om.Closed):
        vec.reset()
    del vec, task, runs, onwards
    assert alive() == 0


def test_a_cycle_is_freed_users_first(alive):
    """The garbage collector finalises a cycle oldest first; a vector of environments needs its task until it is destroyed."""
    import gc

    from omentum._lib import Handle
    order = []
    task = Handle("task", order.append)
    vec = Handle("vec", order.append, task)
    view = Handle("view", order.append, vec, task)
    cycle = [task, vec, view]
    cycle.append(cycle)
    del task, vec, view, cycle
    gc.collect()
    assert order == ["view", "vec", "task"]
    task = om.RlTask("cart-pole")
    cycle = [task, om.RlVec(task, 2)]
    cycle.append(cycle)
    del task, cycle
    assert alive() == 0


def test_a_cart_falls_and_the_next_one_begins():
    """Physics of a cart with a pole, written anew: gravity 9.8, a rod of 1 m, 10 N, 20 ms, as in the textbook."""
    vec = om.RlVec(om.RlTask("cart-pole"), 1, seed=2)
    x, v, angle, rate = vec.reset()[0].astype(float)
    for length in range(1, 60):
        step = vec.step([[1]])
        sine, cosine = np.sin(angle), np.cos(angle)
        push = (10 + 0.05 * rate**2 * sine) / 1.1
        turn = (9.8 * sine - cosine * push) / (0.5 * (4 / 3 - 0.1 * cosine**2 / 1.1))
        x, v, angle, rate = x + 0.02 * v, v + 0.02 * (push - 0.05 * turn * cosine / 1.1), angle + 0.02 * rate, rate + 0.02 * turn
        if step.terminated[0]:
            break
        assert step.observation[0] == pytest.approx([x, v, angle, rate], rel=1e-4, abs=1e-5)
    assert 5 < length < 20 and step.final_length[0] == length and step.final_return[0] == length
    assert step.final_observation[0] == pytest.approx([x, v, angle, rate], rel=1e-4, abs=1e-5) and abs(angle) > np.radians(12)
    assert np.abs(step.observation).max() <= 0.05  # a new episode


def test_wrong_tasks_settings_and_actions_are_named():
    with pytest.raises(om.Invalid, match="retract"):
        om.RlTask("retrakt")
    with pytest.raises(om.Invalid, match="rewart"):
        om.RlTask("retract", rewart="thesis")
    vec = om.RlVec(om.RlTask("reach"), 2)
    with pytest.raises(om.Invalid, match="reset"):
        vec.step(np.zeros((2, 3)))
    vec.reset()
    with pytest.raises(om.Invalid, match=r"action\[1\] is 3"):
        vec.step([[0, 0, 0], [0, 3, 0]])
    with pytest.raises(om.Invalid, match="start"):
        vec.reset_one(0, 1000)
    once = om.RlVec(om.RlTask("cart-pole"), 1, has_autoreset=False)
    once.reset()
    while not once.step([[0]]).terminated[0]:
        pass
    with pytest.raises(om.Invalid, match="over"):
        once.step([[0]])


def test_the_expert_lifts_the_fat():
    """Straight to p_T after the grasp: the tumour is seen, and fat is held. Rewards of the thesis are in [-1, 0]."""
    vec = om.RlVec(om.RlTask("retract", reward="thesis", points=4, repeat=4), 1, seed=4)
    assert vec.task.nobservation == 12 + 3 * 4 and vec.task.nstart == 49
    before = vec.reset()[0]
    assert before[11] == 0
    for _ in range(vec.task.max_step):
        step = vec.step(vec.expert())
        assert -1.0001 * 4 <= step.reward[0] <= 0
        if step.terminated[0]:
            break
    assert step.final_info["grasped"][0] == 1 and step.final_info["exposure"][0] > 0.5
    assert step.final_observation[0, 11] == 1 and step.final_observation[0, 10] < 0.03  # at p_T
    picture = vec.render()
    assert picture.shape == (84, 84, 3) and picture.std() > 10


# ---- Gymnasium ----


@pytest.fixture(scope="module")
def gym():
    gymnasium = pytest.importorskip("gymnasium")
    import omentum.gym  # noqa: F401
    return gymnasium


def ids():
    return [f"omentum/{''.join(p.capitalize() for p in task.split('-'))}-v0" for task in TASKS]


CHECKED = [(name, {}) for name in ids()] + [("omentum/Retract-v0", {"picture": 1, "picture_side": 48})]


@pytest.mark.parametrize(("name", "settings"), CHECKED)
def test_the_checks_pass_without_warnings(gym, name, settings):
    """Of Gymnasium and of Stable-Baselines3, with their pictures; observations of numbers have no bounds, which Gymnasium mentions."""
    from gymnasium.utils.env_checker import check_env
    has_picture = om.RlTask(gym.spec(name).kwargs["task"], **settings).has_picture
    env = gym.make(name, render_mode="rgb_array" if has_picture else None, **settings).unwrapped
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        check_env(env)
        try:
            from stable_baselines3.common.env_checker import check_env as check_of_sb3
        except ImportError:
            pass
        else:
            check_of_sb3(env, skip_render_check=not has_picture)
    said = [str(w.message) for w in found if "infinity. This is probably" not in str(w.message)]
    assert not said and len(found) == (0 if settings else 2)
    env.close()


def same_infos(ours, theirs):
    assert set(ours) == set(theirs)
    for key, value in theirs.items():
        if isinstance(value, dict):
            same_infos(ours[key], value)
        elif key == "final_obs":
            assert np.array_equal(ours[key][0], value[0])
        else:
            assert np.array_equal(ours[key], value) and ours[key].dtype == value.dtype, key


@pytest.mark.parametrize("mode", ["SameStep", "NextStep", "Disabled"])
@pytest.mark.parametrize("has_info", [False, True])
def test_the_native_vector_is_as_gymnasiums_own(gym, mode, has_info):
    """One environment: values, ends and infos of every step are those of SyncVectorEnv in the same mode."""
    mode = gym.vector.AutoresetMode(mode)
    ours = gym.make_vec("omentum/Reach-v0", num_envs=1, has_info=has_info, autoreset_mode=mode, step=0.2)
    theirs = gym.make_vec("omentum/Reach-v0", num_envs=1, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, has_info=has_info,
                          step=0.2)
    assert ours.metadata == theirs.metadata and ours.metadata["autoreset_mode"] == mode
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    a, b = ours.reset(seed=4), theirs.reset(seed=4)
    rng, ends = np.random.default_rng(1), 0
    for _ in range(300):
        assert np.array_equal(a[0], b[0]) and a[0].dtype == b[0].dtype
        same_infos(a[-1], b[-1])
        if len(a) == 5:
            assert all(np.array_equal(x, y) and x.dtype == y.dtype for x, y in zip(a[1:4], b[1:4]))
            ended = a[2] | a[3]
            ends += ended[0]
            if ended[0] and mode == gym.vector.AutoresetMode.DISABLED:
                a, b = ours.reset(options={"reset_mask": ended}), theirs.reset(options={"reset_mask": ended})
                continue
        action = rng.integers(0, 3, (1, 3))
        a, b = ours.step(action), theirs.step(action)
    assert ends > 5
    ours.close()
    theirs.close()


def test_wrappers_of_gymnasium_take_the_native_vector(gym):
    from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics
    env = NormalizeObservation(RecordEpisodeStatistics(gym.make_vec("omentum/Reach-v0", num_envs=4, autoreset_mode="NextStep", step=0.1)))
    env.reset(seed=1)
    for _ in range(400):
        observation, _, _, _, infos = env.step(env.unwrapped.expert())
    assert env.env.episode_count > 40 and np.abs(observation).max() < 10 and max(env.env.length_queue) < 40


def test_some_environments_begin_others_go_on(gym):
    env = gym.make_vec("omentum/Reach-v0", num_envs=3, has_info=True)
    with pytest.raises(ValueError, match="first reset"):
        env.reset(options={"reset_mask": np.array([True, False, True])})
    env.reset(seed=1)
    before = env.step(np.full((3, 3), 2))[0]
    mask = np.array([True, False, False])
    options = {"reset_mask": mask, "start": [5, 7, 7]}
    after, infos = env.reset(options=options)
    assert np.array_equal(after[1:], before[1:]) and np.array_equal(infos["_reached"], mask) and "reset_mask" in options
    one = gym.make("omentum/Reach-v0")
    one.reset(seed=1)
    assert np.array_equal(after[0], one.reset(options={"start": 5})[0]) and after[0, :3].tolist() == [1, 0.5, 0]
    with pytest.raises(ValueError, match="reset_mask"):
        env.reset(options={"reset_mask": [0, 1, 1]})
    with pytest.raises(ValueError, match="seed"):
        env.reset(seed=3, options={"reset_mask": mask})


def test_pictures_are_observed_as_bytes(gym):
    """The observation is the rendered picture, alone, side by side, and for Stable-Baselines3."""
    env = gym.make("omentum/Retract-v0", picture=1, max_step=3, render_mode="rgb_array")
    assert env.observation_space == gym.spaces.Box(0, 255, (84, 84, 3), np.uint8)
    seen = [env.reset(seed=2)[0]]
    assert np.array_equal(seen[0], env.render()) and seen[0].std() > 10
    for _ in range(3):
        seen.append(env.step([2, 1, 0])[0])
        assert np.array_equal(seen[-1], env.render())
    assert not np.array_equal(seen[0], seen[2])
    many = gym.make_vec("omentum/Retract-v0", num_envs=2, picture=1, max_step=3, render_mode="rgb_array")
    assert np.array_equal(many.reset(seed=2)[0][0], seen[0])
    for k in range(1, 4):
        observation, _, _, _, infos = many.step([[2, 1, 0]] * 2)
        assert np.array_equal(observation, np.array(many.render())) and observation.dtype == np.uint8
        assert k == 3 or np.array_equal(observation[0], seen[k])
    assert np.array_equal(infos["final_obs"][0], seen[3])
    pytest.importorskip("stable_baselines3")
    from omentum.sb3 import VecEnv
    vec = VecEnv("retract", 2, seed=2, picture=1, max_step=3)
    assert np.array_equal(vec.reset()[0], seen[0])
    for _ in range(3):
        _, _, _, infos = vec.step(np.array([[2, 1, 0]] * 2))
    assert np.array_equal(infos[0]["terminal_observation"], seen[3])


def test_one_environment_is_environment_0_of_the_vector(gym):
    """The same seed and actions: the same episodes, by make and by make_vec; final_obs is what the single one saw last."""
    one, many = gym.make("omentum/CartPole-v0"), gym.make_vec("omentum/CartPole-v0", num_envs=3)
    assert type(many).__name__ == "VectorEnv" and many.metadata["autoreset_mode"] == gym.vector.AutoresetMode.SAME_STEP
    a, _ = one.reset(seed=5)
    b, _ = many.reset(seed=5)
    assert np.array_equal(a, b[0]) and b.shape == (3, 4) and many.observation_space.contains(b)
    ends = 0
    for t in range(200):
        action = np.array([t % 2, 1, 0])[:, None]
        a, reward, terminated, truncated, info = one.step(action[0])
        b, rewards, terminations, truncations, infos = many.step(action)
        assert reward == rewards[0] and terminated == terminations[0] and truncated == truncations[0]
        if terminated:
            ends += 1
            assert np.array_equal(infos["final_obs"][0], a) and infos["_final_obs"][0]
            a, _ = one.reset()
        assert np.array_equal(a, b[0])
        with pytest.raises((ValueError, AssertionError)):
            many.step(np.full((3, 1), 9))
    assert ends > 1
    again, _ = one.reset(seed=5)
    assert np.array_equal(again, one.reset(seed=5)[0])
    with pytest.raises(ValueError, match="one seed"):
        many.reset(seed=[1, 2, 3])
    many.close()


def test_retraction_in_gymnasium(gym):
    env = gym.make("omentum/Retract-v0", render_mode="rgb_array", max_step=60, has_info=True)
    observation, info = env.reset(seed=1, options={"start": 3})
    other, _ = env.reset(seed=2, options={"start": 3})
    assert np.array_equal(observation, other)
    assert set(info) == {"exposure", "grasped", "along", "across", "slips", "inverted"}
    assert env.render().shape == (84, 84, 3)
    for _ in range(60):
        observation, _, terminated, truncated, info = env.step(env.unwrapped.expert())
    assert truncated and not terminated and env.observation_space.contains(observation)
    with pytest.raises(om.Invalid, match="over"):
        env.unwrapped.step(np.zeros(3, int))
    with pytest.raises(ValueError, match="render_mode"):
        type(env.unwrapped)("retract", render_mode="human")
    pictures = gym.make_vec("omentum/Retract-v0", num_envs=2, render_mode="rgb_array")
    pictures.reset(seed=1)
    assert [p.shape for p in pictures.render()] == [(84, 84, 3)] * 2


def blocks():
    import pathlib
    import re
    page = pathlib.Path(__file__).resolve().parents[2] / "doc" / "gym.md"
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)


def test_the_lines_of_the_page_run(gym):
    names = {}
    exec(compile(blocks()[0], "gym.md", "exec"), names)
    assert names["picture"].shape == (84, 84, 3) and -1 <= names["reward"] <= 0 and names["envs"].num_envs == 8


# ---- Stable-Baselines3 ----


def test_the_vector_of_stable_baselines3(gym):
    pytest.importorskip("stable_baselines3")
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


def test_episodes_from_all_starts(gym):
    """Of reach with steps of 0.05: starts lie on 0, 0.5, 1, the goal in the middle. It counts as reached within 0.075: after 9 steps one
    axis has 0.05 left, sqrt(2) 0.05 = 0.071 with two axes; three axes need the last step."""
    pytest.importorskip("stable_baselines3")
    from omentum.sb3 import evaluate_starts
    found = evaluate_starts(Straight(), "reach")
    axes = np.array([sum(k // 3**a % 3 != 1 for a in range(3)) for k in range(27)])
    assert found["reached"].tolist() == [1] * 27
    assert found["length"].tolist() == [{0: 1, 1: 9, 2: 9, 3: 10}[n] for n in axes]
    short = evaluate_starts(Straight(), "reach", fixed_horizon=1)
    assert short["length"].tolist() == [80] * 27 and (short["return"] < found["return"] + 1e-12).all()


def test_ppo_of_stable_baselines3_learns_to_reach(gym):
    """Before and after 20,000 steps, a few seconds: twice as much of the return is gained as is left."""
    torch = pytest.importorskip("torch")
    sb3 = pytest.importorskip("stable_baselines3")

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


def test_the_lines_that_train_run(gym, tmp_path, monkeypatch):
    """With fewer steps and short episodes. python/examples/ppo_sb3.py has the same settings; test_slow_sb3 runs it."""
    pytest.importorskip("stable_baselines3")
    assert len([line for line in blocks()[1].splitlines() if line.strip()]) == 10
    monkeypatch.chdir(tmp_path)
    code = blocks()[1].replace("100_000", "2048").replace("max_step=700", "max_step=20")
    assert code != blocks()[1]
    names = {}
    exec(compile(code, "gym.md", "exec"), names)
    assert names["model"].num_timesteps == 2048 and names["exposure"].shape == (49,) and (tmp_path / "retract.zip").exists()
