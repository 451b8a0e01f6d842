"""The whole posterior by tempered particles, with its evidence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.errors import FemendError, UpdatingError
from femend.estimate.updating.design import prior_quantiles
from femend.estimate.updating.lost_modes import Flags
from femend.estimate.updating.moves import TOO_LITTLE, move
from femend.estimate.updating.problem import Problem
from femend.estimate.updating.step import root
from femend.estimate.updating.unknown import limits
from femend.model.terms.unknowns import Unknowns
from femend.numerals import plain
from femend.threads import one_blas_thread

__all__ = ["Posterior", "sample", "temperatures_left"]

FloatArray = NDArray[np.float64]

# effective share of the particles after a step of the temperature
EFFECTIVE = 0.5
# particles for each unknown, of whose halves covariances are made
FEWEST = 4


@dataclass(frozen=True, eq=False, repr=False)
class Posterior:
    """Draws `p` (n, n_unknowns) of equal weight, their `squares` (n,), ln evidence (a constant of the data left out)
    with its standard error, temperatures from 0 to 1, the acceptance at each, and advice ("" if the moves mixed)."""

    problem: Problem
    p: FloatArray
    squares: FloatArray
    log_evidence: float
    log_evidence_se: float
    temperatures: tuple[float, ...]
    acceptance: tuple[float, ...]
    n_solved: int
    advice: str

    @property
    def values(self) -> FloatArray:
        """Values (n, n_unknowns) of the unknowns."""
        return np.array([self.problem.unknowns.values(p) for p in self.p])

    @property
    def mean(self) -> FloatArray:
        """Mean (n_unknowns,) of p."""
        return np.asarray(self.p.mean(axis=0))

    @property
    def covariance(self) -> FloatArray:
        """Covariance (n_unknowns, n_unknowns) of p."""
        return np.atleast_2d(np.cov(self.p.T))

    def quantiles(self, q: tuple[float, ...] = (0.025, 0.5, 0.975)) -> dict[str, tuple[float, ...]]:
        """Quantiles `q` of every value by name."""
        found = np.quantile(self.values, q, axis=0)
        return {n: tuple(found[:, i].tolist()) for i, n in enumerate(self.problem.unknowns.names)}

    def __repr__(self) -> str:
        lines = [
            f"{len(self.p)} draws, ln evidence {plain(self.log_evidence, 4)} ± {plain(self.log_evidence_se, 2)}, "
            f"{self.n_solved} solutions in {len(self.temperatures) - 1} steps"
            + (f" ({self.advice})" * bool(self.advice)),
            f"{'unknown':20} {'mean':>9} {'sd':>9} {'2.5 %':>9} {'median':>9} {'97.5 %':>9}",
        ]
        mean, sd = self.values.mean(axis=0), self.values.std(axis=0)
        for i, (name, (low, middle, high)) in enumerate(self.quantiles().items()):
            lines.append(f"{name:20} {mean[i]:9.4g} {sd[i]:9.2g} {low:9.4g} {middle:9.4g} {high:9.4g}")
        return "\n".join(lines)


@one_blas_thread
def sample(
    problem: Problem,
    n: int = 500,
    *,
    seed: int = 0,
    counting: Flags | None = None,
    solve_all: Callable[[FloatArray], FloatArray] | None = None,
    told: Callable[[float], None] | None = None,
) -> Posterior:
    """Draws from the posterior of `problem` by sequential Monte Carlo: `n` particles from the prior, cut off at the
    bounds, through tempered likelihoods exp(-beta squares / 2) with beta from 0 to 1. Each beta leaves half of the
    particles effective (Ching and Chen 2007, transitional MCMC); systematic resampling; then moves until the particles
    are new draws (`moves.move`; a sequential Monte Carlo sampler, Del Moral, Doucet and Jasra 2006). The evidence is
    the product of the mean weights, its error from their scatter. A model without a solution has no likelihood.

    All measured modes count, however they pair, but for those that `counting` (each configuration's (n_test,), None
    where it has no modes) has as False. `solve_all` maps points (n, n_unknowns) to squares (n,), where there is
    something faster than one after the other (a response surface). `seed` makes it repeatable, `told` is called with
    the temperature, 0 once the particles of the prior are solved and then every one that is reached. Raises
    UpdatingError for fewer particles than four for each unknown, an unknown without prior or bounds, where the prior is
    correlated, and where no particle has a solution.
    """
    _refuse(problem.unknowns, n)
    rng, bounds, R = np.random.default_rng(seed), limits(problem.unknowns), root(problem.unknowns.precision)

    def squares_of(points: FloatArray) -> FloatArray:
        return _squares(problem, points, counting) if solve_all is None else solve_all(points)

    def prior_of(points: FloatArray) -> FloatArray:
        return np.asarray((((points - problem.unknowns.mean) @ R.T) ** 2).sum(axis=1))

    p = _of_prior(problem.unknowns, n, rng)
    s = squares_of(p)
    if not np.isfinite(s).any():
        raise UpdatingError(f"none of {n} points of the prior has a solution; look at bounds and pairing")
    if told is not None:
        told(0.0)
    beta, temperatures, acceptance, solved, advice = 0.0, [0.0], [], n, ""
    ln_z = variance = 0.0
    while beta < 1.0:
        new = _next(s, beta)
        w = np.exp(-0.5 * (new - beta) * (s - s.min()))
        ln_z += float(np.log(w.mean()) - 0.5 * (new - beta) * s.min())
        variance += float(w.var() / w.mean() ** 2 / n)
        chosen = np.searchsorted(np.cumsum(w) / w.sum(), (rng.random() + np.arange(n)) / n).clip(0, n - 1)
        beta = new
        moved = move(p[chosen], s[chosen], beta, rng, squares_of, prior_of, bounds)
        p, s, solved = moved.p, moved.squares, solved + moved.solved
        temperatures.append(beta)
        acceptance.append(moved.acceptance)
        if told is not None:
            told(beta)
        if moved.away < TOO_LITTLE:
            far = f"particles moved {moved.away:.2f} deviations at temperature {plain(beta, 3)}"
            advice = f"{far}: take more of them, or trust less"
    return Posterior(
        problem, p, s, ln_z, float(np.sqrt(variance)), tuple(temperatures), tuple(acceptance), solved, advice
    )


def _refuse(unknowns: Unknowns, n: int) -> None:
    """Raises UpdatingError for fewer than enough particles, and for a prior that couples unknowns."""
    fewest = FEWEST * len(unknowns)
    if n < fewest:
        raise UpdatingError(
            f"{n} draws for {len(unknowns)} unknowns say nothing of how these go together; take {fewest} or more"
        )
    if np.any(unknowns.precision - np.diag(np.diag(unknowns.precision))):
        raise UpdatingError("the prior couples unknowns (a field); sample in unknowns that are independent a priori")


def _of_prior(unknowns: Unknowns, n: int, rng: np.random.Generator) -> FloatArray:
    """Points (n, n_unknowns) of the prior, each n-th of every unknown's once."""
    u = (rng.permuted(np.tile(np.arange(n)[:, None], (1, len(unknowns))), axis=0) + rng.random((n, 1))) / n
    return prior_quantiles(unknowns, np.clip(u, 1e-12, 1 - 1e-12))


