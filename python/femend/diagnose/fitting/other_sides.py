"""Stops on one side and on two: which it is, asked once more where one of them was followed to its end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.nonlinear import cost_of, refit_nonlinear
from femend.diagnose.locating.recovered import Recovered
from femend.estimate import Problem
from femend.physics import FitCoordinates

__all__ = ["on_other_sides"]

FloatArray = NDArray[np.float64]

# the sides of a stop as its law has them: above, below, both
SIDES = (1.0, -1.0, 2.0)


def on_other_sides(problem: Problem, candidate: Candidate, recovered: Recovered | None, enough: float) -> Candidate:
    """A stop that leaves more than `enough` (mean weighted square), on those sides on which it explains most, each
    fitted alone from the unknowns of the model with the free force in its place by which `recovered` tells what that
    did; what is no stop, or leaves no more, as it is.

    The way of a stop to whole records is one of many, on which the right sides may be lost while others go through: a
    stop of half the stiffness on both sides takes as much from the motion as the right one.
    """
    if recovered is None or "sides" not in candidate.values or not candidate.fitted > enough:
        return candidate
    others = [_with_sides(candidate, recovered.fit.p, sides) for sides in SIDES if sides != candidate.values["sides"]]
    return min([candidate, *(refit_nonlinear(problem, c) for c in others)], key=lambda c: cost_of(problem, c))


def _with_sides(candidate: Candidate, p: FloatArray, sides: float) -> Candidate:
    """The stop on other sides, as stiff in a motion over both as it is, without the companion and the unknowns that
    made up for the wrong ones."""
    assert candidate.physics is not None
    k = candidate.values["k"] * _number(candidate.values["sides"]) / _number(sides)
    coordinates = FitCoordinates(candidate.physics, {**candidate.values, "k": k, "sides": sides})
    x = np.concatenate([coordinates.start(), np.zeros(2)])
    values = dict(coordinates.values)
    return replace(candidate, values=values, p=p, x=x, k=0.0, c=0.0, covariance=None, coordinates=coordinates)


def _number(sides: float) -> float:
    return 2.0 if sides == 2.0 else 1.0
