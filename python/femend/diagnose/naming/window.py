"""The window exp(-sigma t) in which laws are compared whose motion cannot be followed over whole records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.nonlinear import refit_nonlinear
from femend.diagnose.fitting.runs import wider_windows, windows
from femend.diagnose.naming.judge import Given, Judge, Tried, compared_in, judge_in
from femend.diagnose.naming.ranked import Ranked
from femend.estimate import Hypothesis

__all__ = ["followed_on", "widest"]

FloatArray = NDArray[np.float64]


def widest(given: Given, tried: Sequence[Tried]) -> Judge:
    """The widest window, of those laws go through and those they were followed to, in which some law explains what it
    has not seen about as well as a free force anywhere does, and more than the updated model by itself; whole records
    where none does, or none but in the beginning, where the updated model does without any."""
    split, reduced, settings = given.split, given.reduced, given.settings
    whole = judge_in(given, 0.0)
    if not any(t.candidate.nonlinear for t in tried):
        return whole
    bare = Hypothesis(reduced, np.zeros((0, reduced.r)))
    for sigma in sorted({*windows(split.fitting), *(t.candidate.sigma for t in tried)}):
        judge = whole if sigma == 0 else judge_in(given, sigma)
        by_itself = np.inf
        if sigma > 0:
            (alone,) = split.choosing.fit([bare], [(given.updated, np.zeros(0))], sigma=sigma, iterations=0)
            if alone is not None and alone.score <= settings.adequate:
                break
            by_itself = np.inf if alone is None else alone.score
        judged = [(judge.ranked(t).candidate, t.candidate.sigma <= sigma) for t in tried]
        # at a place where a free force explains nothing, a law that explains nothing does as well
        least = min((c.reference for c, _ in judged if np.isfinite(c.reference)), default=1.0)
        # a beginning is explained by much if the model's own unknowns may leave their priors for it
        fair = [c for c, followed in judged if followed and not (sigma > 0 and settings.strains(c.prior))]
        # what acts at large motion alone may not show in a beginning: laws that do nothing there explain it as well
        if any(c.chosen <= settings.adequate * max(least, 1.0) and c.chosen < by_itself for c in fair):
            return judge
    return whole


def followed_on(given: Given, ranked: list[Ranked], sigma: float) -> tuple[list[Ranked], float]:
    """The best law fitted in fine steps in ever wider windows than exp(-sigma t) as long as it explains what it is
    fitted to and what it has not seen there, and all laws as they compare in the last of them."""
    if sigma == 0 or not ranked or not ranked[0].candidate.nonlinear:
        return ranked, sigma
    best, reached, fitting = ranked[0], sigma, given.split.fitting
    for wider in wider_windows(fitting, sigma):
        judge = judge_in(given, wider)
        candidate = refit_nonlinear(fitting, replace(best.candidate, sigma=wider))
        there = judge.ranked(Tried(candidate, best.located, best.recovered), afresh=True)
        enough = given.settings.adequate * max(there.candidate.reference, 1.0)
        # where it is lost in the records it is fitted to, what these tell of its parameters is of no use
        if max(there.candidate.chosen, candidate.fitted) > enough:
            break
        best, reached = there, wider
    if reached == sigma:
        return ranked, sigma
    return compared_in(given, [best, *ranked[1:]], reached), reached
