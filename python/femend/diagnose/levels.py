"""Whether what a linear model leaves depends on the level: then it is no error of the linear model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.locate import Located
from femend.diagnose.settings import Settings
from femend.estimate import Fit, Problem

__all__ = ["depends_on_level", "relative_errors"]

FloatArray = NDArray[np.float64]

# ratio of the highest level to the lowest from which levels can be compared, and of the largest relative error to the
# smallest from which it depends on them
LEVELS, UNEVEN = 2.0, 2.0


def relative_errors(problem: Problem, null: Fit) -> FloatArray:
    """Error of the updated model beyond the noise (n_records,), as a share of what was recorded in the band (RMS); of
    a linear model that is wrong it is the same at all levels, whatever the noise."""
    reduced = null.hypothesis.reduced
    whole = problem.thinned(None)
    lines = whole.lines(reduced)
    fitted = _core.fitted_lines(
        whole.system(reduced), null.hypothesis.core(), [line.core for line in lines], null.p, null.x
    )
    shares = []
    for line, (y, _, _) in zip(lines, fitted, strict=True):
        noise = line.record.n * float((line.record.noise**2).sum()) * len(line.freq)
        left = float((np.abs(line.Y - y) ** 2).sum()) - noise
        shares.append(np.sqrt(max(left, 0.0) / max(float((np.abs(line.Y) ** 2).sum()), 1e-300)))
    return np.array(shares)


def depends_on_level(problem: Problem, null: Fit, located: Sequence[Located], settings: Settings) -> bool:
    """Whether recordings of different level show something that the updated model lacks, by an error that is a larger
    share of one than of another, where that one is far from the noise and a force at the best place explains it."""
    if not located or len(problem.records) < 2 or any(r.frf is not None for r in problem.records):
        return False
    level = np.array([r.u.std() for r in problem.records])
    if level.max() < LEVELS * level.min():
        return False
    error = relative_errors(problem, null)
    worst = int(np.argmax(error))
    misfit, free = float(null.misfit[worst]), float(located[0].fit.misfit[worst])
    far = misfit > 2.0 * settings.consistent and free < 0.5 * misfit
    return bool(far and error[worst] > UNEVEN * error.min())
