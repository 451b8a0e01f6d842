"""The places of a large model sorted out before the stages of locating: a hundred thousand are, a hundred go on.

A fit of one place takes a tenth of a second where there are a hundred sensors, so that not all can be tried. One linear
step of all takes seconds (`linear_costs.py`); it is made on strongly damped lines from the deck's values and from the
updated ones, as the first stage does, and from the updated ones on lines damped no more than it takes a whole record
to close.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.classes import distinct
from femend.diagnose.locating.linear_costs import directions, linear_costs
from femend.diagnose.locating.preference import preference
from femend.estimate import Fit, Problem
from femend.model import Place, ReducedModel

__all__ = ["is_many", "screened", "without_poor_regions"]

FloatArray = NDArray[np.float64]

# places with one force up to which all of them are fitted
MANY = 1500
# decay of the first screen, in units of `Problem.scale`, and lines a record of it and of the one on records that have
# just closed
SIGMA, DAMPED_LINES, WHOLE_LINES = 8.0, 24, 16
# how many go on from each start: members, kinds of places with one force, places with several
KEPT = (6, 16, 4)
# regions of shells and solids, and connections, up to which all of them are fitted, and how many go on from each start
# otherwise
MANY_REGIONS, REGIONS = 24, 12
# places with one force that are compared, the first of the order; squared correlation above which two are of one kind;
# kinds of which the likest places go on too, and how many of each
COMPARED, TWINS, FIRST_KINDS, WITH_FIRST = 6000, 0.999, 3, 3


def is_many(places: Sequence[Place]) -> bool:
    """Whether places are too many to fit each of them."""
    return sum(place.n_w == 1 for place in places) > MANY


def screened(
    problem: Problem, reduced: ReducedModel, places: Sequence[Place], null: Fit, beside: Sequence[Place] = ()
) -> list[Place]:
    """The places that are worth a fit, in their order: those that cost least after one linear step, of those with one
    force one of each kind that the sensors tell apart, and every motion of the base. `null` is the fit of the model as
    it is; at the places `beside` forces are free."""
    W = directions(reduced, places)
    kept = {i for i, place in enumerate(places) if place.kind == "base" or place.springs}
    for lines, p, sigma in _starts(problem, reduced, null):
        costs = linear_costs(lines, reduced, places, W, p, sigma=sigma, beside=beside)
        kept |= _best(problem, reduced, places, W, costs, null.p)
    return [places[i] for i in sorted(kept)]


def without_poor_regions(
    problem: Problem, reduced: ReducedModel, places: Sequence[Place], null: Fit, beside: Sequence[Place] = ()
) -> list[Place]:
    """The places without those regions of shells and solids, and connections, that cost more than others after one
    linear step; in their order, `null` and `beside` as of `screened`. The patches of a mesh are many, and most of them
    much alike."""
    regions = [i for i, place in enumerate(places) if place.kind in ("region", "connection")]
    if len(regions) <= MANY_REGIONS:
        return list(places)
    own = [places[i] for i in regions]
    kept: set[int] = set()
    for lines, p, sigma in _starts(problem, reduced, null):
        costs = linear_costs(lines, reduced, own, np.zeros((0, reduced.r)), p, sigma=sigma, beside=beside)
        kept.update(np.argsort(costs, kind="stable")[:REGIONS].tolist())
    left_out = {i for n, i in enumerate(regions) if n not in kept}
    return [place for i, place in enumerate(places) if i not in left_out]


def _starts(problem: Problem, reduced: ReducedModel, null: Fit) -> list[tuple[Problem, FloatArray, float]]:
    """Lines, unknowns of the model and decay of each screen."""
    damped = problem.thinned(DAMPED_LINES).untuned().pressed()
    sigma = SIGMA * problem.scale()
    return [
        (damped, damped.prior(reduced)[0], sigma),
        (damped, damped.tuned_like(null.p, reduced), sigma),
        (problem.thinned(WHOLE_LINES), null.p, 0.0),
    ]


def _best(
    problem: Problem,
    reduced: ReducedModel,
    places: Sequence[Place],
    W: FloatArray,
    costs: FloatArray,
    p: FloatArray,
) -> set[int]:
    """The best places by their costs (n,), with the first ones' twins."""
    row = np.cumsum([0, *(place.n_w for place in places)])
    groups: tuple[list[int], list[int], list[int]] = ([], [], [])
    for i in np.argsort(costs, kind="stable").tolist():
        if np.isfinite(costs[i]) and places[i].kind != "base":
            groups[min(places[i].n_w, 2)].append(i)
    single = groups[1][:COMPARED]
    of_row = {int(row[i]): i for i in single}
    kinds = distinct(
        problem, reduced, W, list(of_row), p, KEPT[1], TWINS, lambda at: preference(places[of_row[at]])
    )  # fmt: skip
    rows = [*kinds.first, *(at for twins in kinds.twins[:FIRST_KINDS] for at in twins[:WITH_FIRST])]
    return {*groups[0][: KEPT[0]], *(of_row[at] for at in rows), *groups[2][: KEPT[2]]}
