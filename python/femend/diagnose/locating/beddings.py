"""Elastic beddings that are worth a fit on whole records.

A bedding has one unknown that moves many modes far, so that few steps from an updated model, which has made up for it
with everything else, tell nothing. On strongly damped lines, from the deck's values, its fit is short and comes to its
end.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.dressed import hypothesis_of, with_form
from femend.diagnose.locating.linear_costs import linear_costs
from femend.estimate import Problem
from femend.model import Place, ReducedModel

__all__ = ["likely_beddings"]

FloatArray = NDArray[np.float64]

# decays of the lines in units of `Problem.scale`, steps of each fit, and how many beddings go on from each at most,
# within this multiple of the least cost
SIGMAS, STEPS, KEPT, NEAR = (8.0, 2.0), 12, 4, 1.3
# beddings from which on those alone are fitted that cost least after one linear step, and how many
MANY, SCREENED = 100, 30


def likely_beddings(
    plain: Problem, few: Problem, reduced: ReducedModel, places: Sequence[Place], beside: Sequence[Place] = ()
) -> list[tuple[Place, FloatArray]]:
    """Those of the beddings `places` that explain most of strongly damped lines beside free forces at `beside`, with
    the model's unknowns that they lead to on whole records: `plain` is the problem without unknowns of single modes,
    `few` the one with all."""
    bare = reduced if reduced.form is None else reduced.bare()
    kept: dict[Place, FloatArray] = {}
    for factor in SIGMAS:
        sigma = factor * plain.scale()
        some = _screened(plain, bare, places, sigma, beside)
        fits = plain.fit([hypothesis_of(p, bare, beside) for p in some], sigma=sigma, iterations=STEPS)
        done = [(place, fit) for place, fit in zip(some, fits, strict=True) if fit is not None]
        near = NEAR * min((fit.cost for _, fit in done), default=0.0)
        for place, fit in sorted(done, key=lambda one: one[1].cost)[:KEPT]:
            if fit.cost <= near:
                kept.setdefault(place, with_form(fit.p, bare, reduced))
    found = []
    for place, p in kept.items():
        hypothesis = hypothesis_of(place, reduced, beside)
        followed = few.continuation(hypothesis, [(few.tuned_like(p, hypothesis.reduced), np.zeros(0))])
        found += [] if followed is None else [(place, followed.p)]
    return found


def _screened(
    plain: Problem, reduced: ReducedModel, places: Sequence[Place], sigma: float, beside: Sequence[Place]
) -> Sequence[Place]:
    """The places themselves, or of many those that cost least after one linear step from the deck's values."""
    if len(places) <= MANY:
        return places
    none, deck = np.zeros((0, reduced.r)), plain.prior(reduced)[0]
    costs = linear_costs(plain, reduced, places, none, deck, sigma=sigma, beside=beside)
    return [places[i] for i in sorted(np.argsort(costs, kind="stable")[:SCREENED].tolist())]
