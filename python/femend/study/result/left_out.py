"""Responses to a force nobody recorded: each sensor predicted from all the others.

The force on every line and the free decays are those that explain the other sensors, so that what is compared was not
used; the model's unknowns and its laws are held.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose import Diagnosis
from femend.diagnose.driven.unrecorded import with_law
from femend.diagnose.locating.recovered import in_time
from femend.estimate import FitRecord, Hypothesis, Problem

__all__ = ["in_band", "predicted_by_others"]

FloatArray = NDArray[np.float64]

# noise of a sensor that is left out, in units of its own motion: it weighs nothing
NO_WEIGHT = 1e6


def in_band(diagnosis: Diagnosis, record: FitRecord) -> FloatArray:
    """What was recorded in the band of the diagnosis (n_out, n)."""
    whole = _problem(diagnosis).on([record]).thinned(None)
    (line,) = whole.lines(diagnosis.null.hypothesis.reduced)
    return in_time(line.Y, line.index, record.n)


def predicted_by_others(diagnosis: Diagnosis, record: FitRecord) -> dict[str, FloatArray]:
    """Accelerations (n_out, n) in the band, each of the stages "nominal", "parameters" and "final", every sensor from
    the others."""
    driven, problem = diagnosis.driven, _problem(diagnosis)
    null = diagnosis.null if driven is None else driven.start.null
    nominal, p = diagnosis.nominal
    nothing = np.zeros(0)
    updated = _each(problem, null.hypothesis, null.p, nothing, record)
    final, best = updated, diagnosis.best
    if best is not None and driven is not None:
        closed = with_law(driven, diagnosis.problem, best, [record])
        if closed is not None:
            under, hypothesis, x = closed
            final = _each(under, hypothesis, best.p, x, under.records[0])
        elif best.joint is None and diagnosis.place is not None:
            final = _each(problem, diagnosis.place.fit.hypothesis, best.p, nothing, record)
    return {"nominal": _each(problem, nominal, p, nothing, record), "parameters": updated, "final": final}


def _problem(diagnosis: Diagnosis) -> Problem:
    """The problem in which the force at the drive is free."""
    return diagnosis.problem if diagnosis.driven is None else diagnosis.driven.start.problem


def _each(problem: Problem, hypothesis: Hypothesis, p: FloatArray, x: FloatArray, record: FitRecord) -> FloatArray:
    out = np.zeros(record.y.shape)
    for i in range(len(out)):
        noise = record.noise.copy()
        noise[i] = NO_WEIGHT * max(float(record.y[i].std()), float(noise[i]))
        without = problem.on([replace(record, noise=noise)]).thinned(None)
        ((y, _, _),) = without.fitted_lines(hypothesis, p, x)
        (line,) = without.lines(hypothesis.reduced)
        out[i] = in_time(y, line.index, record.n)[i]
    return out
