"""A free force at a place, with all that is needed to tell how near a linear law comes to it in the closed loop.

Where the model's unknowns stay as they are, a law of dynamic stiffness kappa in place of the free force F leaves
|F + kappa D|² more of a record, as the sensors tell forces there: D is the motion under the law,
(1 + kappa C)⁻¹ (D_F - C F), not that under the free force, D_F.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["FreeForce"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class FreeForce:
    """A free force on the lines `s` (K,) of a record: the motion `D` (K, n_w) it acts in, itself `F` (K, n_w), what the
    model moves by forces of one `C` (K, n_w, n_w), and how well the sensors tell it, `gram` (K, n_w, n_w)."""

    s: ComplexArray
    D: ComplexArray
    F: ComplexArray
    C: ComplexArray
    gram: ComplexArray

    def thinned(self, limit: int) -> FreeForce:
        """The same on every so many lines, about `limit` in all."""
        step = max(1, len(self.s) // limit)
        return FreeForce(*(a[::step] for a in (self.s, self.D, self.F, self.C, self.gram)))

    @cached_property
    def without(self) -> ComplexArray:
        """The motion (K, n_w) where nothing acts."""
        return np.asarray(self.D - np.einsum("kvw,kw->kv", self.C, self.F))

    @cached_property
    def _told(self) -> ComplexArray:
        """What whitens forces (K, n_w, n_w): upper triangular R of gram = R^H R."""
        n_w = self.gram.shape[1]
        least = 1e-12 * np.maximum(np.real(np.einsum("kww->k", self.gram)), 1e-300) / n_w
        lower = np.linalg.cholesky(self.gram + least[:, None, None] * np.eye(n_w))
        return np.asarray(lower.conj().transpose(0, 2, 1))

    def errors(self, kappa: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Weighted force that laws of dynamic stiffness `kappa` (n_laws, K) leave, and its derivatives by kappa, each
        (n_laws, K, n_w)."""
        closed = np.eye(self.D.shape[1]) + kappa[:, :, None, None] * self.C
        D = np.linalg.solve(closed, self.without[:, :, None])
        e = self.F + kappa[:, :, None] * D[..., 0]
        slope = np.linalg.solve(closed, D)[..., 0]
        return tuple(np.einsum("kvw,xkw->xkv", self._told, a) for a in (e, slope))

    def left(self, kappa: ComplexArray) -> FloatArray:
        """What laws of dynamic stiffness `kappa` (n_laws, K) leave of the free force, as the sensors tell it
        (n_laws,)."""
        e, _ = self.errors(kappa)
        return np.asarray((np.abs(e) ** 2).sum(axis=(1, 2)))
