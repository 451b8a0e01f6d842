"""Places that move the sensors alike, so that they do not crowd each other out while places are sorted out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.receptances import at_sensors, on_lines
from femend.estimate import Problem
from femend.model import Place, ReducedModel

__all__ = ["Distinct", "answers_beside", "distinct", "similarity", "similarity_to"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# lines on which the directions of a large model are compared
FEW = 12


def similarity(problem: Problem, reduced: ReducedModel, places: Sequence[Place], p: FloatArray) -> FloatArray:
    """How alike forces at places move the sensors: mean squared correlation (n, n) over the problem's lines.

    Every place has one force, `p` are the unknowns of the model. 1 where no sensor can tell two places apart. For few
    places; one against very many is `similarity_to`.
    """
    total, count = np.zeros((len(places), len(places))), 0
    for own in _directions(problem, reduced, places, p):
        total += np.abs(own.conj() @ own.T) ** 2
        count += 1
    return total / max(count, 1)


def similarity_to(
    problem: Problem, reduced: ReducedModel, place: Place, others: Sequence[Place], p: FloatArray
) -> FloatArray:
    """How alike a force at `place` and one at each of `others` move the sensors: that row (n,) of `similarity` at the
    unknowns `p`, in memory that grows with n and not with its square."""
    total, count = np.zeros(len(others)), 0
    for own in _directions(problem, reduced, [place, *others], p):
        total += np.abs(own[1:] @ own[0].conj()) ** 2
        count += 1
    return total / max(count, 1)


def answers_beside(
    problem: Problem, reduced: ReducedModel, place: Place, others: Sequence[Place], p: FloatArray
) -> FloatArray:
    """How many times as far a force at each of `others` moves the sensors as one at `place` (n,), along what that does
    to them, over the problem's lines; all with one force, at the unknowns `p` of the model."""
    along, own = np.zeros(len(others), dtype=complex), 0.0
    for h in _answers(problem, reduced, [place, *others], p):
        along += h[1:] @ h[0].conj()
        own += float(np.vdot(h[0], h[0]).real)
    return np.abs(along) / max(own, 1e-300)


def _directions(
    problem: Problem, reduced: ReducedModel, places: Sequence[Place], p: FloatArray
) -> Iterator[ComplexArray]:
    """Weighted accelerations (n, n_out) that a force at each place makes, of length one; line after line."""
    for h in _answers(problem, reduced, places, p):
        yield h / np.maximum(np.linalg.norm(h, axis=1), 1e-300)[:, None]


def _answers(problem: Problem, reduced: ReducedModel, places: Sequence[Place], p: FloatArray) -> Iterator[ComplexArray]:
    """Weighted accelerations (n, n_out) that a force of one at each place makes, line after line."""
    omega, zeta, Q = problem.modes(reduced, p)
    W = np.array([place.w(reduced.V, reduced.V_a)[0] for place in places]) @ Q
    for line in problem.lines(reduced):
        s, g, out = on_lines(line, reduced, omega, zeta, Q)
        for k in range(len(s)):
            yield (W * g[k]) @ out.T * line.weight[k] * abs(s[k]) ** 2


@dataclass(frozen=True, eq=False)
class Distinct:
    """Directions that move the sensors differently (`first`, their numbers), and for each those that no sensor tells
    from it (`twins`), both in the order given."""

    first: list[int]
    twins: list[list[int]]


def distinct(
    problem: Problem,
    reduced: ReducedModel,
    W: FloatArray,
    order: Sequence[int],
    p: FloatArray,
    count: int,
    alike: float,
    preference: Callable[[int], int],
) -> Distinct:
    """The first `count` of the directions `W` (n, r), taken in `order`, of which no two have a mean squared correlation
    above `alike`; of twins the one that `preference` has lowest leads. `p` (n_unknowns,) are those of the model."""
    few = problem.on(problem.records[:1]).thinned(FEW)
    omega, zeta, Q = few.modes(reduced, p)
    WQ = (W[list(order)] @ Q).astype(np.float32)
    parts = []
    for line in few.lines(reduced):
        s, g, out = on_lines(line, reduced, omega, zeta, Q)
        for H in at_sensors(s, g, out, line.weight):
            h = WQ @ H.real.astype(np.float32) + 1j * (WQ @ H.imag.astype(np.float32))
            parts.append(h / np.maximum(np.linalg.norm(h, axis=1), 1e-30)[:, None])
    left = np.ones(len(order), dtype=bool)
    found = Distinct([], [])
    numbers = list(order)
    while left.any() and len(found.first) < count:
        i = int(np.argmax(left))
        same = np.zeros(len(order))
        for h in parts:
            same += np.abs(h @ h[i].conj()) ** 2
        group = np.flatnonzero(left & (same / len(parts) > alike))
        group = np.union1d(group, [i])
        lead = min(group.tolist(), key=lambda n: (preference(numbers[n]), n))
        found.first.append(int(numbers[lead]))
        found.twins.append([numbers[n] for n in group.tolist() if n != lead])
        left[group] = False
    return found
