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


@pytest.mark.parametrize("name", ids())
def test_the_check_of_gymnasium_passes(gym, name):
    from gymnasium.utils.env_checker import check_env
    env = gym.make(name, render_mode="rgb_array" if om.RlTask(gym.spec(name).kwargs["task"]).has_picture else None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # observations without bounds
        check_env(env.unwrapped)
    env.close()


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
    assert np.array_equal(observation, other) and set(info) == {"exposure", "grasped", "along", "across"}
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


def test_the_check_of_stable_baselines3_passes(gym):
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_checker import check_env
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in ids():
            check_env(gym.make(name).unwrapped, skip_render_check=True)


def test_the_vector_of_stable_baselines3(gym):
    pytest.importorskip("stable_baselines3")
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
    env.close()
    with pytest.raises(om.Closed):
        env.reset()


def test_the_lines_that_train_run(gym, tmp_path, monkeypatch):
    """With fewer steps and short episodes; the full number is a matter of an hour."""
    pytest.importorskip("stable_baselines3")
    assert len([line for line in blocks()[1].splitlines() if line.strip()]) == 10
    monkeypatch.chdir(tmp_path)
    code = blocks()[1].replace("200_000", "2048").replace("repeat=4", "repeat=4, max_step=40")
    names = {}
    exec(compile(code, "gym.md", "exec"), names)
    assert np.isfinite(names["mean"]) and names["model"].num_timesteps == 2048
