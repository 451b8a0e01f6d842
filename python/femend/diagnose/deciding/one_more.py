"""What one more free force shows beside the one that nobody recorded."""

from __future__ import annotations

import numpy as np

from femend.diagnose.deciding.accepted import TELLING
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.driven.unrecorded import Driven
from femend.diagnose.locating.locate import cost_of
from femend.diagnose.settings import Settings
from femend.estimate.lines import MODEL_ALLOWANCE

__all__ = ["ONE_MORE", "moved_more", "one_more_force", "shows_beside", "stands_in"]

# share of the recorded motion (RMS) that one more free force has to explain beyond the updated model: on ten controls
# of calibration seeds 95 and 96, of all families at 1 to 5 % noise, it explained 0.0056 at most, 0.010 and more where
# something shows
ONE_MORE = 0.0075


def one_more_force(driven: Driven, settings: Settings) -> bool:
    """Whether a free force beside the drive clearly explains more than the updated model, and more than is wrong with a
    model that lacks nothing: its mesh, its idealisation.

    A misfit alone says little of that: the less noise there is, the more of it is what the model is wrong by anyway.
    """
    return shows_beside(driven, settings) and moved_more(driven) > ONE_MORE


def shows_beside(driven: Driven, settings: Settings) -> bool:
    """Whether a free force beside the drive clearly explains more than the updated model, whatever it makes up for."""
    if not driven.located:
        return False
    start, first = driven.start, driven.located[0]
    return cost_of(start.problem, start.null, 0.0) - first.cost > TELLING * settings.gain_cost


def moved_more(driven: Driven) -> float:
    """Share of the recorded motion in the band (RMS over the records) that a free force at the best place explains
    beyond the updated model, 0 where it explains no more; from how far both leave their misfits, and what a misfit of
    one is: the noise, and what lines are allowed to be off by."""
    if not driven.located:
        return 0.0
    null = driven.start.null
    less = np.asarray(null.misfit) - np.asarray(driven.located[0].fit.misfit)
    one = [line.noise_share**2 + MODEL_ALLOWANCE**2 for line in driven.start.problem.lines(null.hypothesis.reduced)]
    return float(np.sqrt(max(float(np.mean(less * np.array(one))), 0.0)))


def stands_in(out: Diagnosis, driven: Driven) -> bool:
    """Whether the law that is told as the likeliest stands in for what is elsewhere: the model bends for it, and a free
    force at the best place leaves far less than one at its place."""
    settings, place = out.settings, out.place
    if out.verdict != "located-not-named" or out.best is None or place is None:
        return False
    return settings.bends(out.best.prior) and driven.located[0].cost < place.cost - settings.reach
