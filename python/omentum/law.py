"""Laws of elasticity in Python: for trying out a material. Slow: every element is computed in NumPy, a step
takes fifty to a hundred times as long as with a law of the library."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _capi as c
from ._convert import functions_of
from ._lib import keep_raised, lib, status_of, view
from .engine import Engine
from .mesh import TetMesh

_TABLE = functions_of(c.OmTissueEngine)
_STEP = 1e-5  # of F, for differences
_FLAT, _LOW = 1e-6, 0.1  # det F: flat up to rounding; what a step may leave, as of engine "fem"


@dataclass
class Constants:
    """Constants of n elements: young, mu, lam (Pa), poisson."""

    young: np.ndarray
    poisson: np.ndarray

    @property
    def mu(self) -> np.ndarray:
        """Shear modulus, Pa."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def lam(self) -> np.ndarray:
        """Lame's first constant, Pa."""
        return self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))

    @property
    def bulk(self) -> np.ndarray:
        """Bulk modulus, Pa."""
        return self.young / (3 * (1 - 2 * self.poisson))


def smooth_log(x: Any, order: int = 0) -> np.ndarray:
    """ln x, or its first or second derivative, for every x: below 0.02 its Taylor polynomial of second order."""
    x = np.asarray(x, float)
    b = np.maximum(x, c.OM_LAW_LOG_FLOOR)
    t = x - b  # 0 above the floor
    return (np.log(b) + t / b - 0.5 * (t / b) ** 2, 1 / b - t / b**2, -1 / b**2)[order]


def smooth_power(x: Any, exponent: float, order: int = 0) -> np.ndarray:
    """x ** exponent, or its first or second derivative, for every x: below 0.2 its Taylor polynomial of second order."""
    x = np.asarray(x, float)
    b = np.maximum(x, c.OM_LAW_POWER_FLOOR)
    t, f = x - b, b**exponent
    d, dd = exponent * f / b, exponent * (exponent - 1) * f / b**2
    return (f + t * d + 0.5 * t * t * dd, d + t * dd, dd)[order]


