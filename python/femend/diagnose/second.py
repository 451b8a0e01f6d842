"""More than one effect: what is left beside the first law is looked for in the same way, with its force as an input."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.alike import with_look_alikes
from femend.diagnose.beside import companions
from femend.diagnose.collapse import collapsed
from femend.diagnose.dressed import with_own
from femend.diagnose.known_force import Known, forces_of_laws, free_forces
from femend.diagnose.locate import Located, locate, shortlist, squares_of
from femend.diagnose.name import Ranked, name_physics
from femend.diagnose.pairs import Searched, others, pair, plain, with_members
from femend.diagnose.terms import Term, Terms, refit_terms
from femend.diagnose.together import Scored, brings, fitted_together, gained
from femend.estimate import Hypothesis
from femend.model import Place

__all__ = ["Further", "Searched", "look_further"]

FloatArray = NDArray[np.float64]

# laws of different names at a place that are tried together with those at the other
TOGETHER = 2
# how much the score of what was found may be above what noise leaves, in `gain_cost`, before anything further is looked
# for
WORTH = 1.5
# share of what is wrong with the updated model from which the best law is taken for one of the two effects
FIRST_SHARE = 0.5
# standard deviation of the best determined parameter of a law (ln units) from which its size is not known
UNDETERMINED = 0.33
# lines a record on which the terms that are kept are fitted
FINAL_LINES = 600


@dataclass(frozen=True, eq=False)
class Further:
    """Several effects at once: their terms fitted to all records, the laws tried at each in the terms' order, and the
    score on unseen data."""

    terms: Terms
    laws: tuple[tuple[Ranked, ...], ...]
    score: float


def look_further(first: Searched) -> Further | None:
    """Two effects where one law at one place leaves much that two laws explain, at two places or, where the sensors
    cannot tell two, beside each other; None otherwise."""
    near = _beside(first)
    if near is not None:
        return near
    places = pair(first) if _worth_looking(first) else None
    return None if places is None else _named(first, *places)


def _beside(first: Searched) -> Further | None:
    """The best law with a spring or a dashpot beside it, where they explain the recordings."""
    if not first.ranked or any(r.frf is not None for r in first.problem.records):
        return None
    best = first.ranked[0]
    found = companions(first, best)
    if found is None or found[1].chosen > first.settings.adequate:
        return None
    return _further(first, found, [r for r in first.ranked if r.located is best.located])


def _worth_looking(first: Searched) -> bool:
    """Whether more is left than a law can be asked to explain, with sensors enough to tell two forces."""
    records = first.problem.records
    if not first.ranked or min(r.y.shape[0] for r in records) < 3 or any(r.frf is not None for r in records):
        return False
    best = first.ranked[0]
    left = best.score - first.price * best.candidate.n_law - first.floor
    return best.candidate.chosen > first.settings.adequate and left > WORTH * first.settings.gain_cost


@dataclass(frozen=True, eq=False)
class _Aside:
    """What is there while one effect is looked for: known forces, members with a factor and springs that are part of
    the model, its unknowns p."""

    known: Known
    members: tuple[Place, ...]
    p: FloatArray


def _named(first: Searched, second: Located, at: Located) -> Further | None:
    """Names both effects, each with the force of the other as an input; fitted together they have to win against one
    law alone.

    The best law found so far is taken for one of the two where it explains the greater part; if nothing comes of it,
    the force read off at the second place. Where no force anywhere explains what that law leaves, there is no second.
    """
    nothing = Known((), {r.name: () for r in first.problem.records})
    best = first.ranked[0]
    if first.null_score - best.score > FIRST_SHARE * (first.null_score - first.floor):
        aside, beside = _next_to(first, best, nothing)
        if beside is None:
            return None
        found = _in_turns(first, best, first.ranked, aside, beside)
        if found is not None:
            return found
    free = _free(first, second, at)
    one = _search(first, free, others(first, second.place))
    if not one:
        return None
    aside, beside = _next_to(first, one[0], free.known)
    return _in_turns(first, one[0], one, aside, beside)


def _next_to(first: Searched, one: Ranked, given: Known) -> tuple[_Aside, list[Ranked] | None]:
    """The force of the law `one` beside what is `given`, and what the search beside it finds."""
    aside = _of_law(first, one, given)
    return aside, _search(first, aside, others(first, one.located.place))


def _in_turns(
    first: Searched, one: Ranked, laws: Sequence[Ranked], aside: _Aside, two: Sequence[Ranked] | None
) -> Further | None:
    """The law `one`, whose force is `aside`, with those found beside it, `two`; and the first named again beside the
    second."""
    if not two:
        return None
    here = [r for r in laws if r.located.place is one.located.place]
    found = _together(first, (here, two))
    if found is not None and found.terms.chosen <= first.settings.adequate:
        return found
    _, again = _next_to(first, two[0], aside.known)
    better = _together(first, (again, two)) if again else None
    both = [f for f in (found, better) if f is not None]
    return min(both, key=lambda f: f.score, default=None)


def _search(first: Searched, aside: _Aside, places: Sequence[Place]) -> list[Ranked] | None:
    """Laws at the best of the places, in order of score: the search for one effect again, beside what is known. None
    where no force at any of them explains what a law has to."""
    reduced = first.reduced
    for member in aside.members:
        reduced = with_own(member, reduced)
    reduced, rows = aside.known.basis(reduced, first.problem.band[1], first.g_rows)
    problem = first.problem.on([aside.known.on(r) for r in first.problem.records])
    split = aside.known.split(first.split)
    start = with_members(first, aside.p, sum(m.n_own for m in aside.members))
    (null,) = problem.fit([Hypothesis(reduced, np.zeros((0, reduced.r)))], [(start, np.zeros(0))])
    if null is None:
        return []
    located = locate(problem, reduced, places, null)
    gained = null.prior + squares_of(problem, null, 0.0) - min((f.cost for f in located), default=np.inf)
    if gained < first.settings.gain_cost:
        return None
    short = with_look_alikes(problem, reduced, shortlist(located), places, first.settings)
    ranked, _ = name_physics(split, reduced, short, rows, first.settings, null.p, clamps=[*short, *located])
    return [replace(r, name=collapsed(r.candidate, r.recovered, first.settings).name) for r in ranked]


def _free(first: Searched, second: Located, at: Located) -> _Aside:
    """The free force at the second place as the recordings show it."""
    p = plain(first, second.fit.p)
    if second.place.part:
        return _Aside(Known((), {r.name: () for r in first.problem.records}), (second.place,), p)
    both = [f.place for f in (second, at) if not f.place.part]
    forces = free_forces(first.problem, second.fit, both)
    known = Known((second.place,), {name: f[:1] for name, f in forces.forces.items()}, forces.attached[:1])
    return _Aside(known, (), p)


def _of_law(first: Searched, ranked: Ranked, given: Known) -> _Aside:
    """A law that was found: a spring as part of the model, since what it was fitted to was not it alone, any other by
    its force."""
    nothing = Known((), {r.name: () for r in first.problem.records})
    candidate = ranked.candidate
    p = plain(first, candidate.p)
    if ranked.name == "support_stiffness" and candidate.joint is not None and not given.places:
        k = collapsed(candidate, ranked.recovered, first.settings).values["k"]
        return _Aside(nothing, (replace(candidate.joint.place, spring=k),), p)
    if candidate.joint is None:
        return _Aside(nothing, (ranked.located.place,), p)
    known = forces_of_laws(first.problem.on([given.on(r) for r in first.problem.records]), candidate)
    return _Aside(nothing if known is None else known, (), p)


def _together(first: Searched, laws: Sequence[Sequence[Ranked]]) -> Further | None:
    """The best of the laws at each place fitted together; None where they do not win against less."""
    best: Scored | None = None
    tries = [
        (
            [Term(collapsed(r.candidate, r.recovered, first.settings), r.located) for r in chosen],
            plain(first, chosen[-1].candidate.p),
        )
        for chosen in itertools.product(*(_distinct(first, ranked) for ranked in laws))
    ]
    for terms, p in tries:
        best = _better(first, best, fitted_together(first, terms, p))
    if best is not None and len(tries) > 1:
        # once more from where the best came to: a descent that stopped short is no reason for another name
        reached = {(t.candidate.name, id(t.located.place)): t for t in best[1].terms}
        p = plain(first, best[1].p)
        for terms, _ in tries:
            again = [reached.get((t.candidate.name, id(t.located.place)), t) for t in terms]
            best = _better(first, best, fitted_together(first, again, p))
    if best is None or not _won(first, *best) or not all(map(_determined, best[1].terms)) or _needless(first, *best):
        return None
    return _further(first, best, [r for every in laws for r in every])


def _further(first: Searched, found: Scored, tried: Sequence[Ranked]) -> Further:
    """The terms fitted to all records, each with the laws `tried` at its place: of two at one place the first, a law
    beside it stands by itself."""
    score, terms = found
    whole = refit_terms(first.problem.thinned(FINAL_LINES), terms)
    laws: list[tuple[Ranked, ...]] = []
    named: list[Place] = []
    for term in whole.terms:
        here = tuple(r for r in tried if r.located.place is term.located.place)
        alone = not here or any(term.located.place is p for p in named)
        laws.append((Ranked(term.candidate, term.located, score, name=term.candidate.name),) if alone else here)
        named.append(term.located.place)
    return Further(whole, tuple(laws), score)


def _better(first: Searched, best: Scored | None, found: Scored | None) -> Scored | None:
    """The one with the lower score; with fewer parameters unless the other wins by what a law has to bring."""
    if best is None or found is None:
        return found if best is None else best
    if best[1].n_law == found[1].n_law:
        return min(best, found, key=lambda one: one[0])
    simple, rich = sorted((best, found), key=lambda one: one[1].n_law)
    return rich if brings(first, simple, rich) else simple


def _distinct(first: Searched, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The first laws of different names that score about as well as the best."""
    kept: list[Ranked] = []
    for r in ranked:
        new = r.name not in [k.name for k in kept]
        if new and len(kept) < TOGETHER and r.score < ranked[0].score + first.settings.gain_cost:
            kept.append(r)
    return kept


