"""The window exp(-sigma t) in which laws are compared whose motion cannot be followed over whole records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.judge import Judge, Tried, compared_in, judge_in
from femend.diagnose.nonlinear import refit_nonlinear, wider_windows, windows
from femend.diagnose.ranked import Ranked
from femend.diagnose.settings import Settings
from femend.diagnose.split import Split
from femend.estimate import Hypothesis
from femend.model import ReducedModel

__all__ = ["followed_on", "widest"]

FloatArray = NDArray[np.float64]


def widest(
    split: Split, reduced: ReducedModel, tried: Sequence[Tried], settings: Settings, updated: FloatArray
) -> Judge:
    """The widest window in which some law explains what it has not seen about as well as a free force anywhere does;
    whole records where none does, or none but in the beginning, where the updated model (unknowns `updated`) does
    without any."""
    whole = judge_in(split, reduced, 0.0, settings)
    if not any(t.candidate.nonlinear for t in tried):
        return whole
    bare = Hypothesis(reduced, np.zeros((0, reduced.r)))
    for sigma in reversed(windows(split.fitting)):
        judge = whole if sigma == 0 else judge_in(split, reduced, sigma, settings)
        if sigma > 0:
            (alone,) = split.choosing.fit([bare], [(updated, np.zeros(0))], sigma=sigma, iterations=0)
            if alone is not None and alone.score <= settings.adequate:
                break
        judged = [(judge.ranked(t).candidate, t.candidate.sigma <= sigma) for t in tried]
        # at a place where a free force explains nothing, a law that explains nothing does as well
        least = min((c.reference for c, _ in judged if np.isfinite(c.reference)), default=1.0)
        # a beginning is explained by much if the model's own unknowns may leave their priors for it
        fair = [c for c, followed in judged if followed and not (sigma > 0 and settings.strains(c.prior))]
        if any(c.chosen <= settings.adequate * max(least, 1.0) for c in fair):
            return judge
    return whole


def followed_on(
    split: Split, reduced: ReducedModel, ranked: list[Ranked], sigma: float, settings: Settings
) -> tuple[list[Ranked], float]:
    """The best law fitted in fine steps in ever wider windows than exp(-sigma t) as long as it explains what it has not
    seen there, and all laws as they compare in the last of them."""
    if sigma == 0 or not ranked or not ranked[0].candidate.nonlinear:
        return ranked, sigma
    best, reached = ranked[0], sigma
    for wider in wider_windows(split.fitting, sigma):
        judge = judge_in(split, reduced, wider, settings)
        candidate = refit_nonlinear(split.fitting, replace(best.candidate, sigma=wider))
        there = judge.ranked(Tried(candidate, best.located, best.recovered), afresh=True)
        if there.candidate.chosen > settings.adequate * max(there.candidate.reference, 1.0):
            break
        best, reached = there, wider
    if reached == sigma:
        return ranked, sigma
    return compared_in(split, reduced, [best, *ranked[1:]], reached, settings), reached
