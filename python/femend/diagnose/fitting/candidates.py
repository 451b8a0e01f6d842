"""A named law at a place: how it starts, how it is fitted, what it leaves on data it has not seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from femend import _core
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.recovered import Recovered
from femend.physics import FitCoordinates, Physics, Shape, Surrogate, catalogue, nearby, physics, shapes
from femend.physics.causal import CAUSAL

__all__ = [
    "KINDS",
    "ONLY_GROUND",
    "SPRINGS",
    "Candidate",
    "Start",
    "force_on_lines",
    "left_of",
    "stacked",
    "standard_deviations",
    "laws_for",
    "starts",
]

FloatArray = NDArray[np.float64]

# slip of friction that is taken to be stuck, as a share of the largest motion
STUCK = 0.02

# what a plain spring is called at each kind of place where laws are tried, by what the model has there
SPRINGS = {
    "ground": "support_stiffness",
    "pair": "support_stiffness",
    "end": "joint_stiffness",
    "clamp": "compliant_support",
    "bushes": "joint_stiffness",
}
ONLY_GROUND = ("added_mass", "tuned_absorber")
# kinds of places where a spring beside the law is a part of its own (at a cut it is what the cut took away)
KINDS = ("ground", "pair")
# laws that are tried beside one and told by its name: a constant loss with all that causality asks for with it,
# friction that creeps before it slides
_BESIDE = {"structural_damping": CAUSAL, "coulomb_friction": ("sliding_friction",)}
_NOT_NAMED = ("support_stiffness", "joint_stiffness", "compliant_support", "spring_bending", "quadratic_stiffness")


@dataclass(frozen=True, eq=False)
class Start:
    """Where the fit of a law begins: parameter values, the companion's k and c beside it, the share `left` of the
    recovered force that it leaves unexplained; NaN where that could not be told."""

    physics: Physics
    values: Mapping[str, float]
    k: float
    c: float
    left: float


@dataclass(frozen=True, eq=False)
class Candidate:
    """A law at a place after its fit.

    Attributes:
        physics: catalogue entry; None for a member's own stiffness factor and for a free force.
        name: name of the physics as it is reported.
        joint: the opened place.
        values: parameter values, in the units of the deck.
        k, c: linear companion beside a nonlinear law.
        p: unknowns of the model.
        x: fit coordinates of the law (and companion).
        n_law: number of law parameters fitted.
        prior: prior cost of `p`, and of a mass that is much of the structure's (`oversized.py`).
        fitted: mean weighted square left on the records it was fitted to.
        chosen: the same on the record kept for choosing.
        reference: what a free force at the same place leaves on that record.
        covariance: of x, where known.
        sigma: decay (1/s) of the window in which a nonlinear law could be followed; 0 for whole records.
        converged: whether its last fit came to its minimum.
        p_sd: standard deviations of p beside everything else that is unknown, where known.
        whole: covariance of p and x together, where known.
    """

    physics: Physics | None
    name: str
    joint: Joint | None
    values: Mapping[str, float]
    p: FloatArray
    x: FloatArray
    n_law: int
    prior: float
    fitted: float
    chosen: float
    k: float = 0.0
    c: float = 0.0
    reference: float = np.inf
    covariance: FloatArray | None = None
    coordinates: FitCoordinates | Surrogate | None = None
    extra: Mapping[str, float] = field(default_factory=dict)
    sigma: float = 0.0
    converged: bool = True
    p_sd: FloatArray | None = None
    whole: FloatArray | None = None

    @property
    def nonlinear(self) -> bool:
        """Whether its response needs a simulation."""
        return self.physics is not None and self.physics.kind == "nonlinear"


def standard_deviations(covariance: NDArray[np.floating[Any]], n: int | None = None, left: float = 1.0) -> FloatArray:
    """Standard deviations (n,) of the first unknowns of a covariance, of all without `n`; rounding may have left a
    variance below zero. They are inflated by the mean weighted square that is `left` where that is above the noise."""
    return np.asarray(np.sqrt(np.maximum(np.diag(covariance)[:n], 0.0)) * np.sqrt(max(1.0, left)))


def laws_for(kind: str) -> list[tuple[str, Physics]]:
    """(reported name, law) worth trying at a kind of place."""
    found: list[tuple[str, Physics]] = []
    if kind == "support":
        return [("compliant_support", physics("released_support"))]
    if kind in SPRINGS:
        found.append((SPRINGS[kind], physics("support_stiffness")))
        for entry in catalogue():
            if entry.name in _NOT_NAMED or (entry.name in ONLY_GROUND and kind != "ground"):
                continue
            found.append((entry.name, entry))
            found += [(entry.name, physics(law)) for law in _BESIDE.get(entry.name, ())]
    return found


def starts(entry: Physics, joint: Joint, recovered: Recovered, count: int) -> list[Start]:
    """The `count` best starts of a law by regression of the recovered force on its shapes, beside a linear companion.

    Lines are weighted by how well the sensors see a force at the joint.
    """
    amplitude = float(max(np.abs(d).max() for d in recovered.d))
    omega = np.concatenate([x.imag for x in recovered.s])
    if not np.isfinite(amplitude) or amplitude <= 0:
        return []
    tried = shapes(entry, amplitude=amplitude, band=(float(omega.min()), float(omega.max())))
    found = [(start, shape) for shape in tried if (start := _regressed(shape, joint, recovered)) is not None]
    kept = _of_each_side(found, count)
    finer = [near for _, shape in kept for near in nearby(shape)]
    found = [*kept, *((start, shape) for shape in finer if (start := _regressed(shape, joint, recovered)) is not None)]
    return [*_stuck(entry, recovered), *(start for start, _ in _of_each_side(found, count))]


def _of_each_side(found: list[tuple[Start, Shape]], count: int) -> list[tuple[Start, Shape]]:
    """The `count` starts that leave least, with their shapes; of stops one for each number of sides."""
    kept: list[tuple[Start, Shape]] = []
    for start, shape in sorted(found, key=lambda one: one[0].left):
        sides = start.values.get("sides")
        if len(kept) < count and (sides is None or sides not in [o.values.get("sides") for o, _ in kept]):
            kept.append((start, shape))
    return kept


def _regressed(shape: Shape, joint: Joint, recovered: Recovered) -> Start | None:
    """The start of a shape with the force scale that follows the recovered force best beside a linear companion; None
    where the law has nothing to say there."""
    entry = shape.physics
    columns = [_term(entry, term, recovered) for term in shape.terms]
    linear = entry.kind == "linear"
    if not linear:
        columns += [
            stacked(recovered.D, recovered),
            stacked([D * x[:, None] for D, x in zip(recovered.D, recovered.s)], recovered),
        ]
    lines, force = np.array(columns).T, stacked(recovered.F, recovered)
    A, b = np.concatenate([lines.real, lines.imag]), np.concatenate([force.real, force.imag])
    size = np.linalg.norm(A, axis=0)
    if not np.all(np.isfinite(size)) or np.any(size == 0):
        return None
    factors = _solve(A / size, b, len(shape.terms), entry) / size
    left = float(np.linalg.norm(b - A @ factors) / np.linalg.norm(b))
    own = np.linalg.norm(A[:, : len(shape.terms)] @ factors[: len(shape.terms)])
    if own < 1e-3 * np.linalg.norm(b):
        return None
    values = shape.values(list(factors[: len(shape.terms)]))
    k, c = (0.0, 0.0) if linear else (float(factors[-2]), float(factors[-1]))
    if joint.place.release is not None:
        k = max(k, 0.0)  # a cut with negative stiffness falls apart
    return Start(entry, values, k, c, left)


def left_of(start: Start, recovered: Recovered) -> float:
    """Share of a recovered force that a start leaves as it stands, without a regression."""
    own = stacked(force_on_lines(start.physics, start.values, recovered), recovered)
    beside = [(start.k + start.c * x[:, None]) * D for D, x in zip(recovered.D, recovered.s)]
    force = stacked(recovered.F, recovered)
    return float(np.linalg.norm(force - own - stacked(beside, recovered)) / np.linalg.norm(force))


def _stuck(entry: Physics, recovered: Recovered) -> list[Start]:
    """Starts of friction that hardly gives before it slips, at the force of each record.

    Where it sticks, its displacement is lost in the noise and no regression on it finds the law; its force shows.
    """
    if entry.name != "coulomb_friction":
        return []
    slip = STUCK * float(max(d.std() for d in recovered.d))
    sizes = [float(f.std()) for f in recovered.f]
    return [Start(entry, {"f": f, "kt": f / slip}, 0.0, 0.0, np.nan) for f in sizes if f > 0 and slip > 0]


def _solve(A: FloatArray, b: FloatArray, n_terms: int, entry: Physics) -> FloatArray:
    """Least squares; factors of laws whose parameters are positive are kept positive."""
    free = entry.name in ("cubic_stiffness", "quadratic_stiffness", "bilinear_stiffness")
    factors = np.linalg.lstsq(A, b, rcond=None)[0]
    if not free and np.any(factors[:n_terms] <= 0):
        low = np.full(A.shape[1], -np.inf)
        low[:n_terms] = 0.0
        factors = lsq_linear(A, b, (low, np.full(A.shape[1], np.inf))).x
        factors[:n_terms] = np.maximum(factors[:n_terms], 1e-3 * max(np.abs(factors[:n_terms]).max(), 1e-12))
    return np.asarray(factors)


def stacked(parts: list[NDArray[np.complex128]], recovered: Recovered) -> NDArray[np.complex128]:
    """What a recovered place has on the lines of every record, `parts` of (K, n_w) each, in one row, weighted by
    how well it is seen."""
    return np.concatenate([(X * np.sqrt(w)).ravel() for X, w in zip(parts, recovered.weight)])


def _term(entry: Physics, values: Mapping[str, float], recovered: Recovered) -> NDArray[np.complex128]:
    """A law's unit force on the lines of every record."""
    return stacked(force_on_lines(entry, values, recovered), recovered)


def force_on_lines(entry: Physics, values: Mapping[str, float], recovered: Recovered) -> list[NDArray[np.complex128]]:
    """Forces (K, n_w) of a law that follows a recovered motion, on the lines of every record."""
    law, s = entry.law or entry.name, recovered.s
    parts = []
    for i, D in enumerate(recovered.D):
        if entry.kind == "linear":
            kappa, _ = _core.law_dynamic_stiffness(law, dict(values), s[i])
            parts.append(kappa[:, None] * D)
            continue
        record = recovered.records[i]
        force = np.array(
            [
                _core.law_force(law, dict(values), d, v, a, record.dt)
                for d, v, a in zip(recovered.d[i], recovered.v[i], recovered.a[i])
            ]
        )
        parts.append(np.fft.rfft(force, axis=1)[:, recovered.index[i]].T)
    return parts
