"""Laws in Python: held by the tests of the laws of the library, against their figures, and against forms by hand."""
import pickle

import numpy as np
import pytest

import omentum as om
from omentum.law import Constants


def log_square(J, of):
    """lambda/2 (ln J)^2 as one term below 0.02, as in the library."""
    b = np.maximum(J, om.capi.OM_LAW_LOG_FLOOR)
    t, l = J - b, np.log(b)
    return of.lam * (l * l / 2 + t * l / b + t * t * (1 - l) / (2 * b * b))


class NeoHookean(om.Law):
    """(2.11) by its energy alone: stress and tangent are differences."""

    name = "python-neo-hookean"
    has_barrier = True

    def energy(self, F, of):
        J = np.linalg.det(F)
        return of.mu / 2 * ((F * F).sum((1, 2)) - 3) - of.mu * om.smooth_log(J) + log_square(J, of)


class Venant(om.Law):
    """St Venant-Kirchhoff, with its stress and its tangent."""

    name = "python-venant"

    @staticmethod
    def strain(F):
        return 0.5 * (np.swapaxes(F, 1, 2) @ F - np.eye(3))

    def energy(self, F, of):
        E = self.strain(F)
        return of.lam / 2 * np.trace(E, axis1=1, axis2=2) ** 2 + of.mu * (E * E).sum((1, 2))

    def second(self, F, of):
        E = self.strain(F)
        return 2 * of.mu[:, None, None] * E + (of.lam * np.trace(E, axis1=1, axis2=2))[:, None, None] * np.eye(3)

    def stress(self, F, of):
        return F @ self.second(F, of)

    def tangent(self, F, of):
        eye, mu = np.eye(3), of.mu[:, None, None, None, None]
        H = np.einsum("rs,edc->ercsd", eye, self.second(F, of))
        H += of.lam[:, None, None, None, None] * np.einsum("erc,esd->ercsd", F, F)
        return H + mu * (np.einsum("erd,esc->ercsd", F, F) + np.einsum("erk,esk,cd->ercsd", F, F, eye))


class Fung(om.Law):
    """mu / (2 b) (exp(b (I1bar - 3)) - 1) + K/2 (J - 1)^2: stiffens as tissue does; the library has no such law."""

    name = "python-fung"
    b = 2.0

    def energy(self, F, of):
        J = np.linalg.det(F)
        rise = np.minimum(self.b * ((F * F).sum((1, 2)) * om.smooth_power(J, -2 / 3) - 3), 60)
        return of.mu / (2 * self.b) * np.expm1(rise) + of.bulk / 2 * (J - 1) ** 2


class Stable(om.Law):
    """mu/2 (I1 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2, with its stress; the tangent by differences."""

    name = "python-stable"

    def energy(self, F, of):
        J = np.linalg.det(F)
        return of.mu / 2 * ((F * F).sum((1, 2)) - 3) - of.mu * (J - 1) + (of.lam + of.mu) / 2 * (J - 1) ** 2

    def stress(self, F, of):
        after, last = F[:, [1, 2, 0]], F[:, [2, 0, 1]]
        cofactors = after[:, :, [1, 2, 0]] * last[:, :, [2, 0, 1]] - after[:, :, [2, 0, 1]] * last[:, :, [1, 2, 0]]
        J = (F[:, 0] * cofactors[:, 0]).sum(1)
        factor = (of.lam + of.mu) * (J - 1) - of.mu
        return of.mu[:, None, None] * F + factor[:, None, None] * cofactors


TWINS = [(NeoHookean, "neo-hookean"), (Venant, "st-venant-kirchhoff"), (Stable, "stable-neo-hookean")]


@pytest.mark.parametrize("law", [NeoHookean, Venant, Stable])
def test_laws_pass_the_tests_of_the_library(law):
    found = om.check_law(law(), young=3000, poisson=0.45)
    assert found["stress"] < 1e-6 and found["tangent"] < 1e-6 and found["rotation"] < 1e-12
    assert found["young"] == pytest.approx(3000, rel=1e-5) and found["poisson"] == pytest.approx(0.45, abs=1e-6)


