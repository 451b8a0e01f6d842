"""What sensors may pick up of motion across them, and lack or show too much of their own, on the lines of a record: an
unknown share of each, eliminated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.estimate.power import smoothed

__all__ = ["ACROSS_SD", "GAIN_SD", "Across", "PickedUp"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# standard deviation of the share of motion across it that a sensor picks up (transverse sensitivity, mounting), and of
# what the prediction of that motion is wrong by, which counts as noise
ACROSS_SD, ACROSS_ERROR = 0.01, 0.1
# standard deviation of the share of its own motion that a sensor shows too much or too little of (calibration, of the
# force too: that is the same of all)
GAIN_SD = 0.02
# a share has a column of its own where the lines tell it as well as its prior does, in so many columns a record at most
WORTH, MOST = 1.0, 24


@dataclass(frozen=True, eq=False)
class Across:
    """Motion across sensors, or their own, whose shares have columns: `sensor` (m,) and accelerations `motion` (K, m),
    of which a share has the standard deviation `ACROSS_SD`."""

    sensor: NDArray[np.int64]
    motion: ComplexArray

    @classmethod
    def of(
        cls,
        spectra: ComplexArray,
        variance: FloatArray,
        index: NDArray[np.int64],
        share: float,
    ) -> tuple[FloatArray, Across | None]:
        """The variance (n_out, F) of a record's spectrum with what else counts as noise, and the motion on the lines
        `index` (K,), each with its `share` in the cost, whose shares the lines tell; None where that is none.

        `spectra` (3, n_out, F) are accelerations along the two other axes of every sensor's node and along its own.
        What may be picked up of them counts as noise, but for those whose share is told, of which the error of a
        prediction does.
        """
        spectra = spectra * np.array([1.0, 1.0, GAIN_SD / ACROSS_SD])[:, None, None]
        power = np.array([smoothed(np.abs(c) ** 2) for c in spectra])
        told = share * ACROSS_SD**2 * (np.abs(spectra[:, :, index]) ** 2 / variance[:, index]).sum(axis=2)
        order = np.argsort(-told, axis=None)
        order = order[told.ravel()[order] > WORTH][:MOST]
        turn, sensor = np.unravel_index(order, told.shape)
        part = np.full(told.shape, ACROSS_SD**2)
        part[turn, sensor] *= ACROSS_ERROR**2
        variance = variance + (part[:, :, None] * power).sum(axis=0)
        if not len(order):
            return variance, None
        motion = np.ascontiguousarray(spectra[turn, sensor][:, index].T)
        return variance, cls(np.asarray(sensor, dtype=np.int64), motion)


@dataclass(frozen=True, eq=False)
class PickedUp:
    """For every sensor that may pick something up an orthonormal basis of that, weighted (2K, m_s), real before
    imaginary, with the share of each direction that is left."""

    bases: tuple[tuple[int, FloatArray, FloatArray], ...]

    @classmethod
    def of(cls, across: Across, weight: FloatArray, share: float) -> PickedUp:
        """From the lines' weights, `weight` (K, n_out), and their `share` in the cost.

        With C the weighted columns of a sensor, the squares that shares of prior deviation sd leave at best, with their
        prior, are those of (1 + share sd² C Cᵀ)^(-1/2) times the residual (matrix inversion lemma).
        """
        bases = []
        for s in np.unique(across.sensor):
            columns = across.motion[:, across.sensor == s] * weight[:, s, None]
            U, size, _ = np.linalg.svd(np.vstack([columns.real, columns.imag]), full_matrices=False)
            bases.append((int(s), U, 1 / np.sqrt(1 + share * (ACROSS_SD * size) ** 2)))
        return cls(tuple(bases))

    @property
    def most(self) -> float:
        """Tempered squares that shares of one standard deviation, however they are signed, come to at most."""
        return float(sum(np.sqrt(left**-2 - 1).sum() ** 2 for _, _, left in self.bases))

    def taken_out(self, weighted: ComplexArray) -> ComplexArray:
        """Residuals `weighted` (K, n_out, ...) without what the best shares explain."""
        out = weighted.copy()
        for s, U, left in self.bases:
            e = np.concatenate([weighted[:, s].real, weighted[:, s].imag])
            e = e - U @ ((1 - left).reshape(-1, *(1,) * (e.ndim - 1)) * (U.T @ e))
            out[:, s] = e[: len(e) // 2] + 1j * e[len(e) // 2 :]
        return out
