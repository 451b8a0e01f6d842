"""What places of a large model would cost, by one linear step each, for thousands of them at once.

A place's cost is estimated as its law-free fit would come out if the model were linear in its unknowns around given
ones. With e (n_out,) the weighted residual of a line there, J (n_out, n_p) its derivatives and h (n_out, n_w) what
forces at the place do to the sensors, the force that is free on every line leaves P = I - h (hᴴ h)⁻¹ hᴴ of both, and
the least squares of what is left with the prior of the unknowns is a system of n_p equations a place:

    A = Re Σ Jᴴ P J + S⁻²,   g = Re Σ Jᴴ P e - S⁻² (p - mean),   cost = Σ eᴴ P e + |(p - mean)/S|² - gᵀ A⁻¹ g

(Golub and Pereyra, The differentiation of pseudo-inverses and nonlinear least squares problems whose variables
separate, SIAM J. Numer. Anal. 10 (1973) 413-432; one Gauss-Newton step.) All products with h are products with the
direction vectors in modal coordinates, made for thousands of places at once. A member gets a column of J instead, for
its factor.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from femend import _core
from femend.diagnose.locating.dressed import MEMBER_SD
from femend.diagnose.locating.receptances import at_sensors, on_lines
from femend.diagnose.locating.region_stiffness import prepare_regions, region_stiffness
from femend.errors import ModelError
from femend.estimate import Problem
from femend.model import Place, ReducedModel
from femend.threads import at_once

__all__ = ["directions", "linear_costs", "pair_costs"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# step of the unknowns (ln units) by which derivatives of the residual are taken
STEP = 1e-5
# decay of a window that has closed at a record's end, in that from which it has
CLOSED = 1.01
# places whose systems of equations are held at once: few enough to stay in cache
AT_ONCE = 512
# directions of the sensors' answers with less than this share of the strongest are left out; of residuals far above the
# noise with less, so that what is lost of their squares stays below one
NEGLIGIBLE = 1e-3


def directions(reduced: ReducedModel, places: Sequence[Place]) -> FloatArray:
    """Direction vectors (sum of n_w, r) of all places in the basis, place after place."""
    rows: dict[bool, list[tuple[int, NDArray[np.int64], FloatArray]]] = {False: [], True: []}
    n = 0
    for place in places:
        for g, x in zip(place.g_rows, place.g_values, strict=True):
            rows[place.independent].append((n, g, x))
            n += 1
    W = np.zeros((n, reduced.r))
    for independent, basis in ((False, reduced.V), (True, reduced.V_a)):
        some = rows[independent]
        if some:
            start = np.cumsum([0, *(len(g) for _, g, _ in some)])
            columns, values = np.hstack([g for _, g, _ in some]), np.hstack([x for *_, x in some])
            W[[i for i, *_ in some]] = csr_array((values, columns, start), shape=(len(some), len(basis))) @ np.asarray(
                basis
            )
    return W


@dataclass(frozen=True, eq=False)
class _Line:
    """One line in modal coordinates: what unit modal forces do to the sensors, weighted, `H` (r, n_out) and, where free
    forces are told, the same in its few strong directions `F` (r, n_f), the residual `e` (n_out,), its derivatives `J`
    (n_out, n_p), the modal response `q` (r,) and the number of sensors."""

    H: ComplexArray
    e: ComplexArray
    J: ComplexArray
    q: ComplexArray
    n_out: int
    F: ComplexArray | None = None

    def freed(self, beside: FloatArray, size: FloatArray) -> _Line:
        """The line with forces along `beside` (n, r) free, in modal coordinates, and its strong directions for forces
        whose entries are up to `size` (r,)."""
        H, e, J = self.H, self.e, self.J
        if len(beside):
            B = np.linalg.qr((beside @ H).T)[0]
            e, J, H = e - B @ (B.conj().T @ e), J - B @ (B.conj().T @ J), H - (H @ B.conj()) @ B.T
        U, size_f, _ = np.linalg.svd(size[:, None] * H, full_matrices=False)
        kept = size_f > min(NEGLIGIBLE, 1 / max(float(np.linalg.norm(e)), 1.0)) * size_f[0]
        return replace(self, H=H, e=e, J=J, F=U[:, kept] * size_f[kept] / size[:, None])


@dataclass(frozen=True, eq=False)
class _Linear:
    """All lines of a problem around unknowns, the modes Q (r, r) there, the prior's curvature (n_p,), pull (n_p,) and
    cost."""

    lines: list[_Line]
    Q: FloatArray
    curvature: FloatArray
    pull: FloatArray
    prior: float

    def freed(self, beside: FloatArray, size: FloatArray) -> _Linear:
        """The same with forces along `beside` (n, r) free, in modal coordinates; `size` (r,) are the largest direction
        vectors' entries, by which answers are judged."""
        return replace(self, lines=[line.freed(beside, size) for line in self.lines])

    @cached_property
    def products(self) -> list[tuple[FloatArray, int]]:
        """Of every line the columns that direction vectors are multiplied with, real parts and then imaginary ones
        (r, 2 n_c): the `n_f` strong directions of the answers, and what all have in common with J and e."""
        made = []
        for line in self.lines:
            assert line.F is not None
            right = np.hstack([line.F, line.H @ line.J.conj(), (line.H @ line.e.conj())[:, None]])
            made.append((np.hstack([right.real, right.imag]), line.F.shape[1]))
        return made

    @cached_property
    def normal(self) -> tuple[FloatArray, FloatArray]:
        """Matrix (n_p, n_p) and right side (n_p,) of the normal equations without any force."""
        shared, pulled = np.diag(self.curvature), -self.pull
        for line in self.lines:
            shared = shared + np.real(line.J.conj().T @ line.J)
            pulled = pulled + np.real(line.J.conj().T @ line.e)
        return shared, pulled


