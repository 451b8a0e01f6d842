"""The model beside a force or base motion from outside that differs in every recording.

What is free on every line takes up what the model's unknowns are off, so that these end far from what the structure
has; a recording in which nothing acts from outside would be predicted with them. So the model is fitted with what acts
from outside counted as noise, and what acted is read off with that model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.known_force import last_force
from femend.diagnose.locating.locate import Located
from femend.diagnose.naming.judge import Given
from femend.estimate import Fit, Hypothesis, Problem

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


def forces_beside(problem: Problem, at: Located, p: FloatArray) -> dict[str, tuple[int, FloatArray]]:
    """The row of the g-set and the force (n,) there in every recording by its name, as the model at unknowns `p` (n_p,)
    reads it off at a place with one force; none where it breaks down there."""
    (read,) = problem.fit([at.fit.hypothesis], [(p, np.zeros(0))], iterations=0)
    if read is None:
        return {}
    row = int(at.place.g_rows[0][0])
    return {r.name: (row, f) for r, f in zip(problem.records, last_force(problem, read), strict=True)}
