"""A law at another place that moves the sensors alike, of the size at which it does there what it did where it was."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.terms import Term
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.locate import COMPARED_LINES
from femend.diagnose.locating.receptances import receptances
from femend.diagnose.several.pairs import Searched, plain
from femend.estimate import Problem
from femend.model import Place, ReducedModel
from femend.physics import FitCoordinates, Parameter

__all__ = ["moved", "resized"]

FloatArray = NDArray[np.float64]


def moved(first: Searched, term: Term, place: Place) -> Term:
    """A term with one coordinate at another place.

    A force that does the same work there is `ratio` times as large where the motion is as much smaller, so that a
    parameter of dimensions N^a m^b s^c is ratio^(a - b) times what it was.
    """
    old = term.place
    assert old is not None
    ratio = _ratio(first.problem, first.reduced, plain(first, term.candidate.p), old, place)
    joint = open_joint(place, first.reduced, first.problem.band[1], first.g_rows)
    alike = (old, *(p for p in term.located.alike if p is not place))
    located = replace(term.located, place=place, alike=alike)
    return replace(term, candidate=_scaled(replace(term.candidate, joint=joint), ratio), located=located)


def resized(
    problem: Problem, reduced: ReducedModel, law: Candidate, p: FloatArray, old: Place, new: Place
) -> Candidate:
    """A law of one coordinate at the place `old` of the size at which it does the same work at the place `new`, under
    the recorded forces in the model of unknowns `p` (n_p,) without laws."""
    return _scaled(law, _ratio(problem, reduced, p, old, new))


def _ratio(problem: Problem, reduced: ReducedModel, p: FloatArray, old: Place, new: Place) -> float:
    """How much more one place moves than another under the recorded forces, in the model without laws."""
    few = problem.thinned(COMPARED_LINES)
    omega, zeta, Q = few.modes(reduced, p)
    W = np.vstack([place.w(reduced.V, reduced.V_a)[:1] for place in (old, new)]) @ Q
    power = np.zeros(2)
    for line in few.lines(reduced):
        g = receptances(omega, zeta, line.s)
        q = g * (line.U @ (reduced.rows(line.record.in_rows, line.record.in_signs) @ Q))
        power += (np.abs(q @ W.T) ** 2).sum(axis=0)
    return float(np.sqrt(power[0] / power[1])) if power.min() > 0 else 1.0


def _scaled(candidate: Candidate, ratio: float) -> Candidate:
    """A law where the motion is `ratio` times smaller."""
    entry = candidate.physics
    assert entry is not None
    grown = {q.name: ratio ** _power(q, candidate.values) for q in entry.parameters}
    values = {name: candidate.values[name] * factor for name, factor in grown.items()}
    if candidate.coordinates is None:
        return replace(candidate, values=values, x=candidate.x + np.log([grown[n] for n in entry.parameter_names]))
    coordinates = FitCoordinates(entry, values)
    x = np.concatenate([coordinates.start(), candidate.x[len(coordinates.free) :]])
    extra = {**candidate.extra, **{name: candidate.extra[name] * ratio**2 for name in ("k_scale", "c_scale")}}
    return replace(candidate, values=values, x=x, coordinates=coordinates, extra=extra)


def _power(parameter: Parameter, values: Mapping[str, float]) -> float:
    """Power of the ratio of motions by which a parameter of a law with these values grows."""
    force, displacement, time = parameter.dims
    # where an exponent stands in the unit it is that of time, or else of displacement
    power = values[parameter.exponent] if parameter.exponent and not time else 1.0
    return force - displacement * power
