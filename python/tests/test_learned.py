"""Trained networks: against samples of the simulation, and what the physics prescribes."""
import ctypes
import pathlib

import numpy as np
import pytest

import omentum as om


def test_samples_of_banet_and_what_the_network_says(is_slow):
    """Samples of a seed that no training has. The thesis has a mean Dice coefficient of 0.82 on such samples."""
    index, seed = (3, 909) if is_slow else (2, 910)
    sample = om.make_banet_sample(index, seed, way="exact")
    same = om.make_banet_sample(index, seed, way="exact")
    assert np.array_equal(sample.u, same.u) and sample.attached.any()
    moved = np.linalg.norm(sample.u, axis=1)
    assert moved[sample.attached].max() < 1e-6 < moved.max()
    net, dice = om.BanetNet.load(), []
    for i in range(4 if is_slow else 1):
        sample = om.make_banet_sample(i, 910, way="exact") if is_slow else same
        found = net.attached(net.estimate(sample.surface, sample.u, sample.seen))
        dice.append(2 * (found & sample.attached).sum() / (found.sum() + sample.attached.sum()))
    assert np.mean(dice) > 0.6
    # 2 S / (n + all): 1.8 / 3.1 for two, 2.0 / 4.1 for three
    assert om.BanetNet.attached([0.9, 0.0, 0.9, 0.1, 0.1, 0.1]).tolist() == [True, False, True, False, False, False]
    with pytest.raises(ValueError, match="shape"):
        net.estimate(sample.surface, sample.u[:5], sample.seen)
    net.close()
    with pytest.raises(om.Closed):
        net.estimate(sample.surface, sample.u, sample.seen)


def press_with(net, error):
    """10 mm of press; `error`: of the network alone, m."""
    top = net.x[net.x[:, 2].argmax()]
    mask = net.patch(top)
    assert 3 < mask.sum() < 100 and net.is_surface[mask].all()
    push = np.zeros_like(net.x)
    push[mask] = (0, 0, -0.01)
    u, trust = net.predict(mask, push)
    assert trust.is_inside and trust.score <= 1
    assert u[mask] == pytest.approx(push[mask], abs=1e-7)
    assert np.abs(u[net.x[:, 2] < 1e-6]).max() == 0  # the flat side is held
    alone, _ = net.predict(mask, push, max_cycle=0)
    assert np.linalg.norm(alone - u, axis=1).mean() < error
    push[mask] = (0, 0, 0.2)
    _, far = net.predict(mask, push, max_cycle=0)
    assert not far.is_inside and far.why
    x = net.x
    net.close()
    assert np.isfinite(x).all()


@pytest.mark.slow
def test_umesh_predicts_the_press_of_a_phantom():
    press_with(om.UmeshNet.load(), 1e-3)


def test_a_small_umesh_predicts_a_press(tmp_path):
    """On a grid of 200 elements, hardly trained: a file of the phantom's weights takes seconds to load."""
    data = om.UmeshData.generate(tmp_path / "data", 12, nelem=200, npicture=0)
    place, summary = str(tmp_path / "net").encode(), om.capi.OmUmeshTrainSummary()
    definition = om.lib.om_umesh_train_default_def(ctypes.byref(data._c), place)  # borrows `place`
    definition.assign({"nvalid": 4, "nlevel": 1, "nepoch": 4, "rate": 2e-3, "nworker": 1})
    om.lib.om_umesh_train(ctypes.byref(definition), None, ctypes.byref(summary))
    assert 0 < summary.valid_error < 1e-3
    press_with(om.UmeshNet(tmp_path / "net" / "weights.safetensors"), 5e-4)
    assert pathlib.Path(om.data_path("weights/phantom.safetensors")).exists()
