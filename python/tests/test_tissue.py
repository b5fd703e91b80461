"""Tissue from Python: against statics by hand, and what happens to views, threads, forks and pickles."""
import os
import pickle
import threading
import warnings

import numpy as np
import pytest

import omentum as om


def hang(mesh, **options):
    tissue = om.Tissue(mesh, young=2e4, poisson=0.3, **options)
    tissue.find_rest(1e-6)
    return tissue


def hang_of(mesh, young, density):
    tissue = om.Tissue(mesh, young=young, poisson=0.3, density=density)
    tissue.find_rest(1e-6)
    return tissue.x.copy()


def test_attachments_carry_the_weight(box):
    tissue = hang(box, density=900)
    forces = tissue.forces()
    weight = 900 * 0.04 * 0.02 * 0.02 * 9.81
    assert forces.weight == pytest.approx([0, 0, -weight], rel=1e-9)
    assert forces.attachment == pytest.approx([0, 0, weight], rel=1e-3, abs=1e-5)
    assert tissue.attachment_force().sum(axis=0) == pytest.approx(forces.attachment, rel=1e-6, abs=1e-9)
    assert tissue.mass.sum() * 9.81 == pytest.approx(weight, rel=1e-12)


def test_a_stretched_bar_has_the_stress_of_hooke():
    """A bar of Young's modulus E, stretched by 0.1 % without weight: the force is E A strain."""
    mesh = om.TetMesh.box((0.1, 0.01, 0.01), (20, 2, 2))
    tissue = om.Tissue(mesh, young=1e4, poisson=0.0, gravity=(0, 0, 0))
    mesh = tissue.mesh  # with midpoints
    ends = np.flatnonzero((mesh.x[:, 0] < 1e-9) | (mesh.x[:, 0] > 0.1 - 1e-9))
    anchor = mesh.x[ends] + np.outer(mesh.x[ends, 0] > 0.05, [1e-4, 0, 0])
    tissue.set_attachment(ends, anchor)
    tissue.find_rest(1e-5)
    far = tissue.attachment_force()[mesh.x[:, 0] > 0.1 - 1e-9].sum(axis=0)
    assert far == pytest.approx([1e4 * 1e-4 * 1e-3, 0, 0], rel=2e-3, abs=1e-6)
    assert tissue.measure("strain") == pytest.approx(np.full(len(mesh.tet), 1e-3), rel=5e-3)
    assert tissue.energy().elastic == pytest.approx(0.5 * 1e4 * 1e-6 * 1e-4 * 0.1, rel=5e-3)


def test_von_mises_of_a_pulled_bar():
    """One axis under tension: von Mises' stress is the stress, and the stretch is that of the ends."""
    mesh = om.TetMesh.box((0.1, 0.01, 0.01), (20, 2, 2))
    tissue = om.Tissue(mesh, young=1e4, poisson=0.0, law="st-venant-kirchhoff", gravity=(0, 0, 0))
    mesh = tissue.mesh
    ends = (mesh.x[:, 0] < 1e-9) | (mesh.x[:, 0] > 0.1 - 1e-9)
    l = 1.2
    tissue.set_attachment(ends, (mesh.x * [l, 1, 1])[ends])
    tissue.find_rest(1e-7)
    cauchy = 1e4 * l * 0.5 * (l**2 - 1) * l / l  # P = l S, S = E (l^2 - 1) / 2; sigma = P l / J, J = l
    assert tissue.measure("von_mises") == pytest.approx(np.full(len(mesh.tet), cauchy), rel=1e-3)
    assert tissue.measure("principal_stretch") == pytest.approx(np.full(len(mesh.tet), l), rel=1e-4)
    assert tissue.measure("volume_ratio") == pytest.approx(np.full(len(mesh.tet), l), rel=1e-4)
    density = 1e4 / 8 * (l**2 - 1) ** 2
    assert tissue.measure("energy_density") == pytest.approx(np.full(len(mesh.tet), density), rel=1e-3)
    with pytest.raises(ValueError, match="von_mises"):
        tissue.measure("von-mise")


def test_a_lift_balances(box):
    tissue = om.Tissue(box, young=2e4)
    tip = np.array([0.04, 0.01, 0.02])
    assert tissue.grasp(tip, radius=0.011) == tissue.held_by.tolist().count(0) > 3
    tissue.move(tip + [0, 0, 0.003])
    tissue.find_rest(1e-6)
    assert tissue.x[tissue.held_by == 0] == pytest.approx(tissue.mesh.x[tissue.held_by == 0] + [0, 0, 0.003], abs=1e-9)
    forces = tissue.forces()
    assert forces.grasp[0][2] > 0.01
    assert forces.grasp[0] + forces.attachment + forces.weight == pytest.approx(np.zeros(3), abs=2e-5)
    tissue.release()
    assert (tissue.held_by == -1).all()