class Law(Engine):
    """A law of elasticity. Derive from it, and pass an instance to Tissue, or to register_engine:

        class NeoHookean(om.Law):
            name = "my-neo-hookean"
            def energy(self, F, of):
                l = om.smooth_log(np.linalg.det(F))
                return of.mu / 2 * ((F * F).sum((1, 2)) - 3) - of.mu * l + of.lam / 2 * l * l

        om.check_law(NeoHookean())
        om.Tissue(mesh, NeoHookean(), young=3000, poisson=0.45)

    It does what engine "fem" does: steps, statics, tools, springs, contact, presses, forces and stress; not quadratic elements. The
    law must be finite and smooth for every F, also of inverted elements: smooth_log and smooth_power help. check_law tests it
    as the laws of the library are tested. `stress` and `tangent` are differences unless they are written too.
    """

    numbers = ("young", "poisson", "rayleigh_mass", "rayleigh_stiffness")
    has_forces = True
    has_barrier = False  # the energy grows without limit as det F goes to 0: shorter steps keep elements from inverting

    def energy(self, F: np.ndarray, of: Constants) -> np.ndarray:
        """Energy per volume at rest, J/m^3 (n), by the deformation gradients F (n x 3 x 3); F[:, r, c] = dx_r / dX_c."""
        raise NotImplementedError

    def stress(self, F: np.ndarray, of: Constants) -> np.ndarray:
        """First Piola-Kirchhoff stress dW/dF, Pa (n x 3 x 3)."""
        out = np.empty_like(F)
        for r, k in np.ndindex(3, 3):
            high, low = _moved(F, r, k)
            out[:, r, k] = (self.energy(high, of) - self.energy(low, of)) / (2 * _STEP)
        return out

    def tangent(self, F: np.ndarray, of: Constants) -> np.ndarray:
        """dP/dF, Pa (n x 3 x 3 x 3 x 3): [:, r, c, s, d] = dP_rc / dF_sd."""
        out = np.empty((len(F), 3, 3, 3, 3))
        if type(self).stress is Law.stress:
            return _second_differences(lambda G: self.energy(G, of), F, out)
        for s, d in np.ndindex(3, 3):
            high, low = _moved(F, s, d)
            out[..., s, d] = (self.stress(high, of) - self.stress(low, of)) / (2 * _STEP)
        return out

    # ---- the engine's table ----

    def table(self) -> Any:
        """The table of the engine for C."""
        if not hasattr(self, "_table"):
            super().table()
            table = self._table  # holds the functions
            table.step = _TABLE["step"]()
            table.has_springs = True
            for name in ("assemble", "add_internal_force", "get_energy", "eval_balance", "get_measure"):
                setattr(table, name, _TABLE[name](self._guarded(getattr(self, "_on_" + name))))
            table.check = _TABLE["check"](self._on_check)
        return ctypes.pointer(self._table)

    def _guarded(self, function: Any) -> Any:
        def call(*arguments: Any) -> int:
            try:
                function(*arguments)
                return 0
            except BaseException as error:
                return status_of(error, self.name)

        return call

    def create(self, mesh: TetMesh, mass: np.ndarray, volume: np.ndarray, young: np.ndarray) -> Any:
        """Prepare a model."""
        return _Elements(mesh, volume)

    def _on_create(self, model: int) -> int:
        status = super()._on_create(model)
        if status < 0:
            return status
        data = self._data[model]
        materials = [lib.om_engine_material(model, e).contents for e in range(len(data.tet))]
        data.of = Constants(np.array([m.young for m in materials]), np.array([m.poisson for m in materials]))
        data.mass = view(None, lib.om_tissue_mass(model), np.float64, (data.nvert,))
        definition = lib.om_engine_def(model).contents
        data.gravity, data.damping = definition.gravity.copy(), definition.rayleigh_mass
        return 0

    def _on_assemble(self, model: int, state: int, work: int, raw: Any) -> None:
        data, at = self._data[model], raw.contents
        x, v = (view(None, address, np.float64, (data.nvert, 3)) for address in (at.x, at.v))
        F = data.gradient(x)
        P, H = _turned(F, data.of) if at.is_turned else self._derivatives(F, data.of, at.is_exact)
        K = np.einsum("ercsd,eac,ebd->eabrs", H, data.grad, data.grad, optimize=True)
        K *= data.volume[:, None, None, None, None]
        corner = data.corner_force(P)
        if at.lag:
            corner -= at.lag * np.einsum("eabrs,ebs->ear", K, v[data.tet])
        push = view(None, lib.om_tissue_external_force(state), np.float64, (data.nvert, 3)) + data.gather(corner)
        push += data.mass[:, None] * (data.gravity - data.damping * v)
        inertia = at.mass * data.mass
        anchor, stiffness = c.OmVec3(), ctypes.c_double()
        attached = view(None, lib.om_tissue_attached(state), np.bool_, (data.nvert,))
        for i in np.flatnonzero(attached).tolist():
            if lib.om_engine_find_spring(state, i, ctypes.byref(anchor), ctypes.byref(stiffness)):
                k = stiffness.value
                push[i] += k * (np.array((anchor.x, anchor.y, anchor.z)) - x[i] - at.spring_lag * v[i])
                inertia[i] += at.spring * k
        view(None, lib.om_engine_rhs(work), np.float64, (data.nvert, 3), True)[...] = at.force * push
        data.write(lib.om_engine_matrix(work).contents, at.stiffness * K, inertia)

    def _derivatives(self, F: np.ndarray, of: Constants, is_exact: bool) -> tuple[np.ndarray, np.ndarray]:
        """Stress and tangent; without is_exact negative eigenvalues of the tangent become 0."""
        H = self._finite(self.tangent(F, of), F, "tangent").reshape(-1, 9, 9)
        H = 0.5 * (H + H.transpose(0, 2, 1))
        if not is_exact:
            w, V = np.linalg.eigh(H)
            H = np.einsum("eik,ek,ejk->eij", V, np.maximum(w, 0), V)
        return self._finite(self.stress(F, of), F, "stress"), H.reshape(-1, 3, 3, 3, 3)

    def _finite(self, values: Any, F: np.ndarray, what: str) -> np.ndarray:
        values = np.asarray(values, np.float64)
        shape = (len(F),) + {"energy": (), "stress": (3, 3), "tangent": (3, 3, 3, 3)}[what]
        if values.shape != shape:
            raise ValueError(f"law {self.name}: {what} has shape {values.shape}: {shape} is needed")
        if not np.isfinite(values).all():
            bad = int(np.argmax(~np.isfinite(values.reshape(len(F), -1)).all(axis=1)))
            raise ValueError(f"law {self.name}: {what} is not finite at F = {F[bad].round(6).tolist()}, of an element with det F = "
                             f"{np.linalg.det(F[bad]):.3g}; a law must be finite for every F: smooth_log and smooth_power help")
        return values

    def _elastic(self, model: int, address: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, Any]:
        """Energy per volume, stress, F and the elements at positions."""
        data = self._data[model]
        F = data.gradient(view(None, address, np.float64, (data.nvert, 3)))
        return self._finite(self.energy(F, data.of), F, "energy"), self._finite(self.stress(F, data.of), F, "stress"), F, data

    def _on_add_internal_force(self, model: int, x: int, mask: int | None, force: int | None, total: Any) -> None:
        _, P, _, data = self._elastic(model, x)
        f = data.gather(data.corner_force(P))
        if mask:
            f[view(None, mask, np.uint8, (data.nvert,)) == 0] = 0
        all_ = f.sum(axis=0)
        total.contents.x += all_[0]
        total.contents.y += all_[1]
        total.contents.z += all_[2]
        if force:
            view(None, force, np.float64, (data.nvert, 3), True)[...] += f

    def _on_get_energy(self, model: int, x: int, out: int) -> None:
        W, _, _, data = self._elastic(model, x)
        view(None, out, np.float64, (1,), True)[0] = data.volume @ W

    def _on_eval_balance(self, model: int, _work: int, x: int, force: int, out: int) -> None:
        W, P, _, data = self._elastic(model, x)
        view(None, out, np.float64, (1,), True)[0] = data.volume @ W
        view(None, force, np.float64, (data.nvert, 3), True)[...] = data.gather(data.corner_force(P))

    def _on_get_measure(self, model: int, x: int, measure: int, out: int) -> None:
        W, P, F, data = self._elastic(model, x)
        view(None, out, np.float64, (len(F),), True)[...] = _measure(c.OmTissueMeasure(measure), W, P, F)

    def _on_check(self, model: int, _work: int, x_begin: int, x_end: int, is_solved: bool, raw: Any) -> None:
        """As om__fem_check: what a step does to the elements."""
        out = raw.contents
        ctypes.memset(raw, 0, ctypes.sizeof(out))
        try:
            data, J = self._data[model], []
            for address, name in ((x_begin, "elastic_begin"), (x_end, "elastic_end")):
                F = data.gradient(view(None, address, np.float64, (data.nvert, 3)))
                J.append(np.linalg.det(F))
                setattr(out, name, data.volume @ self._finite(self.energy(F, data.of), F, "energy"))
            allowed = np.where(J[0] <= 0, 2 * J[0] - 0.5, _FLAT if is_solved else np.minimum(J[0] / 2, _LOW))
            out.ncrushed = int(((J[1] < _LOW) & ~(J[1] >= allowed)).sum())
            out.nbarrier = out.ncrushed if self.has_barrier else 0
            out.ninverted = int((J[1] <= _FLAT).sum())
        except BaseException as error:  # the call of C that follows raises it
            out.ncrushed = 1
            keep_raised(error)


