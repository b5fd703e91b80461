"""Tasks to learn: environments of Gymnasium."""
# PARTS 5
import pathlib
import re
import subprocess
import sys
import warnings

import numpy as np
import pytest

import omentum as om

TASKS = list(om.rl_tasks())


@pytest.fixture(scope="module")
def gym():
    gymnasium = pytest.importorskip("gymnasium")
    import omentum.gym  # noqa: F401
    return gymnasium


def ids():
    return [f"omentum/{''.join(p.capitalize() for p in task.split('-'))}-v0" for task in TASKS]


CHECKED = [pytest.param(name, {}, marks=[pytest.mark.slow] * (name in ("omentum/Expose-v0", "omentum/Retract-v0"))) for name in ids()]
CHECKED.append(("omentum/Retract-v0", {"picture": 1, "picture_side": 48}))


@pytest.mark.parametrize(("name", "settings"), CHECKED)
def test_the_checks_pass_without_warnings(gym, name, settings):
    """Of Gymnasium and of Stable-Baselines3, with their pictures."""
    from gymnasium.utils.env_checker import check_env
    is_drawn = bool(settings) or om.RlTask(gym.spec(name).kwargs["task"]).has_picture
    env = gym.make(name, render_mode="rgb_array" if is_drawn else None, **settings).unwrapped
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        check_env(env)
        try:
            from stable_baselines3.common.env_checker import check_env as check_of_sb3
        except ImportError:
            pass
        else:
            check_of_sb3(env, skip_render_check=not is_drawn)
    assert not [str(w.message) for w in found]
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


def blocks():
    page = pathlib.Path(__file__).resolve().parents[2] / "doc" / "gym.md"
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)


def test_the_lines_of_the_page_run(gym):
    names = {}
    exec(compile(blocks()[0], "gym.md", "exec"), names)
    assert names["picture"].shape == (84, 84, 3) and -1 <= names["reward"] <= 0 and names["envs"].num_envs == 8


def test_pictures_are_observed_as_bytes(gym):
    """The observation is the rendered picture, alone and side by side."""
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


def test_retraction_in_gymnasium(gym):
    env = gym.make("omentum/Retract-v0", render_mode="rgb_array", max_step=60, has_info=True)
    observation, info = env.reset(seed=1, options={"start": 3})
    other, _ = env.reset(seed=2, options={"start": 3})
    assert np.array_equal(observation, other)
    assert set(info) == {"exposure", "grasped", "along", "across", "slips", "inverted", "force", "success"}
    assert env.render().shape == (84, 84, 3)
    for _ in range(60):
        observation, _, terminated, truncated, info = env.step(env.unwrapped.expert())
    assert truncated and not terminated and env.observation_space.contains(observation)
    with pytest.raises(om.Invalid, match="over"):
        env.unwrapped.step(np.zeros(3, int))
    with pytest.raises(ValueError, match="render_mode"):
        type(env.unwrapped)("cart-pole", render_mode="human")
    pictures = gym.make_vec("omentum/Retract-v0", num_envs=2, render_mode="rgb_array")
    pictures.reset(seed=1)
    assert [p.shape for p in pictures.render()] == [(84, 84, 3)] * 2


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


HOOKED = """
import site, sys
site.addsitedir({place!r})                     # as Python treats site-packages at its start
assert "gymnasium" not in sys.modules and "omentum" not in sys.modules
import gymnasium
names = [name for name in gymnasium.registry if name.startswith("omentum/")]
assert "omentum" not in sys.modules            # the names cost no load of the library
env = gymnasium.make("omentum/Reach-v0")
observation, _ = env.reset(seed=3)
envs = gymnasium.make_vec("omentum/Reach-v0", num_envs=2)
print(sorted(names), observation.tolist(), type(envs).__name__)
"""


def test_make_needs_no_import_of_omentum(gym):
    """In a process whose site has the file .pth; the names are those of the library, the environment the same."""
    place = pathlib.Path(om.__file__).resolve().parents[1]
    done = subprocess.run([sys.executable, "-B", "-c", HOOKED.format(place=str(place))], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    here, _ = gym.make("omentum/Reach-v0").reset(seed=3)
    assert done.stdout.strip() == f"{sorted(ids())} {here.tolist()} VectorEnv"


def test_the_entry_point_of_older_gymnasium():
    """What pyproject.toml declares can be called, and calling it again changes nothing."""
    import omentum_gymnasium
    text = (pathlib.Path(om.__file__).resolve().parents[2] / "pyproject.toml").read_text()
    declared = re.search(r'"gymnasium.envs"\]\n__root__ = "(\w+):(\w+)"', text)
    assert callable(getattr(__import__(declared[1]), declared[2])) and sorted(omentum_gymnasium.TASKS) == sorted(TASKS)
    omentum_gymnasium.watch()


def test_both_names_and_success(gym):
    """Of a task and of its environment; a success is a score at the target."""
    assert om.RlTask("omentum/CartPole-v0").name == "cart-pole" and gym.make("omentum/Reach-v0", task="omentum/Reach-v0").unwrapped.task.name == "reach"
    with pytest.raises(om.Invalid, match="did you mean 'Retract'"):
        om.RlTask("omentum/Retrct-v0")
    env = gym.make("omentum/Reach-v0", has_info=True).unwrapped
    env.reset(seed=1)
    _, _, _, _, info = env.step([1, 1, 1])
    assert info == {"reached": 0, "success": 0}
    while not info["success"]:
        _, _, ended, _, info = env.step(env.expert())
        assert info["success"] == info["reached"] == ended
    vec = om.RlVec(om.RlTask("reach"), 4, 1)
    vec.reset()
    for _ in range(90):
        step = vec.step(vec.expert())
        assert np.array_equal(step.final_info["success"], step.final_info["reached"] >= 0.99)


def test_bounds_are_finite_and_hold(gym):
    for name in ids():
        space = gym.make(name).unwrapped.observation_space
        assert np.isfinite([space.low, space.high]).all()
    env = gym.make("omentum/Reach-v0").unwrapped
    observation, _ = env.reset(seed=1)
    for _ in range(50):
        assert observation in env.observation_space
        observation, *_ = env.step(env.action_space.sample())


@pytest.mark.slow
def test_the_force_of_a_lift(gym):
    """The quick test is test_slip of test_rl_retract_grip.c. Elements know it: 0 before the grasp, above the weight of what is lifted after it; clusters do not."""
    assert np.isnan(gym.make("omentum/Retract-v0", has_info=True).unwrapped.reset(seed=1)[1]["force"])
    env = gym.make("omentum/Retract-v0", tissue="elements", has_info=True, repeat=4).unwrapped
    _, info = env.reset(seed=1)
    assert info["force"] == 0
    for _ in range(120):
        *_, info = env.step(env.expert())
        if info["grasped"]:
            break
    for _ in range(6):
        *_, info = env.step([1, 1, 2])
    assert info["grasped"] and 0.005 < info["force"] < 2