def test_a_step_takes_its_time_and_x_shows_it(box):
    tissue = om.Tissue(box, young=2e4)
    x = tissue.x
    before = x.copy()
    report = tissue.step(0.01)
    assert tissue.time == pytest.approx(0.01) and report.status == 0 and report.substeps >= 1
    assert x is tissue.x and not np.array_equal(x, before)  # the same view shows the new positions
    assert tissue.attached.sum() == 25 and np.array_equal(x[tissue.attached], before[tissue.attached])


def test_external_forces_are_written_through_the_view(box):
    tissue = om.Tissue(box, gravity=(0, 0, 0), young=1e4)
    tissue.external_force[-1] = (0, 0, 0.01)
    assert tissue.forces().external == pytest.approx([0, 0, 0.01])
    tissue.find_rest(1e-5)
    assert tissue.forces().attachment[2] == pytest.approx(-0.01, rel=1e-3)


def test_views_of_constant_data_are_read_only(box):
    tissue = om.Tissue(box)
    with pytest.raises(ValueError, match="read-only"):
        tissue.x[0] = 0
    tissue.set_x(tissue.mesh.x + 0.001)
    assert tissue.x == pytest.approx(tissue.mesh.x + 0.001)


def test_elements_are_quadratic_unless_told(box):
    """The mesh has a midpoint for each edge, behind the vertices of the given one, and eight tetrahedra for each."""
    tissue, linear = om.Tissue(box), om.Tissue(box, element="linear")
    edges = np.unique(np.sort(box.tet[:, [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]].reshape(-1, 2)), axis=0)
    assert len(tissue.x) == len(tissue.mesh.x) == len(box.x) + len(edges) and len(tissue.mesh.tet) == 8 * len(box.tet)
    assert np.array_equal(tissue.mesh.x[:len(box.x)], box.x) and np.array_equal(np.flatnonzero(tissue.attached), tissue.mesh.sets["attachment"])
    assert sorted(map(tuple, tissue.mesh.x[len(box.x):])) == pytest.approx(np.array(sorted(map(tuple, box.x[edges].mean(axis=1)))), abs=1e-12)
    assert linear.mesh is box and linear.x.shape == box.x.shape and linear.measure().shape == (len(box.tet),)
    assert om.Tissue(box, "xpbd").x.shape == box.x.shape  # particles have no elements of ten nodes
    with pytest.raises(ValueError, match="225 x 3"):
        tissue.set_x(box.x)


def test_a_beam_of_one_layer_bends_as_euler_and_bernoulli_say():
    """Deflection q L^4 / 8 E I of the free end under its weight; linear elements are far too stiff."""
    mesh = om.TetMesh.box((0.1, 0.01, 0.01), (8, 1, 1))
    mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 0] < 1e-9)
    q, inertia = 1000 * 9.81 * 1e-4, 0.01**4 / 12
    expected = q * 0.1**4 / (8 * 1e7 * inertia)
    for element, low, high in (("quadratic", 0.95, 1.03), ("linear", 0.0, 0.5)):
        tissue = om.Tissue(mesh, young=1e7, poisson=0.3, element=element)
        tissue.find_rest(1e-6)
        assert low < -(tissue.x - tissue.mesh.x)[:, 2].min() / expected < high


def test_materials_by_label():
    mesh = om.TetMesh.box((0.02, 0.01, 0.01), (2, 1, 1))
    mesh.label[:] = mesh.x[mesh.tet].mean(axis=1)[:, 0] > 0.01
    tissue = om.Tissue(mesh, materials=[{"label": -1, "young": 1e3, "density": 500}, {"label": 1, "young": 9e3, "density": 2000}])
    assert tissue.mass.sum() == pytest.approx(1e-6 * (500 + 2000), rel=1e-9)


def test_messages_are_those_of_the_library(box):
    tissue = om.Tissue(box)
    with pytest.raises(om.Invalid, match="nearest|reach|mm"):
        tissue.grasp((1, 1, 1))
    with pytest.raises(om.Invalid, match="young"):
        om.Tissue(box, young=-1)
    with pytest.raises(AttributeError, match="did you mean 'density'"):
        om.Tissue(box, densty=900)
    with pytest.raises(om.Invalid, match="pbd"):
        om.Tissue(box, engine="pdb")


def test_a_result_that_did_not_converge_is_never_silent(box):
    tissue = om.Tissue(box, young=500, law="neo-hookean")
    with pytest.raises(om.NotConverged) as caught:
        tissue.find_rest(1e-9, max_iterations=1)
    assert caught.value.result.newton_residual > 1e-9
    tissue.reset()
    report = tissue.find_rest(1e-9, max_iterations=1, strict=False)
    assert report.status == om.capi.OmStatus.NOT_CONVERGED and report.message


