"""Whether one sensor shows what the structure does not: hum, drift, a loose mount or cable.

Such a sensor bends the model that has to follow it, and what is left of it no parameter and no force explains. Without
it all others are explained: then what it shows beyond the model counts as its noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.locate import Located
from femend.diagnose.settings import AT_NOISE
from femend.estimate import Fit, FitRecord, Lines, Problem

__all__ = ["loud_sensor"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# misfit of a sensor from which it is louder than its noise, as a multiple of what is noise
LOUD = 4.0
# share of the misfit that a force at a place leaves at most where something is missing there, though it may leave more
# than noise: what else the model is off by
NEARLY = 0.5
# sensors, the worst ones, that are tried, and sensors that have to stay beside one
TRIED, FEWEST = 2, 3
# what makes a sensor mute, as a multiple of its noise
MUTE = 1e4
# lines to each side of the strongest that belong to it, and the share of what is left from which it is a hum
BESIDE, HUM = 1, 0.5


def loud_sensor(problem: Problem, null: Fit, located: Sequence[Located] = ()) -> list[FitRecord] | None:
    """The records with the noise of one sensor raised to what the model leaves of it, which `FitRecord.loud` then
    names: where the model `null` explains the others to the noise without it, and neither it nor a force at one of the
    places `located` explains most. None elsewhere."""
    near = max(AT_NOISE, NEARLY * null.score)
    if null.score <= AT_NOISE or any(one.fit.score <= near for one in located):
        return None
    if any(r.frf is not None or len(r.out_rows) <= FEWEST for r in problem.records):
        return None
    own = _misfits(problem, null)
    for row in sorted(own, key=lambda row: -own[row])[:TRIED]:
        muted = problem.on([_with_noise(r, row, MUTE * _noise(r, row)) for r in problem.records])
        (found,) = muted.fit([null.hypothesis], [(null.p, null.x)])
        if found is None:
            continue
        misfits = _misfits(problem, found)
        own_misfit = misfits.pop(row)
        if own_misfit > LOUD and np.mean(list(misfits.values())) <= AT_NOISE:
            return [_louder(line, e, row) for line, e in _left(problem, found)]
    return None


def _left(problem: Problem, fit: Fit) -> list[tuple[Lines, ComplexArray]]:
    """The lines of every record with what a fit leaves of its sensors (K, n_out)."""
    lines = problem.lines(fit.hypothesis.reduced)
    fitted = problem.fitted_lines(fit.hypothesis, fit.p, fit.x, lines)
    return [(line, line.Y - y) for line, (y, _, _) in zip(lines, fitted, strict=True)]


def _misfits(problem: Problem, fit: Fit) -> dict[int, float]:
    """Mean weighted squares that a fit leaves of every sensor, by its row of the g-set; records count alike."""
    found: dict[int, list[float]] = {}
    for line, e in _left(problem, fit):
        squares = (np.abs(line.left(e)) ** 2).mean(axis=0)
        for row, one in zip(line.record.out_rows.tolist(), squares.tolist(), strict=True):
            found.setdefault(row, []).append(one)
    return {row: float(np.mean(ones)) for row, ones in found.items()}


def _noise(record: FitRecord, row: int) -> float:
    return float(record.noise[record.out_rows == row].max(initial=0.0))


def _with_noise(record: FitRecord, row: int, noise: float) -> FitRecord:
    """The record with `noise` of the sensor at `row` of the g-set."""
    return replace(record, noise=np.where(record.out_rows == row, noise, record.noise))


def _louder(line: Lines, e: ComplexArray, row: int) -> FitRecord:
    """The record of a line with what is left, `e` (K, n_out), of the sensor at `row` as its noise."""
    record = line.record
    at = np.flatnonzero(record.out_rows == row)
    if not len(at):
        return record
    power = np.asarray(np.abs(e[:, at[0]]) ** 2)
    noise = max(float(np.sqrt(power.mean() / line.n)), float(record.noise[at[0]]))
    louder = (row, noise / max(float(record.noise[at[0]]), 1e-300), _hum(line.freq, power))
    return replace(_with_noise(record, row, noise), loud=(*record.loud, louder))


def _hum(freq: FloatArray, power: FloatArray) -> float:
    """Frequency (Hz) about which most of a `power` on lines `freq` (K,) stands; NaN where it is spread."""
    peak = int(np.argmax(power))
    about = power[max(peak - BESIDE, 0) : peak + BESIDE + 1].sum()
    return float(freq[peak]) if about > HUM * power.sum() else float("nan")
