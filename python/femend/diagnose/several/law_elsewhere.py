"""Nodes at which the law that explains most would explain more.

A force in the few modes that something moves in does to the sensors what a force at many other nodes does, and a free
one takes up a little of everything: the place it acts at may come behind a dozen others. A law makes its force of its
own motion, and beside most of what is missing little else bends it: tried at all nodes it tells where it acts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.linear import CLOSELY, FEW_LINES, LAW_SD, TO_THE_END
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import HEATS, LINES, Located, refitted, squares_of
from femend.diagnose.locating.oversized import oversized
from femend.diagnose.naming.judge import Given
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.settings import Settings
from femend.diagnose.several.moved import resized
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Model, Place, ReducedModel
from femend.model.places.place import AXES
from femend.model.places.places import mass_place
from femend.physics import Physics

__all__ = ["MOST", "in_turn", "raced", "where_it_explains_more"]

FloatArray = NDArray[np.float64]

# nodes a law is tried at, joints first and then the nearest, how many of them go on, and the steps of a fit at each
MOST, KEPT, STEPS = 150, 2, 12
# nodes from which a law is followed to its end
FOLLOWED = 6


def where_it_explains_more(
    given: Given, places: Sequence[Place], ranked: Sequence[Ranked], null_score: float
) -> list[Located]:
    """The nodes, of all `places`, at which the best of the laws `ranked` leaves clearly less than where it was tried,
    with their free forces; none unless that is a linear law on the ground, which takes far more away from what the
    updated model leaves (`null_score`) than a law has to. An oscillator whose mass is much of the structure's is tried
    in every direction, and those nodes are told at which a likelier one leaves as little."""
    best = ranked[0] if ranked else None
    if best is None or not _may_be_elsewhere(best, null_score, given.settings):
        return []
    law, at, reduced = best.candidate, best.located.place, given.reduced
    assert law.physics is not None
    whole = _resists_all_ways(law)
    heavy = not whole and oversized(reduced.model, at, law.physics, law.values) > 0
    directions = {at.direction, *AXES[:3]} if heavy else {at.direction}
    had = [r.located.place for r in ranked if r.candidate.name == law.name]
    known = {(p.nodes, at.direction if whole else p.direction) for p in had}
    others = [p for p in places if p.kind == at.kind and p.n_w == 1 and p.direction in directions]
    others = in_turn(reduced.model, at, [p for p in others if (p.nodes, p.direction) not in known])
    others = others[: MOST * len(directions)]
    few = given.split.fitting.sparing(FEW_LINES)
    # where it was it has come to its end, and would be far ahead of all in a race
    here, left = _left(few, reduced, law, at, [at]), _left(few, reduced, law, at, others)
    if not here:
        return []
    costs = {i: fit.cost + _of_its_size(law.physics, reduced.model, others[i], fit) for i, fit in left.items()}
    least = here[0].cost + _of_its_size(law.physics, reduced.model, at, here[0])
    least -= 0.0 if heavy else given.settings.margin
    better = sorted((i for i in costs if costs[i] < least), key=lambda i: costs[i])[:KEPT]
    return _with_free_forces(given.split.whole, reduced, [(others[i], left[i].p) for i in better])


def _of_its_size(entry: Physics, model: Model, place: Place, fit: Fit) -> float:
    """Prior cost of a mass that a law came out with at a place."""
    return oversized(model, place, entry, entry.values_at(fit.x))


def _resists_all_ways(law: Candidate) -> bool:
    """Whether a law is a mass, which resists in all directions of its node."""
    return law.joint is not None and law.joint.place.kind == "mass"


def _may_be_elsewhere(best: Ranked, null_score: float, settings: Settings) -> bool:
    law = best.candidate
    if law.nonlinear or law.joint is None or law.physics is None or law.sigma > 0:
        return False
    place, own = best.located.place, law.joint.place
    won = null_score - best.score > settings.gain_cost
    return won and place.kind == "ground" and (own is place or _resists_all_ways(law))


def in_turn(model: Model, at: Place, places: Sequence[Place], *, nearest: bool = False) -> list[Place]:
    """Places at a node each, the nearest to the place `at` before others, and joints first unless the `nearest` are
    asked for."""
    xyz, here = model.xyz, model.xyz[model.index(at.nodes[0])]
    away = [float(np.linalg.norm(xyz[model.index(p.nodes[0])] - here)) for p in places]
    farthest = max(away, default=0.0) or 1.0
    # nodes that are as far away stay in the order of the list
    order = sorted(range(len(places)), key=lambda i: (places[i].unlikely and not nearest, round(away[i] / farthest, 9)))
    return [places[i] for i in order]


def _left(few: Problem, reduced: ReducedModel, law: Candidate, at: Place, places: Sequence[Place]) -> dict[int, Fit]:
    """Fits of a law of the place `at` to `few` lines at those of the `places` where it leaves least, by their numbers;
    of a mass that resists in all directions in all of each node."""
    assert law.physics is not None
    p = law.p[: len(few.prior(reduced)[0])]
    names = (law.physics.law or law.physics.name,)
    whole, hypotheses, starts = _resists_all_ways(law), [], []
    for place in places:
        # a mass is the same mass elsewhere
        x = law.x if whole else resized(few, reduced, law, p, at, place).x
        own = mass_place(reduced.model, place.nodes[0]) if whole else place
        hypotheses.append(Hypothesis(reduced, own.w(reduced.V, reduced.V_a), names, None, x, np.full(len(x), LAW_SD)))
        starts.append((p, x))
    return raced(few, hypotheses, starts)


def raced(
    few: Problem, hypotheses: Sequence[Hypothesis], starts: Sequence[tuple[FloatArray, FloatArray]]
) -> dict[int, Fit]:
    """Fits of the hypotheses that leave least of `few` lines, by their numbers; each from one of the `starts`, unknowns
    (n_p,) of the model and fit coordinates (n_x,) of the laws."""
    fits = few.fit(hypotheses, starts, iterations=STEPS, heats=HEATS)
    ahead = sorted((fit.cost, i, fit) for i, fit in enumerate(fits) if fit is not None)[:FOLLOWED]
    starts = [(fit.p, fit.x) for *_, fit in ahead]
    done = few.fit([hypotheses[i] for _, i, _ in ahead], starts, iterations=TO_THE_END, tolerance=CLOSELY)
    return {i: fit for (_, i, _), fit in zip(ahead, done, strict=True) if fit is not None}


def _with_free_forces(problem: Problem, reduced: ReducedModel, at: Sequence[tuple[Place, FloatArray]]) -> list[Located]:
    """Places with free forces, fitted from the unknowns of the model that a law there has led to."""
    few = problem.sparing(LINES)
    fits = few.fit([hypothesis_of(place, reduced) for place, _ in at], [(p, np.zeros(0)) for _, p in at])
    found = [
        Located(place, f, squares_of(few, f, 0.0)) for (place, _), f in zip(at, fits, strict=True) if f is not None
    ]
    return refitted(problem, found)
