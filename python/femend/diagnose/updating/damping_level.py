"""The level of damping that modes have in common.

A deck's damping ratio is a guess that is off by one factor for all modes: 1 % where a bolted frame has 5 %. What modes
differ by around their level is what a prior can say something of. Counted around a deck's ratio that is five times off,
a fit at the noise would cost (ln 5 / 0.5)² = 10 a mode, of which any law that damps takes its share.
"""

from __future__ import annotations

import numpy as np

from femend.diagnose.settings import AT_NOISE
from femend.estimate import Fit, Problem
from femend.estimate.fit import DAMPING_SD

__all__ = ["at_its_level"]

# share of its prior deviation to which the recordings have to tell a mode's ln damping ratio, and modes that have to be
# told so before they have a level: fewer cost less, five times off, than a law has to bring
TOLD, FEWEST = 0.5, 4


def at_its_level(problem: Problem, null: Fit) -> tuple[Problem, Fit]:
    """The problem with damping ratios expected around the median of those that an updated model shows, and that model
    fitted in it; both as they are where the median is within a prior deviation of what is expected, or of few modes,
    and where the model leaves more than noise: it is bent then, its damping most of all."""
    if null.score > AT_NOISE:
        return problem, null
    first = len(null.hypothesis.reduced.names) + problem.n_tuned
    ln = null.p[first : first + problem.n_tuned]
    covariance = np.linalg.pinv(null.hessian)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))[first : first + problem.n_tuned]
    told = ln[(sd > 0) & (sd < TOLD * DAMPING_SD)]
    if len(told) < FEWEST or abs(np.median(told) - np.log(problem.zeta)) < DAMPING_SD:
        return problem, null
    around = problem.around(float(np.exp(np.median(told))))
    (again,) = around.fit([null.hypothesis], [(null.p, null.x)])
    return (problem, null) if again is None else (around, again)