def _rotation(F: np.ndarray) -> np.ndarray:
    """The rotation nearest to each F."""
    U, _, Vt = np.linalg.svd(F)
    U[:, :, 2] *= (np.linalg.det(U) * np.linalg.det(Vt))[:, None]
    return U @ Vt


def _turned(F: np.ndarray, of: Constants) -> tuple[np.ndarray, np.ndarray]:
    """Stress and stiffness of rotated linear elasticity: a first guess that converges from anywhere."""
    R, eye = _rotation(F), np.eye(3)
    trace = (R * F).sum((1, 2)) - 3
    P = 2 * of.mu[:, None, None] * (F - R) + (of.lam * trace)[:, None, None] * R
    H = of.lam[:, None, None, None, None] * np.einsum("erc,esd->ercsd", R, R)
    H += of.mu[:, None, None, None, None] * (np.einsum("rs,cd->rcsd", eye, eye) + np.einsum("erd,esc->ercsd", R, R))
    return P, H


def _moved(F: np.ndarray, r: int, k: int, step: float = _STEP) -> tuple[np.ndarray, np.ndarray]:
    high, low = F.copy(), F.copy()
    high[:, r, k] += step
    low[:, r, k] -= step
    return high, low


def _second_differences(energy: Any, F: np.ndarray, out: np.ndarray) -> np.ndarray:
    """Of the energy alone: differences of differences would lose all digits with the step of the stress."""
    step, flat, W = 3e-4, out.reshape(len(F), 9, 9), energy(F)
    line = []
    for i in range(9):
        high, low = _moved(F, *divmod(i, 3), step)
        line.append((energy(high), energy(low)))
        flat[:, i, i] = (line[i][0] - 2 * W + line[i][1]) / step**2
    for i in range(9):
        for j in range(i):
            both = energy(_moved(_moved(F, *divmod(i, 3), step)[0], *divmod(j, 3), step)[0])
            none = energy(_moved(_moved(F, *divmod(i, 3), step)[1], *divmod(j, 3), step)[1])
            # (W(++) - W(+0) - W(0+) + 2 W - W(-0) - W(0-) + W(--)) / 2 h^2
            value = (both + none + 2 * W - sum(line[i]) - sum(line[j])) / (2 * step**2)
            flat[:, i, j] = flat[:, j, i] = value
    return out