def test_wrong_laws_are_named():
    class Energy(Venant):
        name = "wrong"

        def energy(self, F, of):
            return 1.01 * super().energy(F, of)

    class Tangent(Venant):
        name = "wrong"

        def tangent(self, F, of):
            return np.swapaxes(super().tangent(F, of), 1, 2)

    class Frame(Stable):
        name = "wrong"
        stress = om.Law.stress

        def energy(self, F, of):
            return super().energy(F, of) + of.mu * (F[:, 0, 0] - 1) ** 2

    class Prestressed(Venant):
        name = "wrong"
        stress, tangent = om.Law.stress, om.Law.tangent

        def energy(self, F, of):
            return super().energy(F, of) + np.linalg.det(F) - 1

    class Bare(om.Law):
        name = "wrong"

        def energy(self, F, of):
            with np.errstate(all="ignore"):
                return of.mu / 2 * ((F * F).sum((1, 2)) - 3) - of.mu * np.log(np.linalg.det(F))

    class Falling(Venant):
        name = "wrong"
        stress, tangent = om.Law.stress, om.Law.tangent

        def energy(self, F, of):
            E = self.strain(F)
            return super().energy(F, of) - of.mu * (E * E).sum((1, 2)) ** 2

    for law, words in ((Energy, "stress is not the derivative"), (Tangent, "tangent is not"), (Frame, "rotation changes"),
                       (Prestressed, "stress at rest"), (Bare, "not finite"), (Falling, "lower than at rest|rotation|not stable")):
        with pytest.raises(ValueError, match=f"law wrong.*({words})"):
            om.check_law(law())


@pytest.mark.parametrize("law, name", TWINS)
def test_forces_and_stress_are_those_of_the_library(law, name, box):
    mine, theirs = (om.Tissue(box, law(), young=3000, poisson=0.4),
                    om.Tissue(box, law=name, element="linear", young=3000, poisson=0.4))
    x = box.x + 1e-3 * np.random.default_rng(1).normal(size=box.x.shape)
    for tissue in (mine, theirs):
        tissue.set_x(x)
    force = theirs.internal_force()
    assert mine.internal_force() == pytest.approx(force, abs=1e-7 * np.abs(force).max())
    assert mine.energy().elastic == pytest.approx(theirs.energy().elastic, rel=1e-9)
    for kind in ("von_mises", "principal_stretch", "strain", "volume_ratio", "energy_density"):
        assert mine.measure(kind) == pytest.approx(theirs.measure(kind), rel=1e-6), kind


@pytest.mark.parametrize("law, name", TWINS)
def test_rest_and_lift_are_those_of_the_library(law, name, box, alive):
    tissues = [om.Tissue(box, law(), young=9000, poisson=0.4, rayleigh_stiffness=0.01),
               om.Tissue(box, law=name, element="linear", young=9000, poisson=0.4, rayleigh_stiffness=0.01)]
    for tissue in tissues:
        tissue.find_rest(1e-6)
    tip = tissues[1].x[-1].copy()
    assert tissues[0].x == pytest.approx(tissues[1].x, abs=1e-8)
    assert np.abs(tissues[0].x - box.x).max() > 1e-4
    for tissue in tissues:
        tissue.set_attachment(box.sets["attachment"], stiffness=3.0)
        tissue.grasp(tip, radius=0.011)
        for i in range(10):
            tissue.move(tip + [0, 0, 4e-4 * (i + 1)])
            tissue.step()
    assert tissues[0].x == pytest.approx(tissues[1].x, abs=1e-6)
    mine, theirs = (t.forces() for t in tissues)
    for field in ("grasp", "pull", "attachment", "weight"):
        assert getattr(mine, field) == pytest.approx(getattr(theirs, field), abs=1e-3 * np.abs(theirs.grasp).max()), field
    del tissue, tissues, mine, theirs
    assert alive() == 0


def test_a_press_on_a_law_in_python(box):
    forces = []
    for engine, law in ((Stable(), None), ("fem", "stable-neo-hookean")):
        tissue = om.Tissue(box, engine, young=3000, gravity=(0, 0, 0), **({"law": law, "element": "linear"} if law else {}))
        tissue.set_attachment(np.flatnonzero(box.x[:, 2] < 1e-9))
        press = om.Press(tissue, om.Probe("sphere", radius=0.01), ntri=800)
        press.place((0.02, 0.01, 0.0305))
        for i in range(10):
            report = press.step((0.02, 0.01, 0.03 - 2e-4 * i), 0.02)
        forces.append(report.force)
    assert forces[1][2] > 0.01 and forces[0] == pytest.approx(forces[1], abs=1e-3 * forces[1][2])


