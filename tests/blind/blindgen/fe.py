"""Finite elements of the truth: Timoshenko beams in space, numerically integrated, on a mesh finer than the public
deck's.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
import scipy.sparse.linalg as spla

GAUSS_X, GAUSS_W = np.polynomial.legendre.leggauss(4)
GAUSS_X, GAUSS_W = 0.5 * (GAUSS_X + 1.0), 0.5 * GAUSS_W


@dataclass
class Section:
    """Section in the deck's words: I1 bends in the plane that holds the orientation vector, I2 across it (m^2, m^4)."""

    A: float
    I1: float
    I2: float
    J: float
    shear: float = 0.833333


@dataclass
class Material:
    """Isotropic material (Pa, kg/m^3)."""

    E: float
    nu: float = 0.33
    rho: float = 2700.0

    @property
    def G(self) -> float:
        return self.E / (2.0 * (1.0 + self.nu))


def bending_matrices(
    L: float, EI: float, kGA: float, rhoA: float, rhoI: float, shear: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Bending stiffness and consistent mass (4x4; v1, t1, v2, t2) of the interdependent-interpolation beam.

    Shape functions after Friedman and Kosmatka, Comput. Struct. 47 (1993) 473, eq. (13)-(14); `shear=False` is the
    Bernoulli limit without rotary inertia.
    """
    phi = 12.0 * EI / (kGA * L * L) if shear else 0.0
    D = 1.0 / (1.0 + phi)
    K, M = np.zeros((4, 4)), np.zeros((4, 4))
    for s, w in zip(GAUSS_X, GAUSS_W, strict=True):
        N = D * np.array(
            [
                2 * s**3 - 3 * s**2 - phi * s + 1 + phi,
                L * (s**3 - (2 + phi / 2) * s**2 + (1 + phi / 2) * s),
                -2 * s**3 + 3 * s**2 + phi * s,
                L * (s**3 - (1 - phi / 2) * s**2 - phi / 2 * s),
            ]
        )
        dN = (
            D
            / L
            * np.array(
                [
                    6 * s**2 - 6 * s - phi,
                    L * (3 * s**2 - (4 + phi) * s + 1 + phi / 2),
                    -6 * s**2 + 6 * s + phi,
                    L * (3 * s**2 - (2 - phi) * s - phi / 2),
                ]
            )
        )
        T = D * np.array(
            [6 / L * (s * s - s), 3 * s * s - (4 + phi) * s + 1 + phi, -6 / L * (s * s - s), 3 * s * s - (2 - phi) * s]
        )
        dT = D / L * np.array([6 / L * (2 * s - 1), 6 * s - 4 - phi, -6 / L * (2 * s - 1), 6 * s - 2 + phi])
        K += w * L * EI * np.outer(dT, dT)
        M += w * L * rhoA * np.outer(N, N)
        if shear:
            K += w * L * kGA * np.outer(dN - T, dN - T)
            M += w * L * rhoI * np.outer(T, T)
    return K, M


def beam_local(L: float, mat: Material, sec: Section, form: str) -> tuple[np.ndarray, np.ndarray]:
    """12x12 stiffness and mass in element axes. form: "timoshenko" (consistent, rotary inertia), "bernoulli"
    (consistent, no rotary inertia) or "lumped" (Bernoulli stiffness, half the mass at each end)."""
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    shear = form == "timoshenko"
    m = mat.rho * sec.A
    for a, b, k, rm in ((0, 6, mat.E * sec.A / L, m), (3, 9, mat.G * sec.J / L, mat.rho * (sec.I1 + sec.I2))):
        K[np.ix_([a, b], [a, b])] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
        M[np.ix_([a, b], [a, b])] += rm * L / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    for dofs, second, sign in (([1, 5, 7, 11], sec.I1, 1.0), ([2, 4, 8, 10], sec.I2, -1.0)):
        k, mm = bending_matrices(L, mat.E * second, sec.shear * mat.G * sec.A, m, mat.rho * second, shear)
        flip = np.diag([1.0, sign, 1.0, sign])
        K[np.ix_(dofs, dofs)] += flip @ k @ flip
        M[np.ix_(dofs, dofs)] += flip @ mm @ flip
    if form == "lumped":
        half = 0.5 * m * L
        polar = 0.5 * mat.rho * (sec.I1 + sec.I2) * L
        rot = half * L * L / 39.0  # the usual small inertia that keeps bending rotations from being massless
        M = np.diag([half, half, half, polar, rot, rot] * 2)
    return K, M


def rotation(axis: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Rows are the element axes x, y (towards the orientation vector), z in global components."""
    x = axis / np.linalg.norm(axis)
    z = np.cross(x, v)
    z /= np.linalg.norm(z)
    return np.array([x, np.cross(z, x), z])


@dataclass
class Beam:
    """One truth element: the twelve equation numbers (-1 = held), length, axes, material and section."""

    dofs: np.ndarray
    length: float
    axes: np.ndarray
    mat: Material
    sec: Section


@dataclass
class System:
    """Assembled structure: K and M (sparse, n x n), equation number of (deck node, component 1..6), names of places."""

    K: sp.csc_matrix
    M: sp.csc_matrix
    dof: dict[tuple[int, int], int]
    ground: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def vector(self, *terms: tuple[int, int, float]) -> np.ndarray:
        """Load or displacement-pick vector from (node, component, weight); a held component contributes nothing."""
        b = np.zeros(self.K.shape[0])
        for node, comp, w in terms:
            i = self.dof[node, comp]
            if i >= 0:
                b[i] += w
        return b


def assemble_beams(beams: list[Beam], n: int, form: str) -> tuple[sp.coo_matrix, sp.coo_matrix]:
    """Sum the beams into n x n matrices; equation -1 is dropped."""
    rows, cols, kv, mv = [], [], [], []
    cache: dict[tuple[float, float, int], tuple[np.ndarray, np.ndarray]] = {}
    for b in beams:
        key = (round(b.length, 12), b.mat.E, id(b.sec))
        if key not in cache:
            cache[key] = beam_local(b.length, b.mat, b.sec, form)
        k, m = cache[key]
        R = sla.block_diag(b.axes, b.axes, b.axes, b.axes)
        k, m = R.T @ k @ R, R.T @ m @ R
        on = np.flatnonzero(b.dofs >= 0)
        I, J = np.meshgrid(b.dofs[on], b.dofs[on], indexing="ij")
        rows.append(I.ravel())
        cols.append(J.ravel())
        kv.append(k[np.ix_(on, on)].ravel())
        mv.append(m[np.ix_(on, on)].ravel())
    r, c = np.concatenate(rows), np.concatenate(cols)
    return sp.coo_matrix((np.concatenate(kv), (r, c)), (n, n)), sp.coo_matrix((np.concatenate(mv), (r, c)), (n, n))


def modes(system: System, f_max: float, limit: int = 160) -> tuple[np.ndarray, np.ndarray]:
    """Circular frequencies (rad/s) and mass-normalised shapes (n x r) of all modes below f_max (Hz), at most
    `limit`.
    """
    n = system.K.shape[0]
    if n <= 900:
        w2, phi = sla.eigh(system.K.toarray(), system.M.toarray(), subset_by_index=[0, min(limit, n) - 1])
    else:
        want = 40
        while True:
            w2, phi = spla.eigsh(system.K, k=min(want, limit), M=system.M, sigma=0.0, which="LM", v0=np.ones(n))
            if w2.max() > (2 * np.pi * f_max) ** 2 or want >= limit:
                break
            want *= 2
        order = np.argsort(w2)
        w2, phi = w2[order], phi[:, order]
    w = np.sqrt(np.maximum(w2, 0.0))
    keep = w <= 2 * np.pi * f_max
    return w[keep], phi[:, keep]


def ritz(system: System, w: np.ndarray, phi: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Add the static responses to `columns` (n x c) to the modes, and make the whole basis modal again.

    With the residual vectors the local compliance at a law or a load is exact, not the truncated modal sum.
    """
    lu = spla.splu(system.K.tocsc())
    extra = lu.solve(np.ascontiguousarray(columns))
    extra = extra - phi @ (phi.T @ (system.M @ extra))
    keep = []
    for i in range(extra.shape[1]):
        x = extra[:, i]
        for y in keep:
            x = x - y * (y @ (system.M @ x))
        size = np.sqrt(max(x @ (system.M @ x), 0.0))
        ref = np.sqrt(columns[:, i] @ lu.solve(columns[:, i])) / max(w[-1], 1.0)
        if size > 1e-6 * ref:
            keep.append(x / size)
    basis = np.column_stack([phi, *keep]) if keep else phi
    k = basis.T @ (system.K @ basis)
    m = basis.T @ (system.M @ basis)
    w2, v = sla.eigh(0.5 * (k + k.T), 0.5 * (m + m.T))
    return np.sqrt(np.maximum(w2, 0.0)), basis @ v
