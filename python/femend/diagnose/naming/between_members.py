"""Places between nodes of different members, where no place that the model suggests explains the recordings.

The deck shows where members meet, where parts face each other and what is held; a brace that it lacks may join any two
nodes. There are thousands of such pairs, and most do what a force at one of their nodes does. So they are asked where
one force at no place listed explains the recordings, all in one linear step, and those taken with which it leaves
clearly less.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femend.diagnose.locating.classes import similarity_to
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import (
    ALIKE,
    COMPARED_LINES,
    FEWEST_LINES,
    SEVERAL_WORTH,
    Located,
    fitted,
    order,
    refitted,
    squares_of,
)
from femend.diagnose.locating.preference import with_one_force
from femend.diagnose.locating.screen import screened
from femend.diagnose.locating.sensed import sensed_places
from femend.diagnose.recordings.crossing import explains
from femend.diagnose.updating.update import UpdatedModel
from femend.estimate import Fit
from femend.model import Place
from femend.model.places.member_pairs import pairs_between_members
from femend.model.places.places import topology

__all__ = ["with_pairs_between"]

# steps that each pair is fitted with, and how many go on
STEPS, KEPT = 10, 3


def with_pairs_between(
    start: UpdatedModel, located: list[Located], places: Sequence[Place]
) -> tuple[list[Located], list[Place]]:
    """The places `located` of all `places`, and these, with pairs of nodes of different members at which one force
    leaves clearly less than at any of them, and what the sensors cannot tell from these; both as they were where a
    force at one of them explains the recordings."""
    problem, reduced = start.problem, start.reduced
    single = [one for one in located if with_one_force(one.place)]
    if not single or explains(start.null) or any(explains(one.fit) for one in single[:KEPT]):
        return located, list(places)
    n_out = min(len(r.y) for r in problem.records)
    if problem.load is not None or n_out < 2 + problem.n_free:
        return located, list(places)
    listed = pairs_between_members(reduced.model, topology(reduced.model), places)
    pairs = sensed_places(problem, reduced, listed)
    if not pairs:
        return located, list(places)
    found = _fitted(start, single[0], screened(problem, reduced, pairs, start.null))
    best = min(one.cost for one in single)
    found = [one for one in found if SEVERAL_WORTH * one.cost < best][:KEPT]
    if not found:
        return located, list(places)
    few = problem.on(problem.records[:1]).thinned(COMPARED_LINES)
    alike = np.zeros(len(pairs), dtype=bool)
    for one in found:
        alike |= similarity_to(few, reduced, one.place, pairs, one.fit.p) > ALIKE
    return sorted([*located, *found], key=order), [*places, *(pairs[i] for i in np.flatnonzero(alike))]


def _fitted(start: UpdatedModel, best: Located, pairs: Sequence[Place]) -> list[Located]:
    """The `pairs` with their free forces, in rising order of cost, the first `KEPT` fitted to all lines; each from the
    unknowns of the model that the place `best` came to, the updated ones and the deck's."""
    problem, reduced = start.problem, start.reduced
    few = problem.sparing(FEWEST_LINES)
    hypotheses = [hypothesis_of(place, reduced) for place in pairs]
    starts = [(i, p) for p in (best.fit.p, start.null.p, few.prior(reduced)[0]) for i in range(len(pairs))]
    nearest: dict[int, Fit] = {}
    for i, fit in fitted(few, hypotheses, starts, 0.0, STEPS, pairs):
        nearest.setdefault(i, fit)
    first = sorted((Located(pairs[i], fit, squares_of(few, fit, 0.0)) for i, fit in nearest.items()), key=order)[:KEPT]
    return refitted(problem, first)
