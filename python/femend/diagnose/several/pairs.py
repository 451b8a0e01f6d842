"""Two places at once: the pair whose free forces together leave least."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.evidence import price
from femend.diagnose.locating.classes import similarity_to
from femend.diagnose.locating.dressed import with_own_unknowns, without_own_unknowns
from femend.diagnose.locating.locate import (
    ALIKE,
    COMPARED_LINES,
    LINES,
    SEVERAL_WORTH,
    Located,
    hypothesis_of,
    locate,
    shortlist,
    squares_of,
)
from femend.diagnose.locating.pair_screen import best_pairs
from femend.diagnose.locating.preference import LIKELIER, preference
from femend.diagnose.locating.screen import is_many
from femend.diagnose.locating.split import Split
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.settings import Settings
from femend.diagnose.several.equal_pairs import likeliest_equal
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Place, ReducedModel

__all__ = ["Searched", "alike", "likely_pairs", "others", "pair", "plain", "updated", "with_members"]

FloatArray = NDArray[np.float64]

# places from which the search for a pair of places starts
FIRSTS = 3
# how often a search looks for the first place again
TURNS = 2
# pairs that are told
PAIRS = 4


@dataclass(frozen=True, eq=False)
class Searched:
    """What the search for one effect worked on and found: the records apart, places, laws in order of score, and the
    score of what they have to beat, `floor` the score that noise alone leaves; all in a window exp(-sigma t).
    `in_window` gives the same in another, where that can be done."""

    problem: Problem
    reduced: ReducedModel
    g_rows: list[int]
    split: Split
    places: Sequence[Place]
    located: Sequence[Located]
    ranked: Sequence[Ranked]
    settings: Settings
    n_values: float
    null_score: float
    floor: float
    sigma: float = 0.0
    in_window: Callable[[float], Searched] | None = None

    def at(self, sigma: float) -> Searched:
        """The same in another window exp(-sigma t); itself where there is no other."""
        return self if sigma == self.sigma or self.in_window is None else self.in_window(sigma)

    @property
    def one_force_explains(self) -> bool:
        """Whether a single free force explains each of the whole recordings: nothing acts elsewhere, and a law at its
        place that does not explain them was lost on the way. Several forces at one place explain what acts near it, and
        one for which the model has to bend stands in for something else: where either is all that explains, it is not
        one."""
        settings, simple = self.settings, [f for f in self.located if f.place.n_w <= 1]
        return any(float(np.max(f.fit.misfit)) <= settings.adequate and not settings.bends(f.fit.prior) for f in simple)

    @property
    def price(self) -> float:
        """Score that a parameter of a law costs."""
        return price(self.settings, self.n_values)


def pair(first: Searched, *, thorough: bool = True) -> tuple[Located, Place] | None:
    """The likeliest of the `likely_pairs`; None where there are none."""
    return next(iter(likely_pairs(first, thorough=thorough)), None)


def likely_pairs(first: Searched, *, thorough: bool = True) -> list[tuple[Located, Place]]:
    """Pairs of places whose free forces together leave least, if that is clearly less than one leaves: the second with
    the fit of both, and the first. After the likeliest those that explain the recordings without bending the model, and
    those that are nearly as likely, at most `PAIRS` in all.

    With two effects the best single place may be a compromise; so the search starts from several and, whatever second
    place it finds, looks for the first one again. Where no two places with one force are found to explain the
    recordings so, the model near its priors, all pairs of them are gone through, if `thorough`. Two forces at wrong
    places may leave as little as
    at the right ones; of pairs that the recordings do not tell apart the likeliest is taken, by its forces and places.
    """
    found = _one_after_the_other(first)
    if thorough and not any(_plainly(first, one) for one in found) and not is_many(first.places):
        null = updated(first)
        pairs = [] if null is None else best_pairs(first.problem, first.reduced, first.places, first.located, null)
        found += [(second, at) for at, second in pairs]
    if not found:
        return []
    least = min(_believed(second.cost, second.place, at) for second, at in found)
    alone = min(_believed(f.cost, f.place) for f in first.located)
    if alone - least < first.settings.gain_cost:
        return []
    ranked = sorted(found, key=_rank)
    second, at = ranked[0]
    if not is_many(first.places):
        second, at = likeliest_equal(first.problem, first.reduced, first.places, second, at)
    kept = [(second, at)]
    for one in sorted(ranked, key=lambda one: (not _plainly(first, one), _rank(one))):
        near = _plainly(first, one) or _rank(one) < _rank(ranked[0]) + first.settings.gain_cost
        if len(kept) < PAIRS and near and not any(_same_pair(one, other) for other in kept):
            kept.append(one)
    return kept


def _plainly(first: Searched, pair: tuple[Located, Place]) -> bool:
    """Whether one force at each of two places explains the recordings, and the model hardly bends beside them."""
    second, at = pair
    single = max(second.place.n_w, at.n_w) <= 1
    return single and second.fit.score <= first.settings.adequate and second.fit.prior <= first.settings.gain_cost


def _rank(pair: tuple[Located, Place]) -> float:
    """Cost of a pair with what speaks against its places."""
    second, at = pair
    return _believed(second.cost, second.place, at) + LIKELIER * (preference(second.place) + preference(at))


def _same_pair(one: tuple[Located, Place], other: tuple[Located, Place]) -> bool:
    """Whether two pairs are of the same places, in either order."""
    return {id(one[0].place), id(one[1])} == {id(other[0].place), id(other[1])}


def updated(first: Searched) -> Fit | None:
    """The updated model fitted from where the best single place brought it."""
    start = plain(first, first.located[0].fit.p)
    (fit,) = first.problem.sparing(LINES).fit(
        [Hypothesis(first.reduced, np.zeros((0, first.reduced.r)))], [(start, np.zeros(0))]
    )
    return fit


def _believed(cost: float, *places: Place) -> float:
    """Cost of places, as much more where one of them has several forces as it has to explain more to be believed."""
    return cost * (SEVERAL_WORTH if any(place.n_w > 1 for place in places) else 1.0)


def _one_after_the_other(first: Searched) -> list[tuple[Located, Place]]:
    """Pairs of places found by looking for a second beside a first, from several first ones."""
    found: list[tuple[Located, Place]] = []
    tried: list[Place] = []
    for start in _starts(first):
        at: Located | None = start
        for _ in range(TURNS):
            if at is None or any(at.place is p for p in tried):
                break
            tried.append(at.place)
            beside = _beside(first, at)
            found += [(second, at.place) for second in beside]
            at = _alone(first, beside[0].place) if beside else None
    return found


def _starts(first: Searched) -> list[Located]:
    """Places to start from: the best law's, and the best that do not move the sensors alike."""
    found = [first.ranked[0].located, *shortlist(first.located)]
    kept: list[Located] = []
    for one in found:
        if len(kept) < FIRSTS and not any(_same(first, one.place, k.place) for k in kept):
            kept.append(one)
    return kept


