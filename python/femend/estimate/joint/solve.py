"""Gauss-Newton estimate of shared unknowns from several blocks of residuals, with Gaussian priors and evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from femend.model.terms.unknowns import Unknowns

__all__ = ["Block", "Posterior", "maximise"]

FloatArray = NDArray[np.float64]

# a step is taken when it lowers the cost by this share of itself at least; the search ends below it
TOLERANCE = 1e-5


class Block(Protocol):
    """Residuals of one recording: normalised, real, with their derivatives."""

    @property
    def name(self) -> str:
        """How it is called in reports."""

    def gauss_newton(self, p: FloatArray, derivatives: bool) -> tuple[float, FloatArray, FloatArray]:
        """Sum of squares, gradient J'r (n,) and J'J (n, n) at p (zeros without derivatives)."""

    @property
    def n_values(self) -> float:
        """Number of independent real values behind the squares."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Maximum a posteriori estimate with its Laplace approximation.

    `p` (n,) and its `precision` (n, n); `squares` of every block by name, over `n_values` independent values together;
    `prior` the prior's part of the `cost`;
    `log_evidence` up to a constant that is the same for all models of the same data:

        ln Z = -cost / 2 - (ln det precision - ln det prior precision) / 2

    (Laplace's method; MacKay, Information Theory, Inference, and Learning Algorithms, eq. 28.10).
    """

    unknowns: Unknowns
    p: FloatArray
    precision: FloatArray
    squares: dict[str, float]
    prior: float
    converged: bool
    n_values: float = 0.0

    @property
    def cost(self) -> float:
        """Squares and prior together."""
        return sum(self.squares.values()) + self.prior

    @property
    def covariance(self) -> FloatArray:
        """Covariance (n, n) of p."""
        return np.asarray(np.linalg.inv(self.precision))

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence, up to a constant of the data."""
        after, before = (np.linalg.slogdet(A)[1] for A in (self.precision, self.unknowns.precision))
        return float(-0.5 * self.cost - 0.5 * (after - before))

    @property
    def values(self) -> FloatArray:
        """Values (n,) of the unknowns."""
        return self.unknowns.values(self.p)

    @property
    def sd(self) -> FloatArray:
        """Standard deviations (n,) of the values, to first order."""
        return self.unknowns.value_sd(self.p, self.covariance)

    def settled(self) -> Unknowns:
        """The unknowns with this posterior as their prior."""
        return self.unknowns.with_posterior(self.p, self.precision)


def maximise(
    unknowns: Unknowns,
    blocks: Sequence[Block],
    start: FloatArray | None = None,
    *,
    iterations: int = 40,
    max_step: float = 1.0,
) -> Posterior:
    """Minimises the blocks' squares plus the prior by Levenberg-Marquardt (Marquardt 1963), from `start` or the mean.

    No unknown moves by more than `max_step` in a step. A start at which the model cannot be solved gives a posterior
    with infinite cost and `converged` False.
    """
    p = unknowns.mean.copy() if start is None else np.asarray(start, dtype=np.float64).copy()
    cost, gradient, H, squares = _expand(unknowns, blocks, p, True)
    damping, converged = 1e-3, False
    for _ in range(iterations if np.isfinite(cost) else 0):
        moved = False
        for _ in range(12):
            scaled = H + damping * np.diag(np.maximum(np.diag(H), 1e-12))
            step = -np.linalg.solve(scaled, gradient)
            step *= min(1.0, max_step / max(float(np.abs(step).max()), 1e-300))
            new = _expand(unknowns, blocks, p + step, False)[0]
            if np.isfinite(new) and new < cost:
                moved = True
                break
            damping *= 4.0
        if not moved:
            converged = True
            break
        gain = cost - new
        p, damping = p + step, damping / 5.0
        cost, gradient, H, squares = _expand(unknowns, blocks, p, True)
        if gain < TOLERANCE * cost + 1e-3:
            converged = True
            break
    prior = float((p - unknowns.mean) @ unknowns.precision @ (p - unknowns.mean))
    return Posterior(unknowns, p, H, squares, prior, converged, sum(b.n_values for b in blocks))


def _expand(
    unknowns: Unknowns, blocks: Sequence[Block], p: FloatArray, derivatives: bool
) -> tuple[float, FloatArray, FloatArray, dict[str, float]]:
    """Cost, half its gradient, half its Gauss-Newton matrix and the blocks' squares."""
    d = p - unknowns.mean
    gradient, H = unknowns.precision @ d, unknowns.precision.copy()
    cost = float(d @ gradient)
    squares: dict[str, float] = {}
    for block in blocks:
        try:
            own, g, A = block.gauss_newton(p, derivatives)
        except np.linalg.LinAlgError:
            own, g, A = np.inf, np.zeros_like(p), np.zeros_like(H)
        squares[block.name] = squares.get(block.name, 0.0) + own
        cost += own
        if derivatives:
            gradient = gradient + g
            H = H + A
    return cost, gradient, H, squares
