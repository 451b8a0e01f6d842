"""Residuals of measured FRFs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.estimate.joint.linearised import Linearised
from femend.estimate.joint.receptance import receptance
from femend.model.terms.configured import ConfiguredModel

__all__ = ["FrfBlock"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class FrfBlock:
    """Accelerances `H` (K, n_out, n_in) at `freq` (K,) Hz with standard deviation `sd` of each complex value.

    `out` (n_out, r) and `into` (n_in, r) are rows of the configuration's basis; squares count `weight` each, since
    neighbouring lines carry the same model error. Of a `mask` (K, n_out, n_in) only the True values count.
    """

    name: str
    model: ConfiguredModel
    freq: FloatArray
    H: ComplexArray
    sd: FloatArray
    out: FloatArray
    into: FloatArray
    weight: float = 1.0
    mask: NDArray[np.bool_] | None = None

    @property
    def n_values(self) -> float:
        """Independent real values."""
        return 2.0 * (self.H.size if self.mask is None else int(self.mask.sum())) * self.weight

    def masked(self, mask: NDArray[np.bool_]) -> FrfBlock:
        """The block with only the values of `mask` (K, n_out, n_in) counting."""
        return replace(self, mask=mask)

    def predicted(self, p: FloatArray) -> ComplexArray:
        """Accelerances (K, n_out, n_in) of the model at p."""
        return receptance(self.model, p, 2j * np.pi * self.freq).between(self.out, self.into)

    def linearised(self, p: FloatArray) -> Linearised:
        """Values and derivatives at `p` (n,)."""
        solved = receptance(self.model, p, 2j * np.pi * self.freq)
        index, dK, dM, dC = self.model.derivatives(p)
        dX = solved.changes(self.out @ solved.X, solved.X @ self.into.T, dK, dM, dC)
        slopes = (solved.s**2)[:, None, None] * dX
        return Linearised(self.freq, self.H, solved.between(self.out, self.into), self.sd, index, slopes)

    def gauss_newton(self, p: FloatArray, derivatives: bool) -> tuple[float, FloatArray, FloatArray]:
        """Sum of squares, J'r (n,) and J'J (n, n) at `p` (n,); zeros in place of the last two without `derivatives`."""
        n = len(p)
        counted = np.ones(self.H.shape, dtype=bool) if self.mask is None else self.mask
        weight = np.where(counted, self.weight, 0.0)
        if derivatives:
            return self.linearised(p).gauss_newton(n, weight)
        r = (self.predicted(p) - self.H) * np.sqrt(2.0 * weight) / self.sd
        return float((np.abs(r) ** 2).sum()), np.zeros(n), np.zeros((n, n))
