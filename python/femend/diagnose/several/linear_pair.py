"""Two linear laws, each tried at other nodes, and as another law of its family.

Each was named beside something that stood for the other: a free force, or another law. An absorber does in its one mode
what a heavier one does where that mode moves less, and what it leaves in the others the law beside it may take up, of
another form than it would have by itself. So each is tried at all nodes, and then each as every linear law of its
family, with both fitted on lines, which costs no simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.candidates import KINDS, laws_for
from femend.diagnose.fitting.linear import FEW_LINES, LAW_SD
from femend.diagnose.fitting.terms import Term
from femend.diagnose.locating.preference import LIKELIER, preference
from femend.diagnose.several.law_elsewhere import MOST, in_turn, raced
from femend.diagnose.several.moved import moved, resized
from femend.diagnose.several.one_linear import located_beside
from femend.diagnose.several.pairs import Searched, others, plain
from femend.diagnose.several.together import Scored, better, fitted_together
from femend.estimate import Fit, Hypothesis
from femend.model import Place
from femend.physics import Physics
from femend.physics.starts import linear_sizes

__all__ = ["where_both_explain_more"]

FloatArray = NDArray[np.float64]

# nodes that go on for each law, and rounds in which both are moved
KEPT, ROUNDS = 3, 2


def where_both_explain_more(first: Searched, found: Scored) -> Scored:
    """Two linear laws that were fitted together, at the nodes and of the forms in which both leave clearly less; as
    they are where one is nonlinear or part of the model, or both stand at one place."""
    for _ in range(ROUNDS):
        if not (_may_be_elsewhere(found[1].terms) and _may_leave_less(first, found)):
            break
        placed = (found, *_elsewhere(first, found))
        best = _likeliest(first, [one for pair in placed for one in (pair, *_of_other_forms(first, pair))])
        if best[0] >= found[0] - first.settings.margin:
            break
        found = best
    return found


def _may_be_elsewhere(terms: Sequence[Term]) -> bool:
    """Whether two linear laws of one coordinate each stand at places of their own."""
    places = [t.place for t in terms if t.place is not None and not t.candidate.nonlinear]
    apart = len(places) == len(terms) == len({id(p) for p in places})
    return apart and len(terms) == 2 and all(p.n_w == 1 and p.kind in KINDS for p in places)


def _may_leave_less(first: Searched, found: Scored) -> bool:
    """Whether a pair leaves so much more than noise, its parameters aside, that another could leave clearly less."""
    least = first.floor + first.price * found[1].n_law
    return found[0] - least > first.settings.margin


def _likeliest(first: Searched, tried: Sequence[Scored]) -> Scored:
    """The best of several pairs, of fewer parameters unless more of them bring what a law has to bring; of those with
    the same laws the likeliest places, too."""
    best = tried[0]
    for one in tried[1:]:
        best = better(first, best, one) or best
    even = [one for one in tried if _laws(one[1].terms) == _laws(best[1].terms)]
    return min(even, key=lambda one: one[0] + LIKELIER * sum(preference(t.located.place) for t in one[1].terms))


def _elsewhere(first: Searched, found: Scored) -> list[Scored]:
    """The pair with each of its laws, in turn, at the nodes where both leave least, fitted together there."""
    return [
        moved
        for i, term in enumerate(found[1].terms)
        if term.place is not None and term.place.kind == "ground"
        for place, fit in _nodes(first, found, i)
        if (moved := _at(first, found, i, place, fit)) is not None
    ]


def _nodes(first: Searched, found: Scored, i: int) -> list[tuple[Place, Fit]]:
    """Nodes at which law i leaves least beside the other, or about as little as where it is."""
    terms, p = found[1].terms, plain(first, found[1].p)
    at, other = terms[i].place, terms[1 - i].place
    assert at is not None
    assert other is not None
    few = first.split.fitting.sparing(FEW_LINES)
    places = [q for q in others(first, other) if q.kind == at.kind and q.n_w == 1 and q.direction == at.direction]
    places = in_turn(first.reduced.model, at, [q for q in places if q is not at])[:MOST]

    def begun(place: Place) -> tuple[Hypothesis, tuple[FloatArray, FloatArray]]:
        law = resized(few, first.reduced, terms[i].candidate, p, at, place)
        x = [law.x if j == i else t.x for j, t in enumerate(terms)]
        hypothesis = _hypothesis(first, [place if j == i else t.place for j, t in enumerate(terms)], _laws(terms), x)
        return hypothesis, (p, np.concatenate(x))

    # where it is it has come to its end, and would be far ahead of all in a race
    here, there = raced(few, *zip(*[begun(at)])), raced(few, *zip(*map(begun, places))) if places else {}
    near = [k for k in there if here and there[k].cost < here[0].cost + first.settings.margin]
    near.sort(key=lambda k: there[k].cost + LIKELIER * preference(places[k]))
    return [(places[k], there[k]) for k in near[:KEPT]]


def _at(first: Searched, found: Scored, i: int, place: Place, fit: Fit) -> Scored | None:
    """The pair with law i at another node, from where a fit on few lines led."""
    terms = found[1].terms
    there = moved(first, terms[i], place)
    beside = terms[1 - i].place
    known = None if beside is None else located_beside(first, place, beside, fit.p)
    if known is None:
        return None
    pair = [replace(there, located=known) if j == i else t for j, t in enumerate(terms)]
    return fitted_together(first, _from(pair, fit.x), fit.p)


def _of_other_forms(first: Searched, found: Scored) -> list[Scored]:
    """The pair with each of its laws, in turn, as every other linear law of its family that has a form."""
    terms, p = found[1].terms, plain(first, found[1].p)
    few = first.split.fitting.sparing(FEW_LINES)
    band = (2 * np.pi * first.problem.band[0], 2 * np.pi * first.problem.band[1])
    done = []
    for i, term in enumerate(terms):
        assert term.place is not None
        size = _size(term, band)
        for name, entry in laws_for(term.place.kind):
            own = term.candidate.physics
            like = own is not None and entry.kind == "linear" and entry.family == own.family and entry is not own
            if not like or len(entry.parameters) < 2:
                continue  # what is told more plainly is tried where the pair is told
            laws = [entry if j == i else law for j, law in enumerate(_laws(terms))]
            starts = []
            for values in linear_sizes(entry, [size], band):
                x = [_x(entry, values) if j == i else t.x for j, t in enumerate(terms)]
                starts.append((_hypothesis(first, [t.place for t in terms], laws, x), (p, np.concatenate(x))))
            fits = raced(few, *zip(*starts))
            if not fits:
                continue
            fit = min(fits.values(), key=lambda f: f.cost)
            law = replace(term.candidate, physics=entry, name=name, n_law=len(entry.parameters), covariance=None)
            pair = [replace(term, candidate=law) if j == i else t for j, t in enumerate(terms)]
            done.append(fitted_together(first, _from(pair, fit.x), fit.p))
    return [one for one in done if one is not None]


def _size(term: Term, band: tuple[float, float]) -> float:
    """Size of the dynamic stiffness of a linear law in the middle of the band (rad/s)."""
    law = _laws([term])[0]
    middle = np.array([1j * np.sqrt(band[0] * band[1])])
    return abs(complex(_core.law_dynamic_stiffness(law.law or law.name, term.values(term.x)[0], middle)[0][0]))


def _laws(terms: Sequence[Term]) -> list[Physics]:
    """The laws of terms."""
    return [t.candidate.physics for t in terms if t.candidate.physics is not None]


def _x(entry: Physics, values: dict[str, float]) -> FloatArray:
    """Fit coordinates of a linear law."""
    return np.log([values[name] for name in entry.parameter_names])


def _from(terms: Sequence[Term], x: FloatArray) -> list[Term]:
    """Linear terms at the fit coordinates x of all of them, one after the other."""
    made, n = [], 0
    for t in terms:
        law = t.candidate.physics
        assert law is not None
        part = x[n : n + len(law.parameters)]
        n += len(part)
        values = law.values_at(part)
        made.append(replace(t, candidate=replace(t.candidate, x=part, values=values)))
    return made


def _hypothesis(
    first: Searched, places: Sequence[Place | None], laws: Sequence[Physics], x: Sequence[FloatArray]
) -> Hypothesis:
    """Two linear laws at places of one coordinate, free but for absurd values around `x`."""
    reduced, mean = first.reduced, np.concatenate(x)
    w = np.vstack([q.w(reduced.V, reduced.V_a) for q in places if q is not None])
    names = tuple(law.law or law.name for law in laws)
    return Hypothesis(reduced, w, names, None, mean, np.full(len(mean), LAW_SD), ((0,), (1,)))
