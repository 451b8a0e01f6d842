"""More than one effect: what is left beside the first law is looked for in the same way, with its force as an input."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.alike import with_look_alikes
from femend.diagnose.classes import similarity
from femend.diagnose.collapse import name_of
from femend.diagnose.known_force import Known, forces_of_laws, free_forces
from femend.diagnose.locate import (
    ALIKE,
    COMPARED_LINES,
    LINES,
    TIE,
    Located,
    hypothesis_of,
    locate,
    preference,
    shortlist,
    squares_of,
    with_member,
)
from femend.diagnose.name import Ranked, Split, name_physics
from femend.diagnose.settings import Settings
from femend.diagnose.terms import Term, Terms, fit_terms, judge_terms, refit_terms
from femend.estimate import Hypothesis, Problem
from femend.model import Place, ReducedModel

__all__ = ["Further", "Searched", "look_further"]

FloatArray = NDArray[np.float64]

# places from which the search for a pair of places starts
FIRSTS = 3
# laws of different names at a place that are tried together with those at the other
TOGETHER = 2
# how much the score of what was found may be above what noise leaves, in `gain_cost`, before anything further is looked
# for
WORTH = 1.5
# lines a record on which the terms that are kept are fitted
FINAL_LINES = 600


@dataclass(frozen=True, eq=False)
class Searched:
    """What the search for one effect worked on and found: the records apart, places, laws in order of score, and the
    score of what they have to beat, `floor` the score that noise alone leaves."""

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

    def score(self, found: Terms) -> float:
        """Tempered squares on unseen data, prior of the model's unknowns, and a price for every parameter."""
        return self.n_values * float(np.log(max(found.chosen, 1e-12))) + found.prior + self.price * found.n_law

    @property
    def price(self) -> float:
        """Score that a parameter of a law costs."""
        return self.settings.price * float(np.log(max(self.n_values, np.e)))


@dataclass(frozen=True, eq=False)
class Further:
    """Several effects at once: their terms fitted to all records, the laws tried at each in the terms' order, and the
    score on unseen data."""

    terms: Terms
    laws: tuple[tuple[Ranked, ...], ...]
    score: float


def look_further(first: Searched) -> Further | None:
    """Two effects where one law at one place leaves much that two laws at two places explain; None otherwise."""
    if not _worth_looking(first):
        return None
    pair = _pair(first)
    if pair is None:
        return None
    return _named(first, *pair)


def _worth_looking(first: Searched) -> bool:
    """Whether more is left than a law can be asked to explain, with sensors enough to tell two forces."""
    records = first.problem.records
    if not first.ranked or min(r.y.shape[0] for r in records) < 3 or any(r.frf is not None for r in records):
        return False
    best = first.ranked[0]
    left = best.score - first.price * best.candidate.n_law - first.floor
    return left > WORTH * first.settings.gain_cost


def _pair(first: Searched) -> tuple[Located, Located] | None:
    """Two places whose free forces together leave least, if that is clearly less than one leaves: the fit of both, and
    the first by itself.

    With two effects the best single place may be a compromise; so the search starts from several and, whatever second
    place it finds, looks for the first one again.
    """
    one = [f for f in first.located if f.place.kind != "base"]
    if not one:
        return None
    alone = min(f.cost for f in first.located)
    best: tuple[float, Located, Located] | None = None
    tried: list[Place] = []
    for start in _starts(first):
        at = start
        for _ in range(2):
            if any(at.place is p for p in tried):
                break
            tried.append(at.place)
            second = _beside(first, at)
            if second is None:
                break
            cost = second.cost + TIE * (preference(second.place) + preference(at.place))
            if best is None or cost < best[0]:
                best = (cost, second, at)
            again = _alone(first, second.place)
            if again is None:
                break
            at = again
    if best is None or alone - best[1].cost < first.settings.gain_cost:
        return None
    return best[1], best[2]


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
    matrix = similarity(few, first.reduced, [a, b], first.problem.prior(first.reduced)[0])
    return bool(matrix[0, 1] > ALIKE)


def _others(first: Searched, place: Place) -> list[Place]:
    """Places at which something further may be missing beside a place: those that move the sensors otherwise."""
    if place.n_w != 1:
        return [p for p in first.places if p is not place and not set(p.elements) & set(place.elements)]
    single = [p for p in first.places if p.n_w == 1]
    few = first.problem.on(first.problem.records[:1]).thinned(COMPARED_LINES)
    matrix = similarity(few, first.reduced, [place, *single], first.problem.prior(first.reduced)[0])
    alike = {id(p) for p, r in zip(single, matrix[0, 1:], strict=True) if r > ALIKE}
    return [p for p in first.places if id(p) not in alike and not set(p.elements) & set(place.elements)]


def _beside(first: Searched, at: Located) -> Located | None:
    """The best place beside another, with forces free at both (a member has its factor)."""
    member = at.place.kind == "member"
    reduced = at.fit.hypothesis.reduced if member else first.reduced
    found = locate(first.problem, reduced, _others(first, at.place), at.fit, () if member else (at.place,))
    possible = [f for f in shortlist(found) if f.place.kind != "base"]
    return possible[0] if possible else None


def _alone(first: Searched, place: Place) -> Located | None:
    """A place by itself, as the search for one place found it or from the deck's values."""
    known = next((f for f in first.located if f.place is place), None)
    if known is not None:
        return known
    few, hypothesis = first.problem.thinned(LINES), hypothesis_of(place, first.reduced)
    p = _with_members(first, _plain(first, first.located[0].fit.p), hypothesis.reduced.extra)
    (fit,) = few.fit([hypothesis], [(p, np.zeros(0))])
    return None if fit is None else Located(place, fit, squares_of(few, fit, 0.0))


