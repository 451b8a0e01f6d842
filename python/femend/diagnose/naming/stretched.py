"""A spring to ground, or an elastic bedding, that won, against beddings with other ends.

What holds a structure along a line or over an area does to few modes nearly what a spring at its middle does, and a
bedding of which one end is off by a node nearly what the right one does. From where the best law put the model, ends
are moved by a node or a row of faces as long as the recordings ask for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.evidence import deviance
from femend.diagnose.locating.dressed import hypothesis_of, own_span, with_own_unknowns, without_own_unknowns
from femend.diagnose.locating.locate import LINES, Located, squares_of
from femend.diagnose.naming.judge import Given, judge_in
from femend.diagnose.naming.laws_at import linear_at
from femend.diagnose.naming.ranked import Ranked
from femend.estimate import Fit, Problem
from femend.model import Place
from femend.model.beddings.bed_extents import BedExtents
from femend.model.beddings.bed_places import Beds
from femend.threads import at_once

__all__ = ["with_other_ends"]

FloatArray = NDArray[np.float64]

# how often ends are moved at most, and the fall of the cost for which they are
ROUNDS, WORTH = 20, 1.0


def with_other_ends(given: Given, ranked: list[Ranked]) -> list[Ranked]:
    """Laws in rising order of score, with the bedding that the first of them leads to, if it is a spring to ground or a
    bedding: before it where it wins against it, behind it where it is not told apart."""
    best = ranked[0] if ranked else None
    if best is None or not _holds(best) or not _could_win(given, best):
        return ranked
    found = _moved(given, best)
    if found is None:
        return ranked
    judge = judge_in(given, 0.0)
    others = [judge.ranked(one) for one in linear_at(given, found, False)[0]]
    if best.located.place.bed:
        # ends that leave hardly less are no better than those at hand
        near = best.score - given.settings.margin
        others = [one if one.score < near else replace(one, score=max(one.score, best.score)) for one in others]
    return judge.in_order([*ranked, *others])


def _holds(best: Ranked) -> bool:
    """Whether a law holds the structure against the ground by stiffness alone."""
    candidate, place = best.candidate, best.located.place
    return (
        candidate.name == "support_stiffness" and candidate.sigma == 0 and (bool(place.bed) or place.kind == "ground")
    )


def _could_win(given: Given, best: Ranked) -> bool:
    """Whether a bedding that leaves what a free force does, and bends nothing, would win against the best law."""
    candidate, n_values = best.candidate, given.n_values()
    least = min(candidate.reference, candidate.chosen)
    gain = deviance(candidate.chosen, n_values) - deviance(least, n_values) + candidate.prior
    return bool(best.located.place.bed) or gain > given.settings.gain_cost


def _moved(given: Given, best: Ranked) -> Located | None:
    """The bedding with the ends that leave least, with its fit; None where none can be fitted, or the best one has them
    already."""
    reduced, place = given.reduced, best.located.place
    whole = given.split.whole
    extents, few = BedExtents(Beds(reduced, whole.band[1])), whole.sparing(LINES)
    p, k = best.candidate.p, best.candidate.values["k"]
    if place.bed:
        p = without_own_unknowns(p, reduced, place.n_own)
    now = _best(given, few, [place] if place.bed else extents.about(place), p, k)
    if now is None:
        return None
    seen = {_ends(place), _ends(now[0])}
    for _ in range(ROUNDS):
        n_own, own = now[0].n_own, own_span(now[1].hypothesis.reduced)
        p, k = without_own_unknowns(now[1].p, reduced, n_own), now[0].values(now[1].p[own])["k"]
        further = [one for one in extents.next_to(now[0]) if _ends(one) not in seen]
        seen.update(map(_ends, further))
        new = _best(given, few, further, p, k)
        if new is None or new[1].cost > now[1].cost - WORTH:
            break
        now = new
    if place.bed and _ends(now[0]) == _ends(place):
        return None
    return Located(now[0], now[1], squares_of(few, now[1], 0.0))


def _ends(place: Place) -> frozenset[int]:
    """What a bedding holds."""
    return frozenset(place.bed_nodes)


def _best(given: Given, few: Problem, beds: Sequence[Place], p: FloatArray, k: float) -> tuple[Place, Fit] | None:
    """The bedding that leaves least of the lines of `few`, fitted from unknowns `p` of the model and the stiffness `k`
    in all; None where none can be fitted or holds anything."""
    hypotheses = [hypothesis_of(bed, given.reduced) for bed in beds]
    starts = [
        (few.tuned_like(with_own_unknowns(p, given.reduced, bed.logarithms({"k": k})), h.reduced), np.zeros(0))
        for bed, h in zip(beds, hypotheses, strict=True)
    ]
    # a bedding moves modes far, so that one with other ends is far from where this one put the model
    fits = at_once(lambda i: few.continuation(hypotheses[i], [starts[i]]), range(len(beds)))
    held = [
        (bed, fit)
        for bed, fit in zip(beds, fits, strict=True)
        if fit is not None and bed.values(fit.p[own_span(fit.hypothesis.reduced)])["k"] > 0
    ]
    return min(held, key=lambda one: one[1].cost, default=None)
