"""Dashpots at all nodes, each with one unknown, beside a force that nobody recorded.

Where a force is free on every line, a second one takes another response of what is left, and explains what is wrong
with the model everywhere as well as what is missing somewhere: the place of a dashpot may come behind many others, and
modes whose damping is free make up for much of it. As a law it has one unknown for all lines of all recordings. That
does nothing for a mesh, or for masses and members that are a little off, and at its place it takes away all there is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.driven.unrecorded import Driven
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.linear_costs import directions
from femend.diagnose.locating.locate import FINAL_LINES, Kin, Located, squares_of
from femend.diagnose.settings import Settings
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Place, ReducedModel
from femend.numerals import plain
from femend.physics import physics
from femend.units import unit_system

__all__ = ["Dashpot", "best_dashpot", "led_by", "told"]

FloatArray = NDArray[np.float64]

# lines a record, and steps, of which after the first those go on that cost up to so many times the least
LINES, STEPS, HEATS = 120, 25, ((2, 1.3), (5, 1.1), (10, 1.03))
# what a dashpot begins with, as a share of what holds its node, and how far its logarithm may go
SIZE, SPREAD = 0.03, 3.0
# cost, in `gain_cost`, by which a dashpot has to be better than the updated model
CLEARLY = 2.0


@dataclass(frozen=True, eq=False)
class Dashpot:
    """A dashpot to the ground at a place, with its fit on few lines and the cost that the updated model has above
    it."""

    place: Place
    fit: Fit
    gain: float

    @property
    def c(self) -> float:
        """Force over velocity, in the deck's units."""
        return float(np.exp(self.fit.x[0]))


def best_dashpot(driven: Driven, settings: Settings) -> Dashpot | None:
    """The dashpot that leaves least of all nodes; None where it is not clearly better than the updated model, or leaves
    more than noise: then more is missing than it."""
    start = driven.start
    few, reduced, p = start.problem.sparing(LINES), start.reduced, start.null.p
    places = [place for place in driven.places if place.kind == "ground" and place.n_w == 1]
    (null,) = few.fit([start.null.hypothesis], [(p, np.zeros(0))], iterations=STEPS)
    if null is None or not places:
        return None
    places = [places[i] for i in Kin.of(few, reduced, places, start.null).first(places)]
    sizes = np.log(SIZE * _held(few, reduced, places, p))
    tried = [(place, np.array([x])) for place, x in zip(places, sizes, strict=True) if np.isfinite(x)]
    hypotheses = [
        Hypothesis(reduced, place.w(reduced.V, reduced.V_a), ("viscous_damper",), None, x, np.array([SPREAD]))
        for place, x in tried
    ]
    fits = few.fit(hypotheses, [(null.p, x) for _, x in tried], iterations=STEPS, heats=HEATS)
    known = [(fit, place) for fit, (place, _) in zip(fits, tried, strict=True) if fit is not None]
    fit, place = min(known, key=lambda one: one[0].cost, default=(null, places[0]))
    clear = null.cost - fit.cost > CLEARLY * settings.gain_cost and fit.score <= settings.consistent
    return Dashpot(place, fit, null.cost - fit.cost) if clear else None


def _held(problem: Problem, reduced: ReducedModel, places: Sequence[Place], p: FloatArray) -> FloatArray:
    """Size (n_places,) of a dashpot that does as much as what holds the places in the middle of the band, infinite
    where they do not move."""
    omega, _, Q = problem.modes(reduced, p)
    moved = directions(reduced, places) @ Q
    low, high = 2 * np.pi * np.array(problem.band)
    compliance = (moved**2 / np.maximum(omega**2, low**2)).sum(axis=1)
    return np.where(compliance > 0, 1 / np.maximum(compliance, 1e-300), np.inf) / np.sqrt(low * high)


def told(dashpot: Dashpot, units: str) -> str:
    """What is said of a dashpot, of a model in the system of `units`, that is clearly better than nothing where no law
    takes enough away to be named."""
    unit = physics("viscous_damper").parameters[0].unit(unit_system(units))
    return (
        f"something is missing at the first place listed: a dashpot {dashpot.place.where}, of {plain(dashpot.c, 3)} "
        f"{unit}, explains clearly more than the updated model, but too little of what is left to be named; a "
        "recording that holds the force would tell far more"
    )


def led_by(dashpot: Dashpot, driven: Driven) -> list[Located]:
    """The places that may miss something, with a free force each, that of a dashpot before all others."""
    problem, reduced = driven.start.problem, driven.start.reduced
    there = [one for one in driven.located if one.place is dashpot.place]
    others = [one for one in driven.located if one.place is not dashpot.place]
    if not there:
        few = problem.sparing(FINAL_LINES)
        (fit,) = few.fit([hypothesis_of(dashpot.place, reduced)], [(dashpot.fit.p, np.zeros(0))])
        there = [] if fit is None else [Located(dashpot.place, fit, squares_of(problem, fit, 0.0))]
    return [*there, *others]