@dataclass(frozen=True, eq=False)
class _Aside:
    """What is taken as known while one effect is looked for: forces, members with a factor, unknowns p of the model."""

    known: Known
    members: tuple[Place, ...]
    p: FloatArray


def _named(first: Searched, second: Located, at: Located) -> Further | None:
    """Names both effects, each with the force of the other as an input: of the first place with the free force of the
    second, then in turns with the forces of the laws; fitted together they have to win against one law alone."""
    free = _free(first, second, at)
    stronger = _search(first, free, [at.place])
    if not stronger:
        return None
    law = _of_law(first, stronger[0], free.known)
    weaker = _search(first, law, _others(first, at.place))
    if not weaker:
        return None
    other = _of_law(first, weaker[0], law.known)
    stronger = _search(first, other, _others(first, weaker[0].located.place)) or stronger
    return _together(first, (stronger, weaker))


def _search(first: Searched, aside: _Aside, places: Sequence[Place]) -> list[Ranked]:
    """Laws at the best of the places, in order of score: the search for one effect again, beside what is known."""
    reduced = first.reduced
    for member in aside.members:
        reduced = with_member(member, reduced)
    reduced, rows = aside.known.basis(reduced, first.problem.band[1], first.g_rows)
    problem = first.problem.on([aside.known.on(r) for r in first.problem.records])
    split = aside.known.split(first.split)
    start = _with_members(first, aside.p, len(aside.members))
    (null,) = problem.fit([Hypothesis(reduced, np.zeros((0, reduced.r)))], [(start, np.zeros(0))])
    if null is None:
        return []
    located = locate(problem, reduced, places, null)
    short = with_look_alikes(problem, reduced, shortlist(located), places, first.settings)
    ranked, _ = name_physics(split, reduced, short, rows, first.settings, null.p)
    return [replace(r, name=name_of(r.candidate, r.recovered, first.settings)) for r in ranked]


def _plain(first: Searched, p: FloatArray) -> FloatArray:
    """Unknowns `p` of a model with members' factors without these."""
    n = len(first.reduced.names)
    tuned = len(first.problem.prior(first.reduced)[0]) - n
    return np.concatenate([p[:n], p[len(p) - tuned :]])


def _with_members(first: Searched, p: FloatArray, count: int) -> FloatArray:
    """Unknowns of the model with the factors of `count` members, as they are in the deck."""
    n = len(first.reduced.names)
    return np.concatenate([p[:n], np.zeros(count), p[n:]])


def _free(first: Searched, second: Located, at: Located) -> _Aside:
    """The free force at the second place as the recordings show it."""
    p = _plain(first, second.fit.p)
    if second.place.kind == "member":
        return _Aside(Known((), {r.name: () for r in first.problem.records}), (second.place,), p)
    both = [f.place for f in (second, at) if f.place.kind != "member"]
    forces = free_forces(first.problem, second.fit, both)
    known = Known((second.place,), {name: f[:1] for name, f in forces.forces.items()})
    return _Aside(known, (), p)


def _of_law(first: Searched, ranked: Ranked, given: Known) -> _Aside:
    """The force of a law that was found."""
    nothing = Known((), {r.name: () for r in first.problem.records})
    candidate = ranked.candidate
    p = _plain(first, candidate.p)
    if candidate.joint is None:
        return _Aside(nothing, (ranked.located.place,), p)
    known = forces_of_laws(first.problem.on([given.on(r) for r in first.problem.records]), candidate)
    return _Aside(nothing if known is None else known, (), p)


def _together(first: Searched, laws: Sequence[Sequence[Ranked]]) -> Further | None:
    """The best of the laws at each place fitted together; None where they do not win against less."""
    best: tuple[float, Terms] | None = None
    for chosen in itertools.product(*(_distinct(first, ranked) for ranked in laws)):
        terms = [Term(replace(r.candidate, name=r.name or r.candidate.name), r.located) for r in chosen]
        p = _plain(first, chosen[-1].candidate.p)
        found = fit_terms(first.split.fitting, terms, first.reduced, first.g_rows, p)
        if found is None:
            continue
        found = judge_terms(first.split.choosing, found)
        value = first.score(found)
        if np.isfinite(value) and (best is None or value < best[0]):
            best = (value, found)
    if best is None or not _won(first, *best):
        return None
    whole = refit_terms(first.problem.thinned(FINAL_LINES), best[1])
    tried = {id(r.located.place): tuple(every) for every in laws for r in every}
    return Further(whole, tuple(tried[id(t.located.place)] for t in whole.terms), best[0])


def _distinct(first: Searched, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The first laws of different names that score about as well as the best."""
    kept: list[Ranked] = []
    for r in ranked:
        new = r.name not in [k.name for k in kept]
        if new and len(kept) < TOGETHER and r.score < ranked[0].score + first.settings.gain_cost:
            kept.append(r)
    return kept


def _won(first: Searched, value: float, found: Terms) -> bool:
    """Whether several laws bring against one what one has to bring against none."""
    settings, one = first.settings, first.ranked[0]
    gain = one.score - value
    chosen = float(np.log(one.candidate.chosen / max(found.chosen, 1e-12)))
    relieved = one.candidate.prior - found.prior
    share = gain / max(one.score - first.floor, 1e-12)
    whole = (first.null_score - value) / max(first.null_score - first.floor, 1e-12)
    won = gain > settings.gain_cost and (chosen > settings.gain_chosen or relieved > settings.gain_cost)
    return bool(won and min(share, whole) >= settings.explained)
