"""A block of spectral values and its derivatives at one place of the unknowns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Linearised"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Linearised:
    """`measured` and `predicted` (K, n_out, n_in) with deviation `sd` of each complex value, and `slopes`
    (m, K, n_out, n_in) with respect to the unknowns at positions `index` (m,)."""

    freq: FloatArray
    measured: ComplexArray
    predicted: ComplexArray
    sd: FloatArray
    index: NDArray[np.int64]
    slopes: ComplexArray

    def gauss_newton(self, n: int, weight: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Sum of squares, J'r (n,) and J'J (n, n) of n unknowns, every value counting `weight` (K, n_out, n_in)."""
        factor = np.sqrt(2.0 * weight) / self.sd
        r = ((self.predicted - self.measured) * factor).ravel()
        J = (self.slopes * factor).reshape(len(self.index), -1)
        gradient, A = np.zeros(n), np.zeros((n, n))
        gradient[self.index] = (J.conj() @ r).real
        A[np.ix_(self.index, self.index)] = (J.conj() @ J.T).real
        return float((np.abs(r) ** 2).sum()), gradient, A