def test_numbers_may_have_words(box):
    """A modulus of 20 kPa hangs as one of 20,000 Pa; material names are refused with what works."""
    x = [hang_of(box, young=young, density=density) for young, density in ((2e4, 900), ("20 kPa", "0.9 g/cm^3"))]
    assert np.array_equal(*x)
    with pytest.raises(ValueError, match='young="20 psi": a number in Pa, or words such as "3 kPa"'):
        om.Tissue(box, young="20 psi")
    with pytest.raises(TypeError, match='young="3 kPa"'):
        om.Tissue(box, material="liver")


def test_what_nothing_holds_warns_before_it_falls(box):
    free = om.TetMesh(box.x, box.tet)
    with pytest.warns(UserWarning, match="held by nothing and falls"):
        om.Tissue(free).step()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        om.Tissue(free, gravity=(0, 0, 0)).step()
        om.Tissue(box).step()
        grasped = om.Tissue(free)
        grasped.grasp(free.x[0])
        grasped.step()


def test_snapshots_return_to_the_same_bits(box):
    tissue = om.Tissue(box)
    tissue.step()
    state, mark = tissue.snapshot(), tissue.hash
    tissue.step()
    after = tissue.hash
    assert after != mark
    tissue.restore(state)
    assert tissue.hash == mark
    tissue.step()
    assert tissue.hash == after
    with pytest.raises(ValueError, match="another model"):
        tissue.restore(state[:-8])


def test_pickles_and_copies_continue_alike(box):
    tissue = om.Tissue(box, young=4000, law="neo-hookean", solver={"nworker": 1})
    tissue.grasp((0.04, 0.01, 0.01), radius=0.011)
    tissue.move((0.04, 0.01, 0.015))
    tissue.step()
    other, twin = pickle.loads(pickle.dumps(tissue)), tissue.copy()
    for each in (tissue, other, twin):
        each.step()
    assert tissue.hash == other.hash == twin.hash


def test_springs_replace_attachments(box):
    tissue = om.Tissue(box, young=2e4)
    vert = box.sets["attachment"]
    tissue.set_attachment(vert, stiffness=5.0)
    tissue.find_rest()
    sag = (tissue.x - tissue.mesh.x)[vert, 2].sum()
    assert 5.0 * -sag == pytest.approx(-tissue.forces().weight[2], rel=1e-3)


def test_embedded_points_follow_affine_motion(box):
    tissue = om.Tissue(box)
    points = np.array([[0.01, 0.004, 0.013], [0.033, 0.015, 0.002]])
    turn = np.array([[1.1, 0.2, 0], [0, 0.9, 0.1], [0.05, 0, 1]])
    assert tissue.embed(points).eval(tissue.mesh.x @ turn.T) == pytest.approx(points @ turn.T, abs=1e-9)


# ---- life time ----


def test_views_outlive_close(box, alive):
    tissue = om.Tissue(box)
    tissue.step()
    x, force = tissue.x, tissue.external_force
    kept = x.copy()
    tissue.close()
    assert alive() > 0  # the state lives as long as its views
    assert np.array_equal(x, kept) and force.sum() == 0
    for use in (lambda: tissue.x, tissue.step, tissue.forces, lambda: tissue.time, lambda: tissue.move((0, 0, 0)),
                lambda: tissue.mass, tissue.snapshot, lambda: tissue.surface_vert, lambda: tissue.measure()):
        with pytest.raises(om.Closed, match="Tissue is closed"):
            use()
    del x, force
    assert alive() == 0


def test_everything_is_freed_without_close(box, alive):
    with om.Tissue(box) as tissue:
        tissue.step()
    del tissue
    om.Tissue(box, engine="pbd", numbers={"cluster_spacing": 0.01, "cluster_radius": 0.02}).step()
    with pytest.raises(om.Invalid):
        om.Tissue(box, young=0)
    assert alive() == 0


# ---- threads and processes ----


def test_two_threads_step_two_tissues_at_once_to_the_same_bits(box):
    alone = om.Tissue(box)
    for _ in range(20):
        alone.step()
    tissues = [om.Tissue(box) for _ in range(2)]
    threads = [threading.Thread(target=lambda t=t: [t.step() for _ in range(20)]) for t in tissues]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [t.hash for t in tissues] == [alone.hash] * 2


def test_a_second_thread_in_one_tissue_is_refused(box):
    tissue = om.Tissue(box)
    with tissue._busy:  # as a step that runs
        for use in (tissue.step, lambda: tissue.grasp((0, 0, 0)), tissue.snapshot, tissue.reset):
            with pytest.raises(om.InUse, match="in use"):
                use()
    tissue.step()


def test_a_forked_child_steps_to_the_same_bits(box):
    tissue = om.Tissue(om.TetMesh.box((0.1, 0.1, 0.1), (12, 12, 12)), solver={"nworker": 2})
    tissue.step()  # the threads of the library run
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            tissue.step()
            os.write(write, str(tissue.hash).encode())
        finally:
            os._exit(0)
    os.close(write)
    tissue.step()
    os.waitpid(child, 0)
    assert os.read(read, 100).decode() == str(tissue.hash)
    os.close(read)
