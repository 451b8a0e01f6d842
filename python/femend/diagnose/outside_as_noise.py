"""The model beside a force or base motion from outside that differs in every recording.

What is free on every line takes up what the model's unknowns are off, so that these end far from what the structure
has; a recording in which nothing acts from outside would be predicted with them. So the model is fitted with what acts
from outside counted as noise, and what acted is read off with that model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.judge import Given
from femend.diagnose.known_force import last_force
from femend.diagnose.locate import hypothesis_of
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Place, ReducedModel

__all__ = ["as_noise", "forces_beside"]

FloatArray = NDArray[np.float64]


def as_noise(given: Given, free: Fit) -> Fit:
    """The model alone, fitted with what acts from outside counted as noise, so that recordings that the measured force
    dominates tell most; the fit in which it is `free` where the model breaks down alone."""
    problem, bare = given.split.whole, Hypothesis(given.reduced, np.zeros((0, given.reduced.r)))
    start = (given.updated, np.zeros(0))
    (alone,) = problem.fit([bare], [start], iterations=0)
    if alone is None:
        return free
    raised = np.sqrt(np.maximum(alone.misfit, 1.0))
    louder = problem.on([replace(r, noise=r.noise * by) for r, by in zip(problem.records, raised, strict=True)])
    (fit,) = louder.fit([bare], [start])
    return free if fit is None else fit


def forces_beside(problem: Problem, place: Place, reduced: ReducedModel, p: FloatArray) -> list[FloatArray]:
    """The force (n,) on the structure at a place in every recording, as the model at unknowns `p` (n_p,) reads it
    off; none where it breaks down there."""
    (read,) = problem.fit([hypothesis_of(place, reduced)], [(p, np.zeros(0))], iterations=0)
    return [np.zeros(r.n) for r in problem.records] if read is None else last_force(problem, read)