def _won(first: Searched, value: float, found: Terms) -> bool:
    """Whether several laws bring against one what one has to bring against none: the noise is what they can reach (a
    score of nothing), since free forces at two places leave less than any law where sensors are few."""
    one = first.ranked[0]
    share = (one.score - value) / max(one.score, 1e-12)
    whole = (first.null_score - value) / max(first.null_score, 1e-12)
    won = gained(first, one.score - value, one.candidate.chosen, one.candidate.prior, found)
    return won and bool(min(share, whole) >= first.settings.explained)


def _determined(term: Term) -> bool:
    """Whether the recordings tell the size of a law at all: at least one of its parameters (ln units)."""
    candidate = term.candidate
    if candidate.covariance is None:
        return True
    n = len(candidate.x) if candidate.coordinates is None else len(candidate.x) - 2
    n = term.located.place.n_own if term.member else n
    return bool(np.sqrt(np.diag(candidate.covariance)[:n].min(initial=np.inf)) < UNDETERMINED)


def _needless(first: Searched, value: float, found: Terms) -> bool:
    """Whether one of the terms, fitted as thoroughly as all of them together, does as well by itself."""
    for term in found.terms:
        alone = None if term.member else fitted_together(first, [term], found.p)
        if alone is not None and not brings(first, alone, (value, found)):
            return True
    return False