def _step(
    answers: Callable[[FloatArray], list[ComplexArray]], p: FloatArray, unknown: int
) -> tuple[float, list[ComplexArray]]:
    """A step of one unknown and the answers there: back where an update that went far has come to where the mass is
    hardly positive definite; the unknown is held where that cannot be solved either."""
    for step in (STEP, -STEP):
        there = p.copy()
        there[unknown] += step
        try:
            return step, answers(there)
        except ModelError:
            continue
    return STEP, answers(p)


def _linear(problem: Problem, reduced: ReducedModel, sigma: float, p: FloatArray) -> _Linear:
    """The problem around unknowns `p`. Frequency factors and damping ratios of single modes are held: they are many,
    and follow what is missing last. Lines are damped so much at least that records have decayed where they end: free
    decays that a record cut off would be those of the model without the forces, which far from the truth stand for
    anything."""
    system, lines = problem.system(reduced), problem.lines(reduced, max(sigma, _closing(problem)))
    cores = [line.core for line in lines]
    none = _core.Hypothesis()
    moving = np.array([*range(len(reduced.names)), len(p) - 1])

    def answers(at: FloatArray) -> list[ComplexArray]:
        return [y for y, _, _ in _core.fitted_lines(system, none, cores, at, np.zeros(0))]

    here = answers(p)
    slopes = [np.zeros((*y.shape, len(moving)), dtype=complex) for y in here]
    steps = at_once(lambda unknown: _step(answers, p, int(unknown)), moving.tolist())
    for i, (step, there) in enumerate(steps):
        for slope, y, y0 in zip(slopes, there, here, strict=True):
            slope[:, :, i] = (y - y0) / step
    omega, zeta, Q = problem.modes(reduced, p)
    made = []
    for line, y, slope in zip(lines, here, slopes, strict=True):
        s, g, out = on_lines(line, reduced, omega, zeta, Q)
        q = g * (line.U @ (reduced.rows(line.record.in_rows, line.record.in_signs) @ Q))
        weight = np.sqrt(line.share) * line.weight
        for k, H in enumerate(at_sensors(s, g, out, weight)):
            e, J = (line.Y[k] - y[k]) * weight[k], slope[k] * weight[k][:, None]
            made.append(_Line(H, e, J, q[k], len(weight[k])))
    mean, sd = problem.prior(reduced)
    off = (p - mean) / sd
    return _Linear(made, Q, sd[moving] ** -2.0, (off / sd)[moving], float(off @ off))