def _same(first: Searched, a: Place, b: Place) -> bool:
    """Whether two places move the sensors alike, or share an element."""
    if a is b or set(a.elements) & set(b.elements):
        return True
    if a.n_w != 1 or b.n_w != 1:
        return a.kind == b.kind and a.nodes == b.nodes
    few = first.problem.on(first.problem.records[:1]).thinned(COMPARED_LINES)
    row = similarity_to(few, first.reduced, a, [b], first.problem.prior(first.reduced)[0])
    return bool(row[0] > ALIKE)


def others(first: Searched, place: Place) -> list[Place]:
    """Places at which something further may be missing beside a place: those that move the sensors otherwise."""
    like = {id(p) for p in alike(first, place)}
    return [
        p for p in first.places if id(p) not in like and p is not place and not set(p.elements) & set(place.elements)
    ]


def alike(first: Searched, place: Place) -> list[Place]:
    """Places that move the sensors like a place of one direction, in the order of `first.places`; none where it has
    several."""
    if place.n_w != 1:
        return []
    single = [p for p in first.places if p.n_w == 1 and p is not place]
    few = first.problem.on(first.problem.records[:1]).thinned(COMPARED_LINES)
    row = similarity_to(few, first.reduced, place, single, first.problem.prior(first.reduced)[0])
    return [p for p, r in zip(single, row, strict=True) if r > ALIKE]


def _beside(first: Searched, at: Located) -> list[Located]:
    """The best places beside another, with forces free at both (a member has its factor)."""
    part = at.place.part
    reduced = at.fit.hypothesis.reduced if part else first.reduced
    found = locate(first.problem, reduced, others(first, at.place), at.fit, () if part else (at.place,))
    possible = [f for f in shortlist(found) if f.place.kind != "base"]
    return [f for f in possible if f.cost < possible[0].cost + first.settings.margin]


def _alone(first: Searched, place: Place) -> Located | None:
    """A place by itself, as the search for one place found it or from the deck's values."""
    known = next((f for f in first.located if f.place is place), None)
    if known is not None:
        return known
    few, hypothesis = first.problem.thinned(LINES), hypothesis_of(place, first.reduced)
    p = with_members(first, plain(first, first.located[0].fit.p), hypothesis.reduced.extra)
    (fit,) = few.fit([hypothesis], [(p, np.zeros(0))])
    return None if fit is None else Located(place, fit, squares_of(few, fit, 0.0))


def plain(first: Searched, p: FloatArray) -> FloatArray:
    """Unknowns `p` of a model with members' factors without these."""
    return without_own_unknowns(p, first.reduced, len(p) - len(first.problem.prior(first.reduced)[0]))


def with_members(first: Searched, p: FloatArray, count: int) -> FloatArray:
    """Unknowns `p` (n_p,) of the model with `count` ones of members and soft clamps, at the values these start from."""
    return with_own_unknowns(p, first.reduced, np.zeros(count))