def _squares(problem: Problem, points: FloatArray, counting: Flags | None) -> FloatArray:
    """Squares (n,) one by one, infinite where there is no solution; all measured modes count without `counting`."""
    out = np.full(len(points), np.inf)
    every = counting or tuple(
        None if c.test is None else np.ones(c.test.freq.size, dtype=np.bool_) for c in problem.configurations
    )
    for i, p in enumerate(points):
        try:
            out[i] = problem.evaluate(p, active=every).squares
        except (FemendError, ArithmeticError):
            continue
    return out


def _next(s: FloatArray, beta: float) -> float:
    """The next temperature: half of the particles effective, or 1."""

    def effective(new: float) -> float:
        w = np.exp(-0.5 * (new - beta) * (s - s.min()))
        return float(w.sum() ** 2 / (w @ w)) / len(s)

    if effective(1.0) >= EFFECTIVE:
        return 1.0
    low, high = beta, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(middle) >= EFFECTIVE else (low, middle)
    return max(low, beta + 1e-12)


def temperatures_left(beta: float, n_unknowns: int) -> int:
    """About how many temperatures lie between `beta` and 1 where data tell much more of all unknowns than the prior.

    Squares are then chi-squares of `n_unknowns` over beta, and weights exp(-delta beta squares / 2) leave the effective
    share ((1 + 2 delta) / (1 + delta)^2)^(n_unknowns / 2).
    """
    c = EFFECTIVE ** (2 / n_unknowns)
    delta = (1 - c + np.sqrt(1 - c)) / c
    return int(np.ceil(np.log(1 / beta) / np.log1p(delta)))