def _measure(kind: c.OmTissueMeasure, W: np.ndarray, P: np.ndarray, F: np.ndarray) -> np.ndarray:
    """The measures of om_tissue_get_measure; stress is Cauchy's, of a nearly flat element P R^T."""
    J = np.linalg.det(F)
    if kind == c.OmTissueMeasure.ENERGY_DENSITY:
        return W
    if kind == c.OmTissueMeasure.VOLUME_RATIO:
        return J
    U, s, Vt = np.linalg.svd(F)
    sign = np.linalg.det(U) * np.linalg.det(Vt)
    if kind == c.OmTissueMeasure.PRINCIPAL_STRETCH:
        return s[:, 0]
    s[:, 2] *= sign
    if kind == c.OmTissueMeasure.STRAIN:
        high, low = s[:, 0] - 1, s[:, 2] - 1
        return np.where(np.abs(high) > np.abs(low), high, low)
    turned = P @ np.swapaxes(_rotation(F), 1, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        stress = np.where((J > _FLAT)[:, None, None], P @ np.swapaxes(F, 1, 2) / J[:, None, None], turned)
    stress -= np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    return np.sqrt(1.5 * (stress**2).sum((1, 2)))


class _Elements:
    """Linear tetrahedra in NumPy: gradients of shapes, sums at vertices, places of their blocks in an OmBsr."""

    of: Constants
    mass: np.ndarray
    gravity: np.ndarray
    damping: float

    def __init__(self, mesh: TetMesh, volume: np.ndarray) -> None:
        self.tet, self.volume, self.nvert = mesh.tet, volume, len(mesh.x)
        rest = mesh.x[mesh.tet]
        inverse = np.linalg.inv(np.swapaxes(rest[:, 1:] - rest[:, :1], 1, 2))  # rows: gradients of vertices 1, 2, 3
        self.grad = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)  # (ntet x 4 x 3)
        self.adr: np.ndarray | None = None

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """F of every element (ntet x 3 x 3)."""
        return np.einsum("ear,eac->erc", x[self.tet], self.grad)

    def corner_force(self, P: np.ndarray) -> np.ndarray:
        """Forces on the vertices of every element, N (ntet x 4 x 3)."""
        return -np.einsum("erc,eac->ear", P, self.grad) * self.volume[:, None, None]

    def gather(self, corner: np.ndarray) -> np.ndarray:
        """Sums at the vertices (nvert x 3)."""
        at = self.tet.ravel()
        return np.column_stack([np.bincount(at, corner[:, :, k].ravel(), self.nvert) for k in range(3)])

    def write(self, A: Any, K: np.ndarray, inertia: np.ndarray) -> None:
        """A = K + inertia on the diagonal; blocks (a, b) of K by rows (ntet x 4 x 4 x 3 x 3)."""
        if self.adr is None:
            self.adr = np.empty(16 * len(self.tet), np.int32)
            lib.om_bsr_find_elements(ctypes.byref(A), len(self.tet), 4, self.tet.ctypes.data, self.adr.ctypes.data)
        block = np.empty((A.nblock, 3, 3))
        for r, s in np.ndindex(3, 3):
            block[:, r, s] = np.bincount(self.adr, K[..., r, s].ravel(), A.nblock)
        diagonal = view(None, A.row_adr, np.int32, (self.nvert + 1,))[:-1]
        edge = view(None, A.edge_adr, np.int32, (A.nedge, 2))
        block[diagonal] = 0.5 * (block[diagonal] + np.swapaxes(block[diagonal], 1, 2)) + inertia[:, None, None] * np.eye(3)
        block[edge[:, 1]] = np.swapaxes(block[edge[:, 0]], 1, 2)  # exact transposes
        by_columns = np.swapaxes(block, 1, 2)
        view(None, A.value, np.float32, (A.nblock, 3, 3), True)[...] = by_columns
        if A.exact:
            view(None, A.exact, np.float64, (A.nblock, 3, 3), True)[...] = by_columns


