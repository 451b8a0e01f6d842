"""Laws that were named, tried at places that move the sensors alike: a force there does the same, a law does not quite.

A force at a place next to the true one does to the sensors what the true one does. But a law makes its force of its own
motion, which tells more: at another place, of the size at which it does the same work there and fitted again, it leaves
more than at its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import KINDS, Candidate
from femend.diagnose.fitting.linear import refit_linear
from femend.diagnose.fitting.nonlinear import refit_nonlinear
from femend.diagnose.fitting.pace import OUTDONE
from femend.diagnose.fitting.runs import windows
from femend.diagnose.fitting.terms import Term, fit_terms
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.locating.preference import preference
from femend.diagnose.several.law_elsewhere import in_turn
from femend.diagnose.several.moved import moved
from femend.diagnose.several.pairs import Searched, alike, plain
from femend.diagnose.several.together import Scored, fitted_together, may_be_beaten, shows
from femend.model import Place

FloatArray = NDArray[np.float64]

__all__ = ["at_the_best_place", "at_the_best_places"]

# places at which a law is tried too, and lines a record on which a nonlinear one is fitted there
TRIED, LINES = 4, 600
# rounds in which two laws are moved
ROUNDS = 2
# nodes near to that of one of two laws at which it is tried, those of them that are followed, and which law in turn
NEARBY, FOLLOWED, _TURNS = 8, 2, (1, 0, 1, 0)


def at_the_best_place(first: Searched, law: Candidate, located: Located) -> tuple[Candidate, Located]:
    """A law that was fitted to all recordings, with its place, or with one at which it leaves clearly less."""
    known = law.joint is not None and law.joint.place is located.place
    if not known or not shows(first.settings, law.chosen, law.reference):
        return law, located  # no law leaves clearly less than the free force here does
    best = law, located
    for place in _worth_trying(first, located.place):
        term = moved(first, Term(law, located), place)
        one = _fitted(first, term)
        if one is None:
            continue
        there = _refitted(first, term, one.fit.p)
        if there.prior < best[0].prior + first.settings.margin:
            best = (there, one) if shows(first.settings, best[0].fitted, there.fitted) else best
    return best


def at_the_best_places(first: Searched, found: Scored) -> Scored:
    """Laws that were fitted together, moved one after the other to where all of them leave clearly less; once more
    where one was, since the other was judged beside it where it had been."""
    for _ in range(ROUNDS):
        worth = [(i, place) for i, term in reversed(list(enumerate(found[1].terms))) for place in _near(first, term)]
        if not worth:
            break
        before, least = found, _in_the_beginning(first, found[1].terms, found[1].p)
        for i, place in worth:
            terms = [moved(first, t, place) if j == i else t for j, t in enumerate(found[1].terms)]
            if _in_the_beginning(first, terms, found[1].p) > OUTDONE * max(least, 1.0):
                continue
            tried = fitted_together(first, terms, found[1].p)
            if tried is None or tried[0] >= found[0]:
                continue
            found = tried if shows(first.settings, found[1].fitted, tried[1].fitted) else found
        if found is before:
            break
    return _at_nearby_nodes(first, found)


def _at_nearby_nodes(first: Searched, found: Scored) -> Scored:
    """Two laws on the ground, of which one has to be simulated, that leave more than noise, each in turn at the nodes
    near to where it is, whether those move the sensors alike or not, as long as clearly less is left there: of laws
    near to each other either may have come out on the wrong side of the other, and both have to be where they are for
    the noise to tell it."""
    terms = found[1].terms
    if len(terms) != 2 or not any(t.candidate.nonlinear for t in terms) or not may_be_beaten(first, found):
        return found
    stayed = 0
    for i in _TURNS:
        if stayed == len(terms):
            break
        terms = found[1].terms
        least = _in_the_beginning(first, terms, found[1].p)
        begun = []
        for place in _nearby(first, terms[i], terms[1 - i]):
            there = [moved(first, t, place) if j == i else t for j, t in enumerate(terms)]
            begun.append((_in_the_beginning(first, there, found[1].p), there))
        before = found
        for left, there in sorted(begun, key=lambda one: one[0])[:FOLLOWED]:
            tried = fitted_together(first, there, found[1].p) if left < least else None
            found = tried if tried is not None and tried[0] < found[0] - first.settings.margin else found
        stayed = stayed + 1 if found is before else 0
    return found


def _nearby(first: Searched, term: Term, other: Term) -> list[Place]:
    """Ground at the nodes nearest to that of a term with one coordinate there, along its axis, but for that of the
    other term; none for terms elsewhere."""
    at = term.place
    if at is None or at.kind != "ground" or at.n_w != 1 or other.place is at:
        return []
    known = (at, other.located.place)
    like = [p for p in first.places if p.kind == at.kind and p.n_w == 1 and p.direction == at.direction]
    return in_turn(first.reduced.model, at, [p for p in like if not any(p is k for k in known)], nearest=True)[:NEARBY]


def _near(first: Searched, term: Term) -> list[Place]:
    """Places of `_worth_trying` for a term's own."""
    return [] if term.place is None else _worth_trying(first, term.place)


def _in_the_beginning(first: Searched, terms: Sequence[Term], p: FloatArray) -> float:
    """What laws leave of the beginnings of the records once they are fitted there, which takes a simulation a small
    part of its time; nothing of linear ones, which need none, and where all are compared in the beginning."""
    beginning = windows(first.problem)[0]
    if first.sigma >= beginning or not any(t.candidate.nonlinear for t in terms):
        return 0.0
    made = fit_terms(first.split.fitting, terms, first.reduced, first.g_rows, plain(first, p), beginning)
    return np.inf if made is None else made.fitted


def _refitted(first: Searched, term: Term, p: FloatArray) -> Candidate:
    """A law fitted to all recordings where it is now, from unknowns `p` that a free force there led to: those it had
    were bent by where it was."""
    law = replace(term.candidate, p=p)
    if not law.nonlinear:
        return refit_linear(first.problem, law)
    found = fitted_together(first, [replace(term, candidate=law)], p)
    law = law if found is None else found[1].terms[0].candidate
    return refit_nonlinear(first.problem.thinned(LINES), law)


def _worth_trying(first: Searched, place: Place) -> list[Place]:
    """Joints on the ground that move the sensors like a place with one coordinate, the likeliest first: what acts
    between joints comes out there by itself, if anywhere. None for a cut, whose law carries what it cut."""
    if place.kind not in KINDS:
        return []
    ground = [p for p in alike(first, place) if p.kind == "ground" and not p.unlikely]
    return sorted(ground, key=preference)[:TRIED]


def _fitted(first: Searched, term: Term) -> Located | None:
    """The place of a term that was moved, with a free force fitted at it; None where that breaks down."""
    place, like = term.located.place, term.located.alike
    known = next((f for f in first.located if f.place is place), None)
    if known is not None:
        return replace(known, alike=like)
    few, p = first.problem.sparing(LINES), plain(first, term.candidate.p)
    (fit,) = few.fit([hypothesis_of(place, first.reduced)], [(p, np.zeros(0))])
    return None if fit is None else Located(place, fit, squares_of(few, fit, 0.0), like)
