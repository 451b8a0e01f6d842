"""What sensors recorded beside what a model says they move, line by line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.diagnose.fitting.predict import predict_linear
from femend.estimate import Fit, FitRecord, Problem

__all__ = ["Shown", "shown_by"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Shown:
    """What sensors recorded, `Y` (n_out, K), and what a model says they move, `M`, on lines of a record of `n` samples
    of `dt` (s) from line `first` on; `at` (n_out,) numbers the sensors, `weight` (n_out, 1) is by their noise."""

    Y: ComplexArray
    M: ComplexArray
    at: NDArray[np.intp]
    weight: FloatArray
    first: int
    n: int
    dt: float

    @property
    def omega(self) -> FloatArray:
        """Angular frequencies (K,) of the lines, rad/s."""
        return np.asarray(2 * np.pi * (self.first + np.arange(self.M.shape[1])) / (self.n * self.dt), dtype=np.float64)


def shown_by(problem: Problem, fit: Fit, records: Sequence[FitRecord], rows: Sequence[int]) -> list[Shown]:
    """What the sensors at `rows` recorded in the band of a `problem`, and what a model fitted without a force beside it
    says, from rest."""
    made = []
    for r in records:
        y = np.asarray(predict_linear(problem, fit.hypothesis, fit.p, np.zeros(0), r))
        inside = np.flatnonzero(within_band(np.fft.rfftfreq(r.n, r.dt), problem.band))
        Y, M = (np.fft.rfft(x, axis=1)[:, inside] for x in (r.y, y))
        at = np.array([rows.index(int(row)) for row in r.out_rows])
        made.append(Shown(Y, M, at, 1 / r.noise[:, None] ** 2, int(inside[0]), r.n, r.dt))
    return made
