"""Pairs of places whose two free forces explain the recordings as well as a pair that was found.

What two forces do to the sensors, many pairs of places do as well, with other forces: at the right pair each force
follows the motion of its own place, at the others it is a mixture of both. So of the pairs that leave as little, those
count whose forces are, as nearly as anywhere, functions of their places' own motion, whatever these may be; and of
these the likeliest places.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.known_force import ReadOff, read_off
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.linear_costs import directions, pair_costs
from femend.diagnose.locating.locate import LINES, Located, cost_of
from femend.diagnose.locating.preference import LIKELIER, preference, with_one_force
from femend.diagnose.locating.recovered import in_time, without_ends
from femend.estimate import Fit, Problem
from femend.model import Place, ReducedModel

__all__ = ["likeliest_equal", "nonlinear_shares"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# places of which every two are tried, the likeliest; lines a record of the linear step; pairs that are fitted
MOST, STEP_LINES, FITTED = 200, 40, 100
# steps of these fits, and cost up to which pairs are as good
STEPS, EQUAL = 3, 12.0
# pairs count whose forces leave up to so many times what the best pair's leave as functions of their own motion
OWN = 3.0
# ranks of preference by which a force between two places is rarer than two forces, each to the ground
BETWEEN = 2


@dataclass(frozen=True, eq=False)
class _Equal:
    """A pair of places with its fit, cost, and squares that its forces leave as functions of their own motion."""

    first: Place
    second: Place
    fit: Fit
    cost: float
    left: float

    @property
    def rank(self) -> float:
        """Cost with what speaks against the places."""
        return self.cost + LIKELIER * sum(
            preference(p) + BETWEEN * (p.kind == "pair") for p in (self.first, self.second)
        )


def likeliest_equal(
    problem: Problem, reduced: ReducedModel, places: Sequence[Place], second: Located, at: Place
) -> tuple[Located, Place]:
    """The likeliest of the pairs that do as well as forces at a `second` place, which has the fit of both, and at a
    place `at`; that pair itself where none is likelier or its places have several forces."""
    if not (with_one_force(at) and with_one_force(second.place)):
        return second, at
    single = sorted(filter(with_one_force, places), key=preference)[:MOST]
    found = _equal(problem, reduced, single, second.fit.p)
    given = _left(problem, second.fit)
    least = min([given, *(pair.left for pair in found)])
    few = problem.sparing(LINES)
    own = _Equal(at, second.place, second.fit, cost_of(few, second.fit, 0.0), given)
    best = min((pair for pair in (own, *found) if pair.left <= OWN * least), key=lambda pair: pair.rank)
    return (second, at) if best is own else (Located(best.second, best.fit, best.cost), best.first)


def _equal(problem: Problem, reduced: ReducedModel, single: Sequence[Place], p: FloatArray) -> list[_Equal]:
    """Pairs of places with one force each that leave about as little as any does from the unknowns `p`."""
    costs = pair_costs(problem.thinned(STEP_LINES), reduced, directions(reduced, single), p)
    above = np.triu_indices(len(single), 1)
    first = np.argsort(costs[above], kind="stable")[:FITTED]
    pairs = [(single[above[0][n]], single[above[1][n]]) for n in first]
    pairs = [(a, b) for a, b in pairs if not set(a.elements) & set(b.elements)]
    few = problem.sparing(LINES)
    hypotheses = [hypothesis_of(b, reduced, (a,)) for a, b in pairs]
    fits = few.fit(hypotheses, [(p, np.zeros(0))] * len(pairs), iterations=STEPS)
    done = [(a, b, f, cost_of(few, f, 0.0)) for (a, b), f in zip(pairs, fits, strict=True) if f is not None]
    best = min((cost for *_, cost in done), default=np.inf)
    return [_Equal(a, b, f, cost, _left(problem, f)) for a, b, f, cost in done if cost < best + EQUAL]


def nonlinear_shares(problem: Problem, fit: Fit) -> list[float]:
    """Share of the weighted squares of every free force of a fit that no spring, dashpot and mass at its own place
    follows."""
    read = read_off(problem, fit)
    both = [_not_of_own_motion(read, i, linear=True) for i in range(read[0].F.shape[1])]
    return [left / max(whole, 1e-300) for left, whole in both]


def _left(problem: Problem, fit: Fit) -> float:
    """Weighted squares of the forces of a fit that are no function of their own places' motion."""
    read = read_off(problem, fit)
    return sum(_not_of_own_motion(read, i)[0] for i in range(read[0].F.shape[1]))


def _not_of_own_motion(read: Sequence[ReadOff], i: int, *, linear: bool = False) -> tuple[float, float]:
    """Weighted squares of force `i` on the lines of all records beside what a linear and a few nonlinear functions of
    its own motion follow, or `linear` ones alone, and of all of it."""
    did = [_did(one, i) for one in read]
    size = [max(float(np.std(np.concatenate([history[j] for _, history in did]))), 1e-300) for j in (0, 1)]
    columns, forces = [], []
    for one, (lines, history) in zip(read, did, strict=True):
        weight = np.sqrt(one.weight[:, i])
        functions = [lines[:, :3]]
        if not linear:
            functions.append(_functions(history[0] / size[0], history[1] / size[1], one.line.index))
        columns.append(np.column_stack(functions) * weight[:, None])
        forces.append(lines[:, 3] * weight)
    A, b = np.concatenate(columns), np.concatenate(forces)
    A, b = np.concatenate([A.real, A.imag]), np.concatenate([b.real, b.imag])
    A = A / np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    rest = b - A @ np.linalg.lstsq(A, b, rcond=1e-9)[0]
    return float(rest @ rest), float(b @ b)


def _did(one: ReadOff, i: int) -> tuple[ComplexArray, FloatArray]:
    """Displacement, velocity, acceleration and force of coordinate `i` without the ends of the record, on its lines
    (K, 4) and in time (4, n)."""
    s, D = one.line.s, one.D[:, i]
    X = np.column_stack([D, s * D, s**2 * D, one.F[:, i]])
    history, lines = without_ends(in_time(X, one.line.index, one.line.record.n), one.line.index)
    return lines, history


def _functions(x: FloatArray, y: FloatArray, index: NDArray[np.int64]) -> ComplexArray:
    """Even and odd functions of the scaled displacement x (n,) and velocity y (n,), on the lines of numbers `index`
    (K, 6)."""
    history = np.array([x * np.abs(x), x**3, np.abs(x), y * np.abs(y), np.tanh(5.0 * y), y**3])
    return np.asarray(np.fft.rfft(history, axis=1)[:, index].T)
