"""Two free forces at once, of all pairs of places: which pairs leave least, without a first place to start from.

With two effects no single place need show: one force follows neither, and places with several forces explain whatever
acts near them. So every two of the places with one force are put through one linear step together (`pair_costs`), on
strongly damped lines first, from the deck's values, the updated ones and those that single places came to; the best
pairs are fitted with the model's unknowns free. What they bring these to is near the truth, so that all pairs are put
through a step again from there, on lines less and less damped, up to whole records.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.linear_costs import directions, pair_costs
from femend.diagnose.locating.locate import (
    FEWEST_LINES,
    FIRST_SIGMA,
    FIRST_STEPS,
    LINES,
    TIE,
    Kin,
    Located,
    cost_of,
    fitted,
    hypothesis_of,
    squares_of,
)
from femend.diagnose.locating.preference import preference, with_one_force
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Place, ReducedModel

__all__ = ["best_pairs"]

FloatArray = NDArray[np.float64]

# kinds of places that the sensors tell apart, of which every two are tried, the likeliest where there are more
MOST = 120
# lines a record of a linear step; pairs that are fitted of each start's at first, and later
STEP_LINES, FIRST_PAIRS, NEXT_PAIRS = 24, 60, 12
# starts that single places bring, and pairs that go on from stage to stage
SINGLES, ENDS = 4, 3
# decays of the stages after the first, in units of `Problem.scale`, and the steps of their fits
STAGES, STEPS = (2.0, 0.5, 0.0, 0.0), 8

_Pair = tuple[int, int]


@dataclass(frozen=True, eq=False)
class _Kinds:
    """One place of every kind that the sensors tell apart, the likeliest, and which pairs of them move the sensors
    alike (n, n)."""

    places: list[Place]
    W: FloatArray
    alike: NDArray[np.bool_]


def best_pairs(
    problem: Problem, reduced: ReducedModel, places: Sequence[Place], located: Sequence[Located], null: Fit
) -> list[tuple[Place, Located]]:
    """The best pairs of places with one force each, in rising order of cost: the first place, and the second with both
    forces' fit. `located` are single places, `null` the updated model; none where fewer than two kinds are told
    apart."""
    kinds = _kinds(problem, reduced, places, null)
    n_out = min(r.y.shape[0] for r in problem.records)
    if len(kinds.places) < 2 or n_out < 3:
        return []
    ends = _begun(problem, reduced, kinds, _starts(problem, reduced, located, null))
    for stage in STAGES:
        ends = _further(problem, reduced, kinds, ends, stage * problem.scale())
    few = problem.sparing(LINES)
    return [(kinds.places[i], Located(kinds.places[j], fit, squares_of(few, fit, 0.0))) for (i, j), fit in ends]


def _kinds(problem: Problem, reduced: ReducedModel, places: Sequence[Place], null: Fit) -> _Kinds:
    single = sorted(filter(with_one_force, places), key=preference)
    if not single:
        return _Kinds([], np.zeros((0, reduced.r)), np.zeros((0, 0), dtype=bool))
    kin = Kin.of(problem, reduced, single, null)
    kept = kin.first(single)[:MOST]
    own = [single[i] for i in kept]
    alike = np.array([[kin.alike(i, j) for j in kept] for i in kept])
    shared = np.array([[bool(set(a.elements) & set(b.elements)) for b in own] for a in own])
    return _Kinds(own, directions(reduced, own), alike | shared)


def _starts(problem: Problem, reduced: ReducedModel, located: Sequence[Located], null: Fit) -> list[FloatArray]:
    """Unknowns of the model without frequency factors and damping ratios of single modes: the deck's, the updated
    ones, and those of the best single places."""
    plain = problem.sparing(FEWEST_LINES).untuned()
    singles = [f.fit.p for f in located if len(f.fit.p) == len(null.p)][:SINGLES]
    return [plain.prior(reduced)[0], *(plain.tuned_like(p, reduced) for p in (null.p, *singles))]


def _begun(
    problem: Problem, reduced: ReducedModel, kinds: _Kinds, starts: Sequence[FloatArray]
) -> list[tuple[_Pair, Fit]]:
    """The best pairs on the most strongly damped lines, from several starts."""
    plain, sigma = problem.sparing(FEWEST_LINES).untuned().pressed(), FIRST_SIGMA * problem.scale()
    screen = problem.thinned(STEP_LINES).untuned().pressed()
    tries = [(pair, p) for p in starts for pair in _stepped(screen, reduced, kinds, p, sigma, FIRST_PAIRS)]
    return _fitted(plain, reduced, kinds, tries, sigma, FIRST_STEPS)


def _further(
    problem: Problem, reduced: ReducedModel, kinds: _Kinds, ends: Sequence[tuple[_Pair, Fit]], sigma: float
) -> list[tuple[_Pair, Fit]]:
    """The best pairs on less damped lines: those that were, and the best after a linear step from where they are."""
    lines, screen = problem.sparing(LINES), problem.thinned(STEP_LINES)
    if sigma > problem.scale():
        lines, screen = lines.pressed(), screen.pressed()
    tries: list[tuple[_Pair, FloatArray]] = []
    for pair, fit in ends:
        p = lines.tuned_like(fit.p, reduced)
        tries += [(pair, p), *((other, p) for other in _stepped(screen, reduced, kinds, p, sigma, NEXT_PAIRS))]
    return _fitted(lines, reduced, kinds, tries, sigma, STEPS)


def _stepped(
    lines: Problem, reduced: ReducedModel, kinds: _Kinds, p: FloatArray, sigma: float, count: int
) -> list[_Pair]:
    """The first pairs after one linear step from the unknowns `p`."""
    costs = pair_costs(lines, reduced, kinds.W, p, sigma=sigma)
    costs[kinds.alike | ~np.tri(len(costs), k=-1, dtype=bool).T] = np.inf
    first = np.argsort(costs, axis=None, kind="stable")[:count]
    return [
        (int(i), int(j)) for i, j in zip(*np.unravel_index(first, costs.shape), strict=True) if costs[i, j] < np.inf
    ]


def _fitted(
    lines: Problem,
    reduced: ReducedModel,
    kinds: _Kinds,
    tries: Sequence[tuple[_Pair, FloatArray]],
    sigma: float,
    steps: int,
) -> list[tuple[_Pair, Fit]]:
    """The best pairs after fits from their starts, no two alike."""
    pairs = [pair for pair, _ in tries]
    hypotheses = dict[int, Hypothesis]()
    for n, (i, j) in enumerate(pairs):
        hypotheses[n] = hypothesis_of(kinds.places[j], reduced, (kinds.places[i],))
    ranked = fitted(
        lines, hypotheses, [(n, p) for n, (_, p) in enumerate(tries)], sigma, steps, [kinds.places[j] for _, j in pairs]
    )
    # a force between two places and one at either do what one at each does
    ranked.sort(key=lambda item: cost_of(lines, item[1], sigma) + TIE * _between(kinds, pairs[item[0]]))
    kept: list[tuple[_Pair, Fit]] = []
    for n, fit in ranked:
        if len(kept) < ENDS and all(pairs[n] != pair for pair, _ in kept):
            kept.append((pairs[n], fit))
    return kept


def _between(kinds: _Kinds, pair: _Pair) -> int:
    """How many of two places are between others."""
    return sum(kinds.places[i].kind == "pair" for i in pair)
