"""Whether what a linear model leaves depends on the level: then it is no error of the linear model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.equivalent import FEW_LINES, equivalent_linear
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.locate import Located
from femend.diagnose.settings import Settings
from femend.estimate import Fit, FitRecord, Lines, Problem

__all__ = ["depends_on_level", "element_depends_on_level", "levels_differ", "relative_errors"]

FloatArray = NDArray[np.float64]

# ratio of the highest level to the lowest from which levels can be compared, and of the largest relative error to the
# smallest from which it depends on them
LEVELS, UNEVEN = 2.0, 2.0
# misfit of that record, as a multiple of what counts as consistent, from which it is far from the noise, and the share
# of it up to which a force that explains it leaves some
FAR, LEAVES = 2.0, 0.5
# the same where the misfit is near the noise because the model is allowed errors: those are the same share at all
# levels, so an error as large as the noise (RMS) is none of them
AS_NOISE, LEAVES_LITTLE = 1.0, 0.8
# share of what one spring and dashpot leave of all records that one for each record leaves at most where they depend on
# the level
OWN_LEAVES = 0.7


def levels_differ(records: Sequence[FitRecord]) -> bool:
    """Whether the forces of some recordings are so much larger than those of others that levels can be compared; FRFs
    have none."""
    level = [r.level for r in records if r.frf is None]
    return len(level) > 1 and max(level) >= LEVELS * min(level)


def relative_errors(problem: Problem, null: Fit) -> FloatArray:
    """Error of the updated model beyond the noise (n_records,), as a share of what was recorded in the band (RMS); of
    a linear model that is wrong it is the same at all levels, whatever the noise."""

    def make() -> tuple[Fit, FloatArray]:
        reduced = null.hypothesis.reduced
        whole = problem.thinned(None)
        lines, fitted = whole.lines(reduced), whole.fitted_lines(null.hypothesis, null.p, null.x)
        return null, np.array([_share(line, y) for line, (y, _, _) in zip(lines, fitted, strict=True)])

    # asked several times on the way to a verdict; the fit is kept with its answer, so that no other takes its identity
    kept: tuple[Fit, FloatArray] = problem.kept(("relative errors", id(null)), make)
    return kept[1]


def _share(line: Lines, y: NDArray[np.complex128]) -> float:
    """RMS of what responses `y` (K, n_out) leave of a record's lines beyond the noise, over that of the lines."""
    left = float((np.abs(line.Y - y) ** 2).sum()) - _noise(line)
    return float(np.sqrt(max(left, 0.0) / max(float((np.abs(line.Y) ** 2).sum()), 1e-300)))


def _noise(line: Lines) -> float:
    """Squares that noise leaves of a record's lines."""
    return line.record.n * float((line.record.noise**2).sum()) * len(line.freq)


def _noise_share(problem: Problem, null: Fit, i: int) -> float:
    """RMS of the noise of record i over that of its lines."""
    line = problem.thinned(None).lines(null.hypothesis.reduced)[i]
    return float(np.sqrt(_noise(line) / max(float((np.abs(line.Y) ** 2).sum()), 1e-300)))


def depends_on_level(problem: Problem, null: Fit, located: Sequence[Located], settings: Settings) -> bool:
    """Whether recordings of different level show something that the updated model lacks, by an error that is a larger
    share of one than of another, where that one is far from the noise, or the error as large as it, and a force at the
    best place explains it."""
    if not located or len(problem.records) < 2 or any(r.frf is not None for r in problem.records):
        return False
    if not levels_differ(problem.records):
        return False
    error = relative_errors(problem, null)
    worst = int(np.argmax(error))
    misfit, free = float(null.misfit[worst]), float(located[0].fit.misfit[worst])
    if error[worst] <= UNEVEN * error.min():
        return False
    far = misfit > FAR * settings.consistent and free < LEAVES * misfit
    return bool(far or (free < LEAVES_LITTLE * misfit and error[worst] > AS_NOISE * _noise_share(problem, null, worst)))


def element_depends_on_level(problem: Problem, joint: Joint, p: FloatArray) -> bool:
    """Whether recordings of different level each have a spring and dashpot of their own at a joint, from unknowns `p`
    (n_p,) of the model: one and the same leaves clearly more. False where levels cannot be compared."""
    if len(problem.records) < 2 or not levels_differ(problem.records):
        return False
    common = equivalent_linear(problem, joint, p)
    own = [equivalent_linear(problem.on([record]), joint, p) for record in problem.records]
    if common is None or any(fit is None for fit in own):
        return False
    alone = [fit for fit in own if fit is not None]
    # one for all is sought from each one's too: a minimum it did not come to is no sign of a level
    starts = [(fit.p, fit.x) for fit in alone]
    again = problem.sparing(FEW_LINES).fit([fit.hypothesis for fit in alone], starts)
    common = min((fit for fit in (common, *again) if fit is not None), key=lambda fit: fit.cost)
    return sum(float(fit.misfit[0]) for fit in alone) < OWN_LEAVES * float(common.misfit.sum())
