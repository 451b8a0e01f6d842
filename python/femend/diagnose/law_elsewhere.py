"""Nodes at which the law that explains most would explain more.

A force in the few modes that something moves in does to the sensors what a force at many other nodes does, and a free
one takes up a little of everything: the place it acts at may come behind a dozen others. A law makes its force of its
own motion, and beside most of what is missing little else bends it: tried at all nodes it tells where it acts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.candidates import Candidate
from femend.diagnose.dressed import hypothesis_of
from femend.diagnose.judge import Given
from femend.diagnose.linear import FEW_LINES, LAW_SD
from femend.diagnose.locate import LINES, Located, refitted, squares_of
from femend.diagnose.moved import resized
from femend.diagnose.ranked import Ranked
from femend.diagnose.settings import Settings
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Place, ReducedModel

__all__ = ["where_it_explains_more"]

FloatArray = NDArray[np.float64]

# nodes a law is tried at, joints first, how many of them go on, and the steps of a fit at each
MOST, KEPT, STEPS = 60, 2, 12


def where_it_explains_more(
    given: Given, places: Sequence[Place], ranked: Sequence[Ranked], null_score: float
) -> list[Located]:
    """The nodes, of all `places`, at which the best of the laws `ranked` leaves clearly less than where it was tried,
    with their free forces; none unless that is a linear law on the ground, which takes far more away from what the
    updated model leaves (`null_score`) than a law has to."""
    best = ranked[0] if ranked else None
    if best is None or not _may_be_elsewhere(best, null_score, given.settings):
        return []
    law, at = best.candidate, best.located.place
    had = [r.located.place for r in ranked if r.candidate.name == law.name]
    others = [p for p in places if p.kind == at.kind and p.n_w == 1 and p.direction == at.direction]
    others = [p for p in sorted(others, key=lambda p: p.unlikely) if not any(p is q for q in had)][:MOST]
    few, reduced = given.split.fitting.sparing(FEW_LINES), given.reduced
    left = _left(few, reduced, law, at, [at, *others])
    here = left.pop(0, None)
    if here is None:
        return []
    better = [i for i, fit in left.items() if fit.cost < here.cost - given.settings.margin]
    better = sorted(better, key=lambda i: left[i].cost)[:KEPT]
    return _with_free_forces(given.split.whole, reduced, [(others[i - 1], left[i].p) for i in better])


def _may_be_elsewhere(best: Ranked, null_score: float, settings: Settings) -> bool:
    law = best.candidate
    if law.nonlinear or law.joint is None or law.physics is None or law.sigma > 0:
        return False
    place = best.located.place
    won = null_score - best.score > settings.gain_cost
    return won and place.kind == "ground" and law.joint.place is place


def _left(few: Problem, reduced: ReducedModel, law: Candidate, at: Place, places: Sequence[Place]) -> dict[int, Fit]:
    """Fits of a law of the place `at` to `few` lines at each of the `places`, by their numbers; without those that
    break down."""
    assert law.physics is not None
    p = law.p[: len(few.prior(reduced)[0])]
    names = (law.physics.law or law.physics.name,)
    hypotheses, starts = [], []
    for place in places:
        x = resized(few, reduced, law, p, at, place).x
        w = place.w(reduced.V, reduced.V_a)
        hypotheses.append(Hypothesis(reduced, w, names, None, x, np.full(len(x), LAW_SD)))
        starts.append((p, x))
    fits = few.fit(hypotheses, starts, iterations=STEPS)
    return {i: fit for i, fit in enumerate(fits) if fit is not None}


def _with_free_forces(problem: Problem, reduced: ReducedModel, at: Sequence[tuple[Place, FloatArray]]) -> list[Located]:
    """Places with free forces, fitted from the unknowns of the model that a law there has led to."""
    few = problem.sparing(LINES)
    fits = few.fit([hypothesis_of(place, reduced) for place, _ in at], [(p, np.zeros(0)) for _, p in at])
    found = [
        Located(place, f, squares_of(few, f, 0.0)) for (place, _), f in zip(at, fits, strict=True) if f is not None
    ]
    return refitted(problem, found)