def test_a_bar_of_fung_tissue_has_the_stress_of_its_formula():
    """Stretched by 30 % with the sides left free: the sides' stretch is that without side stress, found by bisection."""
    mesh = om.TetMesh.box((0.05, 0.01, 0.01), (5, 1, 1))
    tissue = om.Tissue(mesh, Fung(), young=3000, poisson=0.45, gravity=(0, 0, 0))
    left, right = mesh.x[:, 0] < 1e-9, mesh.x[:, 0] > 0.05 - 1e-9
    l, of = 1.3, Constants(np.array([3000.0]), np.array([0.45]))

    def stress(side):
        return Fung().stress(np.diag([l, side, side])[None], of)[0]

    low, high = 0.7, 1.0
    for _ in range(60):
        side = 0.5 * (low + high)
        low, high = (side, high) if stress(side)[1, 1] < 0 else (low, side)
    ends = left | right
    tissue.set_attachment(ends, (mesh.x * [l, side, side])[ends])  # the ends are as narrow as the middle
    tissue.find_rest(1e-6)
    assert tissue.x == pytest.approx(mesh.x * [l, side, side], abs=1e-6)
    pull = tissue.attachment_force()[right].sum(axis=0)
    assert pull[0] == pytest.approx(stress(side)[0, 0] * 1e-4, rel=1e-4)
    J, I1 = l * side**2, l**2 + 2 * side**2
    by_hand = 3000 / 2.9 * np.exp(2 * (J ** (-2 / 3) * I1 - 3)) * J ** (-2 / 3) * (l - I1 / (3 * l)) + 3000 / 0.3 * (J - 1) * side**2
    assert stress(side)[0, 0] == pytest.approx(by_hand, rel=1e-6)


def test_a_scene_uses_a_law_in_python():
    """A body on its board, lifted: as the same law of the library."""
    om.register_engine(Stable())
    heights = []
    for engine in ("python-stable", "fem"):
        text = f"name: law\ntissue: {{source: sheet, engine: {engine}, cells: [4, 4, 1], young: 5000" + (
            ", law: stable-neo-hookean, element: linear}\n" if engine == "fem" else "}\n")
        body = om.Body(om.Scene.parse(text))
        body.settle(seconds=0.4, strict=False)
        tip = body.x[-1].copy()
        body.grasp(tip, radius=0.02)
        for i in range(15):
            body.move(tip + [0, 0, 1e-3 * (i + 1)])
            body.step(strict=False)
        heights.append(body.x.copy())
    assert heights[0] == pytest.approx(heights[1], abs=2e-5) and heights[1][:, 2].max() > 0.015


def test_errors_name_the_law_and_leave_the_tissue(box):
    class Broken(Stable):
        name = "python-broken-law"

        def stress(self, F, of):
            return np.full_like(F, np.nan)

    tissue = om.Tissue(box, Broken())
    mark = tissue.hash
    with pytest.raises(ValueError, match="python-broken-law: (stress|tangent) is not finite at F"):
        tissue.step()
    assert tissue.hash == mark

    class Flat(Stable):
        name = "python-flat-law"

        def energy(self, F, of):
            return super().energy(F, of).sum()

    with pytest.raises(ValueError, match="energy has shape"):
        om.Tissue(box, Flat()).step()


def test_functions_that_go_on_below_zero():
    x = np.array([-1.0, 0.0, 0.01, 0.02, 0.19, 0.2, 0.5, 2.0])
    assert om.smooth_log(x)[-2:] == pytest.approx(np.log(x[-2:])) and om.smooth_power(x, -2 / 3)[-3:] == pytest.approx(x[-3:] ** (-2 / 3))
    h = 1e-7
    for f in (om.smooth_log, lambda v, order=0: om.smooth_power(v, -2 / 3, order), lambda v, order=0: om.smooth_power(v, 1.7, order)):
        for order in (0, 1):
            slope = (f(x + h, order) - f(x - h, order)) / (2 * h)
            assert slope == pytest.approx(f(x, order + 1), rel=1e-5, abs=1e-5)


def test_tissue_with_a_law_is_pickled_and_copied(box):
    tissue = om.Tissue(box, Stable(), young=4000)
    tissue.step()
    twin, other = tissue.copy(), pickle.loads(pickle.dumps(tissue))
    for each in (tissue, twin, other):
        each.step()
    assert tissue.hash == twin.hash == other.hash
