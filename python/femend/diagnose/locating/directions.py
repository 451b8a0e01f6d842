"""Places in directions in which none was tried: many places in one direction may leave the same little, and drive out
all others before any law was fitted."""

from __future__ import annotations

from collections.abc import Sequence

from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import LINES, SEVERAL_WORTH, Located, fitted, order, refitted, squares_of
from femend.estimate import Fit, Problem
from femend.model import Place, ReducedModel

__all__ = ["in_other_directions"]

# places of a direction that are fitted, joints first, and how many of them go on
MOST, KEPT = 40, 5
# steps that each is fitted with
STEPS = 10


def in_other_directions(
    problem: Problem,
    reduced: ReducedModel,
    places: Sequence[Place],
    null: Fit,
    located: Sequence[Located],
    tried: Sequence[Place],
) -> list[Located]:
    """The best places of each direction in which none of those `tried` has one force, in rising order of cost.

    Each is fitted from the unknowns of the best place `located` and from the deck's own; a direction is left out where
    a force along it leaves clearly more than elsewhere, or takes away less than half of what the best one takes from
    the updated model (fit `null`): no sensor sees every direction.
    """
    had = {p.direction for p in tried if p.n_w == 1 and p.kind != "base"}
    # to the ground and between two points each by themselves: the motions that a law sees there differ
    groups: dict[tuple[str, bool], list[Place]] = {}
    for place in sorted(places, key=lambda p: p.unlikely):
        if place.n_w == 1 and place.kind != "base" and place.direction not in had:
            groups.setdefault((place.direction, place.kind == "ground"), []).append(place)
    best = next((f for f in located if f.place.n_w == 1), None)
    if best is None:
        return []
    few = problem.sparing(LINES)
    deck = problem.prior(reduced)[0]
    found: list[Located] = []
    for group in groups.values():
        hypotheses = [hypothesis_of(p, reduced) for p in group[:MOST]]
        starts = [(i, p) for p in (best.fit.p, deck) for i in range(len(hypotheses))]
        nearest: dict[int, Fit] = {}
        for i, fit in fitted(few, hypotheses, starts, 0.0, STEPS, group):
            nearest.setdefault(i, fit)
        own = [Located(group[i], fit, squares_of(few, fit, 0.0)) for i, fit in nearest.items()]
        # joints first: nodes between them move alike, so that the best ones would all be near each other
        found += sorted(own, key=lambda one: (one.place.unlikely, order(one)))[:KEPT]
    most = min(SEVERAL_WORTH * best.cost, 0.5 * (null.cost + best.cost))
    return [one for one in refitted(problem, found) if one.cost < most]
