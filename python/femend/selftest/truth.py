"""A truth drawn for the user's own model: other parameters, members and masses each a little off, other damping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from femend.model import Model
from femend.model.places.places import topology
from femend.selftest.plan import Plan, Replay

__all__ = ["Drawn", "Truth", "draw", "modes_of", "scattered"]

FloatArray = NDArray[np.float64]

MEMBER_SD, LUMP_SD = 0.007, 0.015
FORM_SD = 0.003  # of every mode's frequency: what mesh and idealisation make wrong
DAMPING = (0.6, 1.6)  # times the study's ratio, drawn for every mode
CUT = 2.2  # deviations beyond which nothing is drawn
REACH = 4.0  # modes are taken up to this multiple of the band's end ...
MOST = 160  # ... but no more than these
SPARE = 60  # static answers beside them at most
DENSE = 900  # DOFs up to which all modes are solved for at once
PATCHES = 12


@dataclass(frozen=True, eq=False)
class Drawn:
    """What a truth's structure is before anything is left out: K, M (n_a, n_a), the factors of the parameters, and by
    element what its stiffness is times on top."""

    K: Any
    M: Any
    factors: dict[str, float]
    scatter: dict[int, float]


@dataclass(frozen=True, eq=False)
class Truth:
    """Modes of a truth: omega (r,), zeta (r,), shapes (n_a, r), T (n_g, n_a) to the g-set, and a static solver."""

    omega: FloatArray
    zeta: FloatArray
    phi: FloatArray
    T: Any
    K: Any
    M: Any
    solve: Any

    def shape(self, g: FloatArray) -> FloatArray:
        """Modal coordinates (r,) of a direction on the g-set (n_g,)."""
        return np.asarray((self.T.T @ g) @ self.phi)

    def stiffness(self, g: FloatArray) -> float:
        """Static stiffness of a direction on the g-set, N/m (with the inertia of a frequency far below the band)."""
        a = np.asarray(self.T.T @ g)
        return float(1.0 / (a @ self.solve(a)))


def draw(rng: np.random.Generator, plan: Plan, control: str = "") -> Drawn:
    """A structure as reality may be: moduli within their priors, members and lumps off by a per cent or so.

    `control` "exact" keeps the deck's values, "model_form" the parameters alone.
    """
    model = plan.model
    factors = {}
    for p in model.parameters:
        x = float(np.exp(p.prior_sd * np.clip(rng.standard_normal(), -CUT, CUT)))
        low, high = p.bounds or (0.0, np.inf)
        factors[p.name] = 1.0 if control in ("exact", "model_form") else float(np.clip(x, low, high))
    K, M = model.matrices(factors)
    scatter: dict[int, float] = {}
    if control != "exact":
        dK, dM, scatter = scattered(rng, model, factors, 2.0 if control == "model_form" else 1.0)
        K, M = K + dK, M + dM
    return Drawn(K, M, factors, scatter)


def scattered(
    rng: np.random.Generator, model: Model, factors: dict[str, float], times: float
) -> tuple[Any, Any, dict[int, float]]:
    """Changes of K and M (n_a, n_a) where members, patches of other elements and lumps each have an error of their own,
    and the factor on every element's stiffness.

    Deviations are `times` 0.7 % of a member's stiffness and 1.5 % of a lump's mass.
    """
    values = model.factors(factors)
    own = {e: i for i, (_, _, chain) in enumerate(topology(model).members) for e in chain}
    n_members = 1 + max(own.values(), default=-1)
    size = float(np.linalg.norm(np.ptp(model.xyz, axis=0))) or 1.0
    centres = model.xyz[rng.integers(len(model.xyz), size=PATCHES)] + 1e-6 * size * rng.standard_normal((PATCHES, 3))
    errors = times * MEMBER_SD * np.clip(rng.standard_normal(n_members + PATCHES), -CUT, CUT)
    rows, columns, stiff, mass = [], [], [], []
    scatter = {}
    for eid, _, nodes in model.fe.elements():
        if eid == 0:
            continue
        at, K, M = model.fe.element_matrices(eid, values)
        lump = times * LUMP_SD * float(np.clip(rng.standard_normal(), -CUT, CUT)) if not K.any() and M.any() else 0.0
        if eid in own:
            unit = own[eid]
        else:
            middle = np.mean([model.xyz[model.index(n)] for n in nodes], axis=0)
            unit = n_members + int(np.argmin(((centres - middle) ** 2).sum(axis=1)))
        scatter[eid] = 1 + float(errors[unit])
        rows.append(np.repeat(at, len(at)))
        columns.append(np.tile(at, len(at)))
        stiff.append(errors[unit] * K.ravel())
        mass.append(lump * M.ravel())
    T, n = model.transformation(), int(model.fe.n_g)
    if not rows:
        empty = sp.csc_array((T.shape[1], T.shape[1]))
        return empty, empty, scatter
    index = np.concatenate(rows), np.concatenate(columns)
    g = [sp.csc_array(sp.coo_array((np.concatenate(v), index), shape=(n, n))) for v in (stiff, mass)]
    return T.T @ g[0] @ T, T.T @ g[1] @ T, scatter


def modes_of(
    rng: np.random.Generator, plan: Plan, drawn: Drawn, patterns: Sequence[FloatArray], *, form: bool = True
) -> Truth:
    """Modes far above the band, with the static answers to `patterns` (n_g,) each, and damping drawn for every mode.

    `form` moves every frequency by what mesh and idealisation may make wrong (not the deck's own mesh refined, which
    an arbitrary deck does not allow).
    """
    T = plan.model.transformation()
    low, high = 2 * np.pi * plan.band[0], 2 * np.pi * plan.band[1]
    shift = (0.3 * low) ** 2
    solver = spla.splu(sp.csc_matrix(drawn.K + shift * drawn.M))
    omega, phi = _modes(drawn, REACH * high, shift)
    omega, phi = _with_statics(drawn, phi, solver.solve, [np.asarray(T.T @ g) for g in patterns])
    # as many numbers whatever the basis, so that a mode keeps its own with and without an effect
    errors, shares = rng.standard_normal(MOST + SPARE)[: len(omega)], rng.random(MOST + SPARE)[: len(omega)]
    if form:
        omega = omega * np.exp(FORM_SD * np.clip(errors, -CUT, CUT))
    zeta = plan.study.damping_ratio * DAMPING[0] * (DAMPING[1] / DAMPING[0]) ** shares
    zeta *= np.clip(omega / (1.5 * high), 1.0, 2.0)
    floor = 1e-3 * low  # a free body drifts as slowly as it can
    return Truth(np.maximum(omega, floor), np.minimum(zeta, 0.5), phi, T, drawn.K, drawn.M, solver.solve)


def _modes(drawn: Drawn, omega_max: float, shift: float) -> tuple[FloatArray, FloatArray]:
    n = drawn.K.shape[0]
    if n <= DENSE:
        K, M = drawn.K.toarray(), drawn.M.toarray()
        # massless DOFs make M singular: the inverse problem is the one with a definite matrix
        mu, x = scipy.linalg.eigh(0.5 * (M + M.T), 0.5 * (K + K.T) + shift * M)
        keep = mu > 1e-14 * mu[-1]
        mu, x = mu[keep][::-1], x[:, keep][:, ::-1]
        values, phi = 1 / mu - shift, x / np.sqrt(mu)
    else:
        want = min(MOST, n - 2)
        K, M = sp.csc_matrix(drawn.K), sp.csc_matrix(drawn.M)
        values, phi = spla.eigsh(K, k=want, M=M, sigma=-shift, which="LM", v0=np.ones(n))
        order = np.argsort(values)
        values, phi = values[order], phi[:, order]
    omega = np.sqrt(np.maximum(values, 0.0))
    count = max(1, min(int((omega < omega_max).sum()), MOST))
    return omega[:count], phi[:, :count]


def _with_statics(
    drawn: Drawn, phi: FloatArray, solve: Any, patterns: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Modes of the space of `phi` and the static answers to the patterns, which are exact in it."""
    extra: list[FloatArray] = []
    for a in patterns:
        x = np.asarray(solve(a))
        whole = float(x @ (drawn.M @ x))
        for _ in range(2):
            x = x - phi @ (phi.T @ (drawn.M @ x))
            for y in extra:
                x = x - y * float(y @ (drawn.M @ x))
        size = float(x @ (drawn.M @ x))
        if size > 1e-12 * whole and size > 0:
            extra.append(x / np.sqrt(size))
    basis = np.column_stack([phi, *extra])
    k, m = basis.T @ (drawn.K @ basis), basis.T @ (drawn.M @ basis)
    values, v = scipy.linalg.eigh(0.5 * (k + k.T), 0.5 * (m + m.T))
    return np.sqrt(np.maximum(values, 0.0)), basis @ v


def pick(model: Model, rows: Sequence[int], values: Sequence[float]) -> FloatArray:
    """A direction on the g-set (n_g,)."""
    g = np.zeros(int(model.fe.n_g))
    np.add.at(g, list(rows), list(values))
    return g


def channels(plan: Plan, truth: Truth, replay: Replay) -> tuple[FloatArray, FloatArray]:
    """Modal coordinates of the forces (n_in, r) and of the sensors (n_out, r) of a recording."""
    m = plan.model
    into = [truth.shape(pick(m, [r], [s])) for r, s in zip(replay.in_rows, replay.in_signs, strict=True)]
    out = [truth.shape(pick(m, [r], [s])) for r, s in zip(replay.out_rows, replay.out_signs, strict=True)]
    return np.array(into), np.array(out)


def changed(drawn: Drawn, dK: Any, dM: Any) -> Drawn:
    """The structure with a change of K and M (None for none)."""
    K = drawn.K if dK is None else drawn.K + dK
    M = drawn.M if dM is None else drawn.M + dM
    return replace(drawn, K=K, M=M)
