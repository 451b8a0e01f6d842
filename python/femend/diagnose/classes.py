"""Places that move the sensors alike, so that they do not crowd each other out while places are sorted out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.receptances import receptances
from femend.estimate import Problem
from femend.model import Place, ReducedModel

__all__ = ["similarity"]

FloatArray = NDArray[np.float64]


def similarity(problem: Problem, reduced: ReducedModel, places: Sequence[Place], p: FloatArray) -> FloatArray:
    """How alike forces at places move the sensors: mean squared correlation (n, n) over the problem's lines.

    Every place has one force, `p` are the unknowns of the model. 1 where no sensor can tell two places apart.
    """
    omega, zeta, Q = problem.system(reduced).modal(p)
    W = np.array([place.w(reduced.V, reduced.V_a)[0] for place in places]) @ Q
    total, weight = np.zeros((len(places), len(places))), 0.0
    for line in problem.lines(reduced):
        s = np.asarray(line.sigma + 2j * np.pi * line.freq, dtype=np.complex128)
        g = receptances(omega, zeta, s)
        out = reduced.rows(line.record.out_rows, line.record.out_signs) @ Q
        for k in range(len(s)):
            h = (W * g[k]) @ out.T * line.weight[k]
            size = np.maximum(np.linalg.norm(h, axis=1), 1e-300)
            own = h / size[:, None]
            total += np.abs(own.conj() @ own.T) ** 2
            weight += 1.0
    return np.asarray(total / max(weight, 1.0))
