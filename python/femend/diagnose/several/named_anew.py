"""The linear one of two laws named anew, beside the other one's force.

A law that was named beside a force free on every line competed with linear laws alone, since a free force takes up most
of what a nonlinear one does beyond them: a spring stiffer one way than the other does what an elastic one does, and the
rest is in the other force. Once both laws stand, that other force is known as well as its law, and what the place did
beside it shows which laws follow it; each is fitted together with the other law and has to win against the linear one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.fitting.candidates import KINDS
from femend.diagnose.fitting.known_force import Known, known_from
from femend.diagnose.fitting.likeliest_starts import likeliest_starts
from femend.diagnose.fitting.terms import Terms
from femend.diagnose.locating.dressed import with_own
from femend.diagnose.locating.joint import Joint, open_joint
from femend.diagnose.locating.recovered import Recovered, recover
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.parallel import starting
from femend.diagnose.several.together import Scored, best_of, better, each_of, fitted_together, may_be_beaten

__all__ = ["force_of_the_other", "named_anew"]


def named_anew(first: Searched, found: Scored) -> tuple[Scored, list[Ranked]]:
    """Two laws that were fitted together, each linear one as the law at its place that does clearly better beside the
    other; as they are where they leave no more than a law has to bring. With the laws at the places of those that gave
    way, in order of the scores that they have beside the other."""
    compared: list[Ranked] = []
    for i in range(len(found[1].terms)):
        if _may_be_another(first, found, i):
            found, laws = _anew(first, found, i)
            compared += laws
    return found, compared


def _may_be_another(first: Searched, found: Scored, i: int) -> bool:
    """Whether law i of two is a linear one of one coordinate at a place of its own, and so much is left that another
    could win against it."""
    terms = found[1].terms
    if len(terms) != 2 or terms[i].place is None or terms[i].candidate.nonlinear:
        return False
    term, other = terms[i], terms[1 - i]
    assert term.place is not None
    apart = other.member or (other.place is not term.place and other.located.place.kind in KINDS)
    return apart and term.place.kind in KINDS and term.n_w == 1 and may_be_beaten(first, found)


def _anew(first: Searched, found: Scored, i: int) -> tuple[Scored, list[Ranked]]:
    """The two laws with law i as the best of those that follow what its place did beside the other, and how these and
    law i compare; none where it stays."""
    term, p = found[1].terms[i], found[1].p
    read = _read_off(first, found[1], i)
    if read is None or term.candidate.joint is None:
        return found, []
    joint, recovered = read
    tries = [
        (
            [
                replace(term, candidate=starting(first, term.candidate, name, start, recovered)) if j == i else t
                for j, t in enumerate(found[1].terms)
            ],
            p,
        )
        for name, start in likeliest_starts(joint, recovered).items()
        if start.physics.kind == "nonlinear"
    ]
    fitted = each_of(first, tries)
    best = best_of(first, tries, fitted)
    # between what lines and what simulations leave lies more than a law has to bring
    linear = not any(t.candidate.nonlinear for t in found[1].terms)
    as_linear = fitted_together(first, found[1].terms, p, simulated=True) if linear else found
    if best is None or better(first, as_linear, best) is not best:
        return found, []
    name = best[1].terms[i].candidate.name
    others = [one for one in (*fitted, as_linear) if one is not None and one[1].terms[i].candidate.name != name]
    return best, [_ranked(one, i) for one in sorted([best, *others], key=lambda one: one[0])]


def _ranked(found: Scored, i: int) -> Ranked:
    """Law i of several, as it compares with others in its place."""
    law = found[1].terms[i]
    return Ranked(law.candidate, law.located, found[0], name=law.candidate.name)


def _read_off(first: Searched, found: Terms, i: int) -> tuple[Joint, Recovered] | None:
    """The place of law i opened, with what it did beside the force of the other law; None where that cannot be told."""
    problem, place = first.problem, found.terms[i].place
    known = force_of_the_other(first, found, i)
    if known is None or place is None:
        return None
    reduced = first.reduced
    for term in found.terms:
        reduced = with_own(term.located.place, reduced) if term.member else reduced
    reduced, rows = known.basis(reduced, problem.band[1], first.g_rows)
    joint = open_joint(place, reduced, problem.band[1], rows)
    recovered = recover(known.split(first.split).reading, joint, found.p)
    return None if recovered is None else (joint, recovered)


def force_of_the_other(first: Searched, found: Terms, i: int) -> Known | None:
    """Force on the structure of the one of two laws that is not law i, as both together have it in every record; none
    where it is part of the model, and None where the two cannot be followed over whole records."""
    places = list({id(t.place): t.place for t in found.terms if t.place is not None}.values())
    problem = first.problem.thinned(None)
    loop = replace(found.loop(problem), sigma=0.0)
    (histories,) = loop.histories([(found.p, found.x)])
    if not all(np.isfinite(h.f).all() and np.isfinite(h.d).all() for h in histories):
        return None
    ends = np.cumsum([0, *(place.n_w for place in places)])
    for place, a, b in zip(places, ends[:-1], ends[1:], strict=True):
        if place is not found.terms[i].place:
            lines = problem.lines(loop.joint.reduced)
            motions, parts = (
                [
                    np.fft.rfft(sign * history, line.record.n, axis=1)[:, line.index].T
                    for line, h in zip(lines, histories, strict=True)
                    for history in [(h.d if sign > 0 else h.f)[a:b]]
                ]
                for sign in (1.0, -1.0)
            )
            return known_from(lines, place, motions, parts)
    return Known((), {r.name: () for r in problem.records})
