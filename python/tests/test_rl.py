"""Tasks to learn: environments from NumPy."""
# PARTS 3
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