def _closing(problem: Problem) -> float:
    """Decay, 1/s, of the weakest window that has closed where the shortest record ends; 0 for FRFs, which do not
    end."""
    durations = [r.n * r.dt for r in problem.records if r.frf is None]
    return CLOSED * _core.closing_sigma(min(durations)) if durations else 0.0


def _sizes(WQ: FloatArray) -> FloatArray:
    """Largest entries (r,) of direction vectors (n, r) in modal coordinates."""
    largest = np.abs(WQ).max(initial=0.0) or 1.0
    return np.maximum(np.abs(WQ).max(axis=0, initial=0.0), 1e-12 * largest)


def pair_costs(
    problem: Problem, reduced: ReducedModel, W: FloatArray, p: FloatArray, *, sigma: float = 0.0
) -> FloatArray:
    """Cost (n, n) of free forces along every two of the directions `W` (n, r) after one linear step from the unknowns
    `p`; infinite on the diagonal."""
    linear = _linear(problem, reduced, sigma, p)
    WQ = W @ linear.Q
    lines = [(WQ @ line.H, line.e, line.J) for line in linear.lines]
    return _core.pair_costs(lines, linear.curvature, linear.pull, linear.prior)


def linear_costs(
    problem: Problem,
    reduced: ReducedModel,
    places: Sequence[Place],
    W: FloatArray,
    p: FloatArray,
    *,
    sigma: float = 0.0,
    beside: Sequence[Place] = (),
) -> FloatArray:
    """Cost (n,) of every place after one linear step from the unknowns `p`; infinite for soft clamps, which need a
    basis of their own. `W` are the `directions` of the places."""
    free = directions(reduced, beside)
    linear = _linear(problem, reduced, sigma, p)
    WQ = W @ linear.Q
    linear = linear.freed(free @ linear.Q, _sizes(WQ))
    costs = np.full(len(places), np.inf)
    first = np.cumsum([0, *(place.n_w for place in places)])
    for n_w in sorted({place.n_w for place in places} - {0}):

        def of(some: NDArray[np.int64], n_w: int = n_w) -> FloatArray:
            at = first[some][:, None] + np.arange(n_w)
            return _of_forces(linear, WQ[at.ravel()], n_w, len(free))

        own = np.array([i for i, place in enumerate(places) if place.n_w == n_w])
        # the first in this thread: what all have in common is made once
        begun, *chunks = np.array_split(own, 1 + len(own) * n_w // AT_ONCE)
        costs[own] = np.concatenate([of(begun), *at_once(of, chunks)])
    members = [i for i, place in enumerate(places) if place.scaled and not place.springs]
    if members:
        prepare_regions([places[i] for i in members], reduced)
        costs[members] = _of_members(linear, reduced, [places[i] for i in members], len(free))
    return costs


def _of_forces(linear: _Linear, W: FloatArray, n_w: int, n_free: int) -> FloatArray:
    """Costs (n,) of places with `n_w` directions each, W (n n_w, r) in modal coordinates."""
    n, n_p = len(W) // n_w, len(linear.pull)
    g, squares, blocks = np.zeros((n, n_p)), np.zeros(n), []
    for line, (right, n_f) in zip(linear.lines, linear.products, strict=True):
        n_c = right.shape[1] // 2
        both = (W @ right).reshape(n, n_w, -1)
        b = both[..., n_f : n_c - 1] - 1j * both[..., n_c + n_f : -1]
        c = both[..., n_c - 1] - 1j * both[..., -1]
        b, c = _whitened(both[..., :n_f], both[..., n_c : n_c + n_f], b, c)
        factor = line.n_out / max(line.n_out - n_w - n_free, 1)
        squares += factor * (float(np.vdot(line.e, line.e).real) - (np.abs(c) ** 2).sum(axis=1))
        g -= np.real(np.einsum("jwp,jw->jp", b.conj(), c))
        blocks.append(b)
    shared, pulled = linear.normal
    stacked = np.concatenate(blocks, axis=1)
    stacked = np.concatenate([stacked.real, stacked.imag], axis=1)
    A = shared - np.matmul(stacked.transpose(0, 2, 1), stacked)
    g += pulled
    step = _solved(A, g)
    return np.asarray(squares + linear.prior - (g * step).sum(axis=1))


def _solved(A: FloatArray, g: FloatArray) -> FloatArray:
    """Steps (n, n_p) of normal equations A (n, n_p, n_p), g (n, n_p); the shortest ones where an unknown, as the
    stiffness of a part that hangs on nothing, changes nothing at all."""
    try:
        return np.asarray(np.linalg.solve(A, g[..., None])[..., 0])
    except np.linalg.LinAlgError:
        return np.asarray((np.linalg.pinv(A, hermitian=True) @ g[..., None])[..., 0])


def _whitened(
    real: FloatArray, imaginary: FloatArray, b: ComplexArray, c: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Products b (n, n_w, n_p) and c (n, n_w) with the directions, of parts (n, n_w, n_f), as with an orthonormal basis
    of these."""
    size = np.einsum("jwf,jwf->j", real, real) + np.einsum("jwf,jwf->j", imaginary, imaginary)
    size = np.maximum(size, 1e-300)
    if real.shape[1] == 1:
        length = np.sqrt(size)[:, None]
        return b / length[..., None], c / length
    h = real + 1j * imaginary
    gram = np.matmul(h.conj(), h.transpose(0, 2, 1))
    L = np.linalg.cholesky(gram + 1e-9 * size[:, None, None] * np.eye(gram.shape[1]))
    both = np.linalg.solve(L, np.concatenate([b, c[..., None]], axis=2))
    return both[..., :-1], both[..., -1]


def _of_members(linear: _Linear, reduced: ReducedModel, members: Sequence[Place], n_free: int) -> FloatArray:
    """Costs of members, regions and beddings with a factor on their stiffness; in the exponent: it is one as the deck
    has it."""
    ones = np.ones(len(reduced.model.parameters))
    q = np.array([line.q for line in linear.lines]).T
    both = np.hstack([q.real, q.imag])
    n_k = q.shape[1]
    A = np.diag(linear.curvature)
    g, squares = -linear.pull, 0.0
    for line in linear.lines:
        A = A + np.real(line.J.conj().T @ line.J)
        g = g + np.real(line.J.conj().T @ line.e)
        squares += line.n_out / max(line.n_out - n_free, 1) * float(np.vdot(line.e, line.e).real)
    a, alpha, gamma = np.zeros((len(members), len(g))), np.zeros(len(members)), np.zeros(len(members))
    for some in np.array_split(np.arange(len(members)), 1 + len(members) // 256):
        Z = np.zeros((len(some), len(q), n_k), dtype=complex)
        for z, i in zip(Z, some, strict=True):
            if members[i].kind in ("region", "bed"):
                f = linear.Q.T @ (region_stiffness(members[i], reduced) @ (linear.Q @ both))
                z -= f[:, :n_k] + 1j * f[:, n_k:]
                continue
            for eid in members[i].elements:
                rows, K, _ = reduced.model.fe.element_matrices(eid, ones)
                E = reduced.V[rows] @ linear.Q
                f = E.T @ (K @ (E @ both))
                z -= f[:, :n_k] + 1j * f[:, n_k:]
        for k, line in enumerate(linear.lines):
            column = Z[:, :, k] @ line.H
            a[some] += np.real(column.conj() @ line.J)
            alpha[some] += (np.abs(column) ** 2).sum(axis=1)
            gamma[some] += np.real(column.conj() @ line.e)
    solved = np.linalg.solve(A, np.column_stack([g, a.T]))
    base = squares + linear.prior - float(g @ solved[:, 0])
    left = alpha + MEMBER_SD**-2.0 - (a.T * solved[:, 1:]).sum(axis=0)
    return np.asarray(base - (gamma - a @ solved[:, 0]) ** 2 / left)
