"""Contact of tissue with a board, with itself, and of bodies with each other; bonds."""
import pickle

import numpy as np
import pytest

import omentum as om

FLOOR = [((0, 0, 0), (0, 0, 1))]


def blocks(gap=0.002, **options):
    """A small block above a larger one; body 0 is the lower one."""
    low = om.TetMesh.box((0.04, 0.04, 0.02), (4, 4, 2))
    high = om.TetMesh.box((0.02, 0.02, 0.02), (2, 2, 2), (0.011, 0.009, 0.02 + gap))
    mesh = low.joined(high)
    return om.Tissue(mesh, element="linear", solver={"nworker": 1, "tolerance": 1e-4}, **options), low, high


def test_a_block_rests_on_another(alive):
    tissue, low, high = blocks()
    contact = om.Contact(tissue, FLOOR, self_contact=True, self_friction=0.3)
    assert set(contact.body[:len(low.x)]) == {0} and set(contact.body[len(low.x):]) == {1}
    for _ in range(60):
        report = contact.step(0.02)
    weight = 1000 * high.volume * 9.81
    assert contact.body_force(1, 0)[2] == pytest.approx(weight, rel=1e-2)
    assert contact.body_force(0, 1) == pytest.approx(-contact.body_force(1, 0))
    assert report.ntouch > 0 and report.vert.shape == report.weight.shape == (report.ntouch, 4)
    assert np.abs(report.weight.sum(axis=1)).max() < 1e-12
    assert sorted(set(report.body.ravel())) == [0, 1]
    sign = np.where(report.body[:, 0] == 1, 1, -1)
    assert (sign[:, None] * report.touch_force).sum(axis=0) == pytest.approx(contact.body_force(1, 0))
    assert report.force[2] == pytest.approx(weight + 1000 * low.volume * 9.81, rel=1e-2)
    assert report.self_penetration < 1e-5 and report.is_settled
    assert contact.find_crossing()[0] == 0
    tissue.set_x(np.where(contact.body[:, None] == 1, tissue.x - [0, 0, 0.01], tissue.x))
    number, at = contact.find_crossing()
    assert number > 0 and 0 < at[2] < 0.03


def test_without_self_contact(alive):
    tissue, *_ = blocks()
    contact = om.Contact(tissue, FLOOR)
    assert contact.step(0.02).ntouch == 0
    assert set(contact.body) == {-1}
    with pytest.raises(om.Unavailable):
        contact.find_crossing()
    with pytest.raises(om.Invalid, match="self_friction"):
        om.Contact(tissue, self_contact=True, self_friction=-1)


def test_a_skin_carries_a_sheet(alive):
    """A sheet on a block whose skin is 1 mm higher than its mesh: it rests at the skin, and the block feels it."""
    block = om.TetMesh.box((0.04, 0.04, 0.02), (4, 4, 2))
    sheet = om.TetMesh.box((0.02, 0.02, 0.004), (4, 4, 1), (0.01, 0.01, 0.0212))
    higher = om.TetMesh.box((0.04, 0.04, 0.021), (1, 1, 1)).boundary()[0]
    block.sets["attachment"] = np.flatnonzero(block.x[:, 2] < 1e-6)
    tissue = om.Tissue(sheet.joined(block), element="linear", nown=len(sheet.x), solver={"nworker": 1})
    end = len(sheet.x) + len(block.x)
    skin = om.Skin(higher, (len(sheet.x), end), 0.001)
    contact = om.Contact(tissue, skins=[skin], friction=0.3)
    for _ in range(40):
        report = contact.step(0.02)
    weight = 1000 * sheet.volume * 9.81
    assert contact.body_force(0, 1)[2] == pytest.approx(weight, rel=1e-2)
    under = tissue.x[:len(sheet.x)][sheet.x[:, 2] < 0.0213, 2]
    top = tissue.x[len(sheet.x):][(block.x == [0.02, 0.02, 0.02]).all(axis=1), 2]
    assert under.mean() == pytest.approx(top[0] + 0.001, abs=1e-4)  # the block has sunk by its weight
    assert report.self_penetration < 1e-5 and report.ntouch > 10
    with pytest.raises(om.Invalid, match="skin"):
        om.Contact(tissue, skins=[om.Skin(higher, (0, end + 1), 0.001)])


def test_bonds_hold_a_body(alive):
    """A block hangs on another one, which is held; the tissue is pickled with its bonds."""
    held = om.TetMesh.box((0.02, 0.02, 0.01), (2, 2, 1), (0, 0, 0.02))
    hung = om.TetMesh.box((0.02, 0.02, 0.02), (2, 2, 2))
    held.sets["attachment"] = np.arange(len(held.x))
    mesh = held.joined(hung)
    assert mesh.sets["attachment"].tolist() == list(range(len(held.x)))
    top = len(held.x) + np.flatnonzero(hung.x[:, 2] > 0.0199)
    tissue = om.Tissue(mesh, element="linear", bonds=[(top, (0, len(held.tet)), 5.0)])
    tissue = pickle.loads(pickle.dumps(tissue))
    tissue.find_rest()
    weight = 1000 * hung.volume * 9.81
    down = mesh.x[top, 2] - tissue.x[top, 2]
    assert (5.0 * down).sum() == pytest.approx(weight, rel=1e-4)
    assert tissue.energy().spring > 0
    with pytest.raises(om.Invalid, match="other body"):
        om.Tissue(mesh, element="linear", bonds=[([0], (0, len(held.tet)), 5.0)])
