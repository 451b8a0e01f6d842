"""Residuals of operating shapes over frequency (ODS-FRF): the unbalances and the structure that make them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.estimate.joint.line_forces import OdsFrf
from femend.estimate.joint.linearised import Linearised
from femend.estimate.joint.receptance import receptance
from femend.estimate.joint.rotor import DELAY, Unbalance
from femend.model.terms.configured import ConfiguredModel

__all__ = ["OdsBlock"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class OdsBlock:
    """Operating shapes `shapes` per unit course Omega^2 cos(theta), of a structure on which `unbalance` turns.

    `out` (n_out, r) and `bearings` (n_bearings, 3, r) are rows of the basis; squares count `weight` each; of a `mask`
    (K, n_out, 1) only the True values count. With w = H f the derivatives are dw/dp = (dH/dp) f and dw/df = H, exact.
    """

    name: str
    model: ConfiguredModel
    shapes: OdsFrf
    out: FloatArray
    bearings: FloatArray
    unbalance: Unbalance
    weight: float = 1.0
    mask: NDArray[np.bool_] | None = None

    @property
    def n_values(self) -> float:
        """Independent real values."""
        return 2.0 * (self.shapes.Y.size if self.mask is None else int(self.mask.sum())) * self.weight

    def masked(self, mask: NDArray[np.bool_]) -> OdsBlock:
        """The block with only the values of `mask` (K, n_out, 1) counting."""
        return replace(self, mask=mask)

    def linearised(self, p: FloatArray) -> Linearised:
        """Values and derivatives at `p` (n,)."""
        u = self.model.unknowns
        at, late = [u.index(name) for name in self.unbalance.names], u.index(DELAY)
        size = np.array([u.items[i].scale for i in at])
        s = 2j * np.pi * self.shapes.freq
        delay = np.exp(-s * u.items[late].scale * p[late])
        # at positive frequencies the sine course is -j times the cosine course
        pattern = self.unbalance.pattern(self.bearings) * size[:, None, None]
        loads = np.einsum("c,ucr->ru", np.array([1.0, -1.0j]), pattern)
        speed = self.unbalance.speed(self.shapes.freq)
        solved = receptance(self.model, p, s, speed)
        course = (solved.s**2 * delay)[:, None, None]
        each = course * (self.out @ (solved.X @ loads))  # (K, n_out, n_u)
        total = each @ p[at]
        index, dK, dM, dC = self.model.derivatives(p)
        left, right = self.out @ solved.X, solved.X @ (loads @ p[at])[:, None]
        own = course * solved.changes(left, right, dK, dM, dC)
        for i, weight, A in self.model.turning_changes(p, solved.s, speed):
            own[int(np.searchsorted(index, i))] -= course * weight[:, None, None] * (left @ (A @ right))
        slopes = np.concatenate(
            [own, each.transpose(2, 0, 1)[..., None], (-s[:, None] * u.items[late].scale * total)[None, :, :, None]]
        )
        where = np.concatenate([index, np.array([*at, late], dtype=np.int64)])
        return Linearised(
            self.shapes.freq, self.shapes.Y[:, :, None], total[:, :, None], self.shapes.sd[:, :, None], where, slopes
        )

    def gauss_newton(self, p: FloatArray, derivatives: bool) -> tuple[float, FloatArray, FloatArray]:
        """Sum of squares, J'r (n,) and J'J (n, n) at `p` (n,); zeros in place of the last two without `derivatives`."""
        n = len(p)
        counted = np.ones((*self.shapes.Y.shape, 1), dtype=bool) if self.mask is None else self.mask
        weight = np.where(counted, self.weight, 0.0)
        squares, gradient, A = self.linearised(p).gauss_newton(n, weight)
        return (squares, gradient, A) if derivatives else (squares, np.zeros(n), np.zeros((n, n)))
