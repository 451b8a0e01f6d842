"""A linear law at one of two places, named while the force at the other is free on every line; then the other's law.

A force that was read off is only as good as the model it was read off with, and a law fitted beside it takes up what is
wrong with it. A linear law needs no simulation: it is fitted on the lines with everything else free, the other place's
force too, so that nothing has to be known of that. What the other place did is then read off beside the law itself, and
both laws are fitted together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import KINDS
from femend.diagnose.fitting.known_force import rows_of
from femend.diagnose.fitting.likeliest_starts import likeliest_starts
from femend.diagnose.fitting.terms import Term
from femend.diagnose.locating.alike import with_look_alikes
from femend.diagnose.locating.dressed import hypothesis_of, with_own
from femend.diagnose.locating.joint import enlarged, open_joint
from femend.diagnose.locating.locate import Located, locate, shortlist, squares_of
from femend.diagnose.naming.judge import Given
from femend.diagnose.naming.name import name_physics
from femend.diagnose.naming.ranked import Ranked, told_simply
from femend.diagnose.several.equal_pairs import nonlinear_shares
from femend.diagnose.several.pairs import Searched, alike, others, plain, with_members
from femend.diagnose.several.parallel import starting
from femend.diagnose.several.read_beside import read_off_beside
from femend.diagnose.several.together import (
    Scored,
    Try,
    best_of,
    better,
    distinct,
    each_of,
    fitted_together,
    in_order,
    term_of,
)
from femend.estimate import Hypothesis, Problem
from femend.model import Place

__all__ = ["OneLinear", "located_beside", "one_linear"]

FloatArray = NDArray[np.float64]

# lines a record on which a place is fitted beside the other
LINES = 600


@dataclass(frozen=True, eq=False)
class _LinearOne:
    """Linear laws, in order of score, with the force at a place `free`, and the `problem` with it."""

    ranked: list[Ranked]
    free: Located
    problem: Problem


@dataclass(frozen=True, eq=False)
class OneLinear:
    """Two laws fitted together of which one is linear, with the linear laws that were tried, and the search in the
    window that they were fitted in."""

    first: Searched
    both: Scored
    linear: list[Ranked]


def one_linear(first: Searched, second: Located, at: Place) -> OneLinear | None:
    """Two laws fitted together, of which the one that is linear was named beside a free force at either of two places
    (the second with the fit of both forces, and the first); None where no linear law explains the recordings beside a
    free force, or nothing follows that one. Where their motion can be followed in a beginning of the records alone they
    are compared there."""
    found: list[OneLinear] = []
    for free, other in _least_linear_first(first, second, at):
        one = _beside(first, free, other, plain(first, second.fit.p))
        both = None if one is None else _both(first, one)
        if both is not None:
            found.append(both)
            if both.both[1].chosen <= first.settings.adequate:
                break
    return min(found, key=lambda f: in_order(first, f.both), default=None)


def _least_linear_first(first: Searched, second: Located, at: Place) -> list[tuple[Place, Place]]:
    """The places at which a force is free, each with the other one, where the linear law is looked for: first with the
    force free that is less like one of a linear law."""
    ways = [(at, second.place), (second.place, at)]
    if all(not place.part and place.n_w == 1 for place in (second.place, at)):
        of_second, of_first = nonlinear_shares(first.problem, second.fit)
        ways = ways[::-1] if of_second > of_first else ways
    return ways


def _beside(first: Searched, free: Place, other: Place, p: FloatArray) -> _LinearOne | None:
    """Linear laws anywhere that explain the recordings beside a force free at a place, from unknowns `p`."""
    # in a cut a law carries what the connection carried, and not what a force beside that does
    if free.kind not in KINDS or free.n_w != 1:
        return None
    rows = rows_of((free,), first.g_rows)
    reduced = enlarged((free,), first.reduced, first.problem.band[1], rows)
    problem = first.problem.driven_at(free)
    (null,) = problem.fit([Hypothesis(reduced, np.zeros((0, reduced.r)))], [(p, np.zeros(0))])
    if null is None:
        return None
    places = others(first, free)
    located = locate(problem, reduced, places, null)
    short = with_look_alikes(problem, reduced, shortlist(located), places, first.settings)
    given = Given(first.split.of(problem), reduced, rows, null.p, first.settings)
    ranked, _ = name_physics(given, short, clamps=[*short, *located])
    ranked = told_simply(ranked, first.settings)
    if not ranked or ranked[0].candidate.chosen > first.settings.adequate:
        return None
    at = located_beside(first, free, other, p)
    return None if at is None else _LinearOne(ranked, at, problem)


def located_beside(first: Searched, free: Place, other: Place, p: FloatArray) -> Located | None:
    """A place with its look-alikes, as it fits beside a force at another from unknowns `p` (n_p,) of the model; None
    where that breaks down."""
    beside = () if other.part else (other,)
    reduced = with_own(other, first.reduced) if other.part else first.reduced
    few, hypothesis = first.problem.sparing(LINES), hypothesis_of(free, reduced, beside)
    (fit,) = few.fit([hypothesis], [(with_members(first, p, hypothesis.reduced.extra), np.zeros(0))])
    if fit is None:
        return None
    one = Located(free, fit, squares_of(few, fit, 0.0))
    return with_look_alikes(first.problem, hypothesis.reduced, [one], first.places, first.settings)[0]


def _both(first: Searched, one: _LinearOne) -> OneLinear | None:
    """The linear law and the best of those that follow what the place beside it did; in the widest window that some
    explained on the way where none explains the recordings."""
    law, place = term_of(first, one.ranked[0]), one.free.place
    joint = open_joint(place, first.reduced, first.problem.band[1], first.g_rows)
    recovered = read_off_beside(one.problem, one.ranked[0], place)
    kept = likeliest_starts(joint, recovered)
    opened = replace(law.candidate, joint=joint)
    tries: list[Try] = [
        ([law, Term(starting(first, opened, name, start, recovered), one.free)], law.candidate.p)
        for name, start in kept.items()
    ]
    # what is far stiffer than the structure hardly moves, and follows its motion worse than the noise in that; alone it
    # may have been found
    here = [place, *alike(first, place)]
    alone = [r for r in first.ranked if any(r.located.place is like for like in here)]
    tries += [([law, term_of(first, r)], law.candidate.p) for r in (distinct(first, alone) if alone else ())]
    fitted = each_of(first, tries)
    best = best_of(first, tries, fitted)
    if best is None:
        return None
    window = min(both[1].followed for both in fitted if both is not None)
    if best[1].chosen > first.settings.adequate and np.isfinite(window):
        there = first.at(window)
        early = best_of(there, tries) if there.sigma == window else None
        if early is not None and early[1].chosen <= first.settings.adequate:
            first, best = there, early
    return OneLinear(first, _otherwise(first, one, best), one.ranked)


def _otherwise(first: Searched, one: _LinearOne, found: Scored) -> Scored:
    """The same with another linear law at the place of the first that did about as well beside a free force."""
    here = [r for r in one.ranked if r.located.place is one.ranked[0].located.place]
    for ranked in distinct(first, here)[1:]:
        tried = fitted_together(first, [term_of(first, ranked), *found[1].terms[1:]], found[1].p)
        found = better(first, found, tried) or found
    return found
