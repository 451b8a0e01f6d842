"""Response surfaces from a design of experiments, and global sensitivity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import FemendError, UpdatingError
from femend.estimate.updating.design import design, prior_quantiles
from femend.estimate.updating.problem import Problem
from femend.estimate.updating.unknown import limits, spans
from femend.numerals import plain
from femend.threads import one_blas_thread

__all__ = ["ResponseSurface", "Sobol", "response_surface", "sobol"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class ResponseSurface:
    """Quadratic polynomials of all residuals in p, fitted to the problem solved at `points` (n, n_unknowns).

    `error` is the root mean square of what leaves each point out (PRESS), in deviations, over all residuals; `spread`
    the same of the residuals about their means: a surface is worth something where `error` is far below it. `failures`
    tell of points without solution.
    """

    problem: Problem
    points: FloatArray
    residuals: FloatArray
    coefficients: FloatArray
    centre: FloatArray
    scale: FloatArray
    error: float
    spread: float
    failures: dict[int, str]

    def __repr__(self) -> str:
        n, m = self.residuals.shape
        return (
            f"quadratic surface of {m} residuals in {', '.join(self.problem.unknowns.names)}, from {n} points "
            f"({len(self.failures)} failed): error {plain(self.error, 3)} deviations, spread {plain(self.spread, 3)}"
        )

    def residual(self, p: FloatArray) -> FloatArray:
        """Residuals (n, m) of the surface at points `p` (n, n_unknowns)."""
        return np.asarray(_terms((np.atleast_2d(p) - self.centre) / self.scale) @ self.coefficients)

    def squares(self, p: FloatArray) -> FloatArray:
        """Squares (n,) at points `p` (n, n_unknowns): what `sample` takes as `solve_all`."""
        return np.asarray((self.residual(p) ** 2).sum(axis=1))

    def minimise(self, n_starts: int = 8, seed: int = 0) -> FloatArray:
        """The point (n_unknowns,) of least squares and prior on the surface between the bounds: where to start
        `update`.

        The best of `n_starts` searches, from the best point of the design and others of `seed`.
        """
        from scipy.optimize import minimize

        u = self.problem.unknowns
        lower, upper = limits(u)

        def cost(x: FloatArray) -> float:
            return float(self.squares(x)[0]) + self.problem.prior_cost(x)

        first = self.points[int(np.argmin([cost(x) for x in self.points]))]
        box = list(zip(lower, upper, strict=True))
        starts = [first, *design(u, n_starts - 1, seed=seed)] if n_starts > 1 else [first]
        found = [minimize(cost, x, bounds=box, method="L-BFGS-B") for x in starts]
        return np.clip(min(found, key=lambda r: r.fun).x, lower, upper)


def _terms(x: FloatArray) -> FloatArray:
    """1, x_i, x_i x_j (n, n_terms)."""
    n, d = x.shape
    i, j = np.triu_indices(d)
    return np.hstack([np.ones((n, 1)), x, x[:, i] * x[:, j]])


@one_blas_thread
def response_surface(problem: Problem, n: int | None = None, *, seed: int = 0) -> ResponseSurface:
    """Solves `problem` at `n` points of a Latin hypercube of `seed` (twice the polynomial's terms by default) and fits
    a full quadratic to each residual (Box and Draper, Empirical Model-Building, 1987).

    All measured modes count at every point, so that residuals mean the same. Systems with `solve_many` (an external
    solver) solve the points in parallel; a point without solution is told of and left out. Raises UpdatingError where
    fewer points than terms are left.
    """
    d = len(problem.unknowns)
    n_terms = (d + 1) * (d + 2) // 2
    points = design(problem.unknowns, 2 * n_terms if n is None else n, seed=seed)
    for i, c in enumerate(problem.configurations):
        ahead = getattr(c.system, "solve_many", None)
        if ahead is not None:
            ahead([problem.factors(p, i) for p in points])
    rows, kept, failures = [], [], {}
    for k, p in enumerate(points):
        try:
            rows.append(problem.evaluate(p, active=_every(problem)).residual)
            kept.append(k)
        except (FemendError, ArithmeticError) as error:
            failures[k] = str(error)
    if len(rows) < n_terms:
        raise UpdatingError(f"{len(rows)} of {len(points)} points have a solution, the quadratic has {n_terms} terms")
    centre, scale = points[kept].mean(axis=0), spans(problem.unknowns)
    X, Y = _terms((points[kept] - centre) / scale), np.array(rows)
    coefficients = np.asarray(np.linalg.lstsq(X, Y, rcond=None)[0], dtype=np.float64)
    Q = np.linalg.qr(X)[0]
    leverage = np.clip((Q**2).sum(axis=1), 0.0, 1.0 - 1e-9)
    left = (Y - X @ coefficients) / (1.0 - leverage)[:, None]
    return ResponseSurface(
        problem,
        points[kept],
        Y,
        coefficients,
        centre,
        scale,
        float(np.sqrt(np.mean(left**2))),
        float(np.sqrt(np.mean((Y - Y.mean(axis=0)) ** 2))),
        failures,
    )


def _every(problem: Problem) -> tuple[NDArray[np.bool_] | None, ...]:
    return tuple(None if c.test is None else np.ones(c.test.freq.size, dtype=np.bool_) for c in problem.configurations)


@dataclass(frozen=True, eq=False, repr=False)
class Sobol:
    """Sobol indices by unknown: `first` (n_outputs, n_unknowns) the share of an output's variance from the unknown
    alone, `total` the share it has any part in."""

    names: tuple[str, ...]
    first: FloatArray
    total: FloatArray
    n_solved: int

    def __repr__(self) -> str:
        lines = [f"{self.n_solved} points, {len(self.first)} outputs; largest indices over the outputs"]
        lines.append(f"{'unknown':20} {'first':>7} {'total':>7}")
        for name, first, total in zip(self.names, self.first.T, self.total.T, strict=True):
            lines.append(f"{name:20} {np.nanmax(first):7.3f} {np.nanmax(total):7.3f}")
        return "\n".join(lines)

    def together(self, variance: FloatArray) -> tuple[FloatArray, FloatArray]:
        """First-order and total indices (n_unknowns,) of all outputs as one, of `variance` (n_outputs,) each (Gamboa,
        Janon, Klein and Lagnoux, "Sensitivity analysis for multidimensional and functional outputs", 2014)."""
        moving = variance > 0  # an output that does not move has no indices
        weight = variance[moving] / max(float(variance[moving].sum()), 1e-300)
        return weight @ self.first[moving], weight @ self.total[moving]


def sobol(problem: Problem, outputs: Callable[[FloatArray], FloatArray], n: int = 1024, *, seed: int = 0) -> Sobol:
    """Global sensitivity of `outputs`, which maps points p (n, n_unknowns) to (n, n_outputs), over the priors of
    `problem`.

    `n` is a power of 2 and n (n_unknowns + 2) points are asked for: a surface's `residual`, or small models. Computed
    by scipy.stats.sobol_indices (Saltelli et al. 2010) with `seed`. Raises UpdatingError for an `n` that is no power of
    2.
    """
    from scipy.stats import sobol_indices

    if n < 2 or n & (n - 1):
        raise UpdatingError(f"{n} points: Sobol' sequences take a power of 2")
    unknowns = problem.unknowns
    if len(unknowns) == 1:  # which makes all there is
        one = np.ones((np.asarray(outputs(unknowns.mean[None])).shape[1], 1))
        return Sobol(unknowns.names, one, one, 1)
    solved = 0

    class Quantiles:
        """An unknown's prior, as scipy asks for it."""

        def __init__(self, i: int) -> None:
            self.i = i

        def ppf(self, q: FloatArray) -> FloatArray:
            full = np.full((q.size, len(unknowns)), 0.5)
            full[:, self.i] = np.clip(q.ravel(), 1e-12, 1 - 1e-12)
            return prior_quantiles(unknowns, full)[:, self.i].reshape(q.shape)

    def function(x: FloatArray) -> FloatArray:
        nonlocal solved
        solved += x.shape[1]
        return np.asarray(outputs(np.ascontiguousarray(x.T))).T

    dists: Any = [Quantiles(i) for i in range(len(unknowns))]
    found = sobol_indices(func=function, n=n, dists=dists, rng=seed)
    return Sobol(unknowns.names, np.atleast_2d(found.first_order), np.atleast_2d(found.total_order), solved)
