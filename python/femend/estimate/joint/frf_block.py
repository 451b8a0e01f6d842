"""Residuals of measured FRFs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.estimate.joint.receptance import receptance
from femend.model.configured import ConfiguredModel

__all__ = ["FrfBlock"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class FrfBlock:
    """Accelerances `H` (K, n_out, n_in) at `freq` (K,) Hz with standard deviation `sd` of each complex value.

    `out` (n_out, r) and `into` (n_in, r) are rows of the configuration's basis; squares count `weight` each, since
    neighbouring lines carry the same model error.
    """

    name: str
    model: ConfiguredModel
    freq: FloatArray
    H: ComplexArray
    sd: FloatArray
    out: FloatArray
    into: FloatArray
    weight: float = 1.0

    @property
    def n_values(self) -> float:
        """Independent real values."""
        return 2.0 * self.H.size * self.weight

    def predicted(self, p: FloatArray) -> ComplexArray:
        """Accelerances (K, n_out, n_in) of the model at p."""
        return receptance(self.model, p, 2j * np.pi * self.freq).between(self.out, self.into)

    def gauss_newton(self, p: FloatArray, derivatives: bool) -> tuple[float, FloatArray, FloatArray]:
        """Sum of squares, J'r (n,) and J'J (n, n) at `p` (n,); zeros in place of the last two without `derivatives`."""
        n = len(p)
        solved = receptance(self.model, p, 2j * np.pi * self.freq)
        factor = np.sqrt(self.weight) / self.sd * np.sqrt(2.0)
        r = ((solved.between(self.out, self.into) - self.H) * factor).ravel()
        total = float((np.abs(r) ** 2).sum())
        if not derivatives:
            return total, np.zeros(n), np.zeros((n, n))
        index, dK, dM, dC = self.model.derivatives(p)
        dX = solved.changes(self.out @ solved.X, solved.X @ self.into.T, dK, dM, dC)
        J = ((solved.s**2)[:, None, None] * dX * factor).reshape(len(index), -1)
        gradient, A = np.zeros(n), np.zeros((n, n))
        gradient[index] = (J.conj() @ r).real
        A[np.ix_(index, index)] = (J.conj() @ J.T).real
        return total, gradient, A
