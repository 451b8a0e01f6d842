"""How far the sizes of a law differ over places that the recordings do not tell apart.

A force at a place w' that moves the sensors as one at w does, but alpha times as far, does the same with 1/alpha of it,
and by reciprocity the structure moves alpha times as far there. So a law's parameter of dimension force^a
displacement^b would be alpha^(b - a) times as large at w': a stiffness, mass or dashpot alpha^-2, a gap alpha.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose import Diagnosis
from femend.diagnose.locating.classes import answers_beside
from femend.model import Place
from femend.physics import Parameter

__all__ = ["answers_elsewhere", "over_places"]

FloatArray = NDArray[np.float64]

# lines of a record on which answers are compared
LINES = 60


def answers_elsewhere(diagnosis: Diagnosis, place: Place, rivals: Sequence[Place]) -> FloatArray:
    """How many times as far a force at each of the places `rivals` moves the sensors as one at `place` (n,), along what
    both do to them; of those with one force, none where the place itself has several."""
    single = [p for p in rivals if p.n_w == 1 and not p.scaled]
    if place.n_w != 1 or place.scaled or not single:
        return np.zeros(0)
    null = diagnosis.null
    few = diagnosis.problem.on(diagnosis.problem.records[:1]).thinned(LINES)
    return answers_beside(few, null.hypothesis.reduced, place, single, null.p)


def over_places(parameter: Parameter, answers: FloatArray) -> float:
    """Relative deviation of a law's parameter over the place it is told at and those that answer `answers` (n,) times
    as far; 0 without any.

    >>> from femend.physics import physics
    >>> k = physics("support_stiffness").parameters[0]
    >>> round(over_places(k, np.array([1.1, 1.1])), 3)
    0.156
    """
    if not len(answers):
        return 0.0
    force, displacement, _ = parameter.dims
    ln = (displacement - force) * np.log(np.maximum(answers, 1e-300))
    return float(np.sqrt((ln**2).sum() / (len(answers) + 1)))