# ---- tests of a law -----------------------------------------------------------------------------------


def check_law(law: Law, young: float = 3000, poisson: float = 0.45, seed: int = 3, n: int = 400) -> dict[str, float]:
    """Test a law as those of the library are tested; ValueError names what is wrong, and where.

    Rest has no energy and no stress, and no F has less energy; the stress is the derivative of the energy and the tangent that of
    the stress (differences at `n` random F: ordinary, strong, nearly flat, inverted); a rotation changes nothing; all is finite
    at extremes. The largest deviations are returned, and `young` and `poisson` of the law at rest.
    """
    rng, said = np.random.default_rng(seed), f"law {law.name or type(law).__name__}"

    def of(count: int) -> Constants:
        return Constants(np.full(count, float(young)), np.full(count, float(poisson)))

    def fail(what: str, value: float, F: np.ndarray) -> None:
        raise ValueError(f"{said}: {what} ({value:.3g}) at F = {F.round(4).tolist()}")

    def eval_(F: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        k = of(len(F))
        return (law._finite(law.energy(F, k), F, "energy"), law._finite(law.stress(F, k), F, "stress"),
                law._finite(law.tangent(F, k), F, "tangent").reshape(-1, 9, 9))

    eye = np.eye(3)[None]
    W, P, H = eval_(eye)
    size = float(np.abs(H).max())  # Pa
    # differences are exact to about 1e-5 of the stiffness, written derivatives to rounding
    has_stress, has_tangent = type(law).stress is not Law.stress, type(law).tangent is not Law.tangent
    if not abs(W[0]) <= 1e-10 * size:
        fail("the energy at rest is not 0", W[0], eye[0])
    if not np.abs(P).max() <= (1e-10 if has_stress else 1e-6) * size:
        fail("the stress at rest is not 0", np.abs(P).max(), eye[0])
    least = np.linalg.eigvalsh(0.5 * (H[0] + H[0].T)).min()
    if not least >= -1e-5 * size:
        fail("rest is not stable: the tangent has a negative eigenvalue", least, eye[0])

    F = eye + np.where(np.arange(n) % 4 == 0, 0.2, 0.6)[:, None, None] * rng.uniform(-1, 1, (n, 3, 3))
    F[:, :, 1] *= np.array([1, 1, 0.03, -0.6])[np.arange(n) % 4][:, None]
    W, P, H = eval_(F)
    scale = np.abs(H).max(axis=(1, 2))
    step, worst = 3e-6, {"stress": 0.0, "tangent": 0.0}
    singular = np.linalg.svd(F, compute_uv=False)
    smooth = ~((np.linalg.det(F) < 0) & (singular[:, 1] - singular[:, 2] < 0.05))  # laws odd in stretches have a crease there
    for i in range(9):
        high, low = _moved(F, *divmod(i, 3), step)
        dW = (law.energy(high, of(n)) - law.energy(low, of(n))) / (2 * step)
        off = np.where(smooth, np.abs(dW - P.reshape(n, 9)[:, i]) / (np.abs(P).max(axis=(1, 2)) + 1e-2 * scale + 1), 0)
        worst["stress"] = max(worst["stress"], float(off.max()))
        if has_stress and off.max() > 1e-5:
            fail("the stress is not the derivative of the energy: relative difference", off.max(), F[off.argmax()])
        dP = (law.stress(high, of(n)) - law.stress(low, of(n))).reshape(n, 9) / (2 * step)
        off = np.where(smooth, np.abs(dP - H[:, :, i]).max(axis=1) / scale, 0)
        if has_tangent and has_stress:
            worst["tangent"] = max(worst["tangent"], float(off.max()))
            if off.max() > 1e-5:
                fail("the tangent is not the derivative of the stress: relative difference", off.max(), F[off.argmax()])
    asymmetry = np.where(smooth, np.abs(H - np.swapaxes(H, 1, 2)).max(axis=(1, 2)) / scale, 0)
    if asymmetry.max() > 1e-4:
        fail("the tangent is not symmetric: relative difference", asymmetry.max(), F[asymmetry.argmax()])
    turn = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))[:, None, None]
    off = np.abs(law.energy(turn @ F, of(n)) - W) / (np.abs(W) + size)
    if off.max() > 1e-9:
        fail("a rotation changes the energy: relative difference", off.max(), F[off.argmax()])
    many = eye + np.array([0.3, 1.5, 6])[np.arange(3000) % 3][:, None, None] * rng.uniform(-1, 1, (3000, 3, 3))
    W = law._finite(law.energy(many, of(3000)), many, "energy")
    if W.min() < -1e-10 * size:
        fail("the energy is lower than at rest", W.min(), many[W.argmin()])
    for value in (0, 1e-8, -1, -5, 30):
        eval_(np.diag([value, 1.0, value])[None])
    H = eval_(eye)[2].reshape(3, 3, 3, 3)
    lam, mu = H[0, 0, 1, 1], 0.5 * (H[0, 1, 0, 1] + H[0, 1, 1, 0])
    return {**worst, "rotation": float(off.max()), "young": float(mu * (3 * lam + 2 * mu) / (lam + mu)),
            "poisson": float(lam / (2 * (lam + mu)))}
