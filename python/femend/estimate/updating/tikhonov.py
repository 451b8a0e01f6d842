"""Regularisation whose strength the data choose."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.estimate.updating.problem import Problem
from femend.estimate.updating.result import UpdateResult
from femend.estimate.updating.update import update
from femend.numerals import plain
from femend.threads import one_blas_thread

__all__ = ["Regularised", "tikhonov"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Regularised:
    """The run at the chosen `strength`, and the curve: `strengths` (n,), where they end (`p`, (n, n_unknowns)), squares
    and penalties (n,) (the penalty without its strength), the criterion (n,) whose least value was taken."""

    result: UpdateResult
    strength: float
    strengths: FloatArray
    p: FloatArray
    squares: FloatArray
    penalties: FloatArray
    criterion: FloatArray
    rule: str

    def __repr__(self) -> str:
        tried = self.strengths
        return (
            f"strength {plain(self.strength, 3)} of the priors by {self.rule!r}, of {len(tried)} from "
            f"{plain(float(tried.min()), 3)} to {plain(float(tried.max()), 3)}\n{self.result!r}"
        )


@one_blas_thread
def tikhonov(
    problem: Problem,
    strengths: Sequence[float] | None = None,
    *,
    rule: Literal["gcv", "discrepancy", "l-curve"] = "gcv",
    iterations: int = 60,
    tolerance: float = 1e-6,
    told: Callable[[], None] | None = None,
) -> Regularised:
    """Updates `problem` with its prior's precision times each of `strengths`, from strong to weak, and takes one.

    `rule` "gcv": generalised cross-validation, squares / (m - trace of the influence matrix)^2 least (Golub, Heath
    and Wahba 1979); "discrepancy": the strongest whose squares do not exceed the number of values (Morozov 1966;
    the deviations have to be right); "l-curve": the corner of ln penalty over ln squares (Hansen and O'Leary 1993),
    without one that nearest to 1. By default the strengths are half decades from 1e4 to 1e-4. `iterations` and
    `tolerance` are those of `update`; `told` is called when a strength is done. Raises UpdatingError for a problem
    without prior, an unknown rule, or strengths that are not positive.
    """
    if not np.any(problem.unknowns.precision):
        raise UpdatingError("the unknowns have no prior to strengthen; give them a finite sd, or a smooth field")
    if rule not in ("gcv", "discrepancy", "l-curve"):
        raise UpdatingError(f"rule {rule!r}; there are gcv, discrepancy and l-curve")
    given = np.logspace(4, -4, 17) if strengths is None else np.sort(np.asarray(strengths, dtype=np.float64))[::-1]
    if given.size == 0 or not np.all(given > 0):
        raise UpdatingError("strengths of a regularisation are above 0")
    results, squares, penalties, freedom = [], [], [], []
    p = None
    for strength in given:
        stronger = replace(problem, unknowns=problem.unknowns.strengthened(strength))
        result = update(
            stronger, p, iterations=iterations, tolerance=tolerance, doubt=False
        )  # all strengths on the same modes
        if told is not None:
            told()
        p = result.p
        J = result.after.jacobian
        assert J is not None
        free = ~result.at_bound
        own = result.precision[np.ix_(free, free)]
        freedom.append(float(np.trace(np.linalg.lstsq(own, J[:, free].T @ J[:, free], rcond=None)[0])))
        results.append(result)
        squares.append(result.after.squares)
        penalties.append(result.after.prior / strength)
    s, q, m = np.array(squares), np.array(penalties), results[0].after.n_values
    if rule == "gcv":
        criterion = s / np.maximum(m - np.array(freedom), 1e-9) ** 2
    elif rule == "discrepancy":
        fits = np.flatnonzero(s <= m)
        criterion = np.arange(given.size, dtype=np.float64)  # the strongest that fits, else the weakest
        criterion = criterion if fits.size else -criterion
        criterion[s > m] += given.size if fits.size else 0
    else:
        criterion = -_curvature(np.log(np.maximum(s, 1e-300)), np.log(np.maximum(q, 1e-300)))
    k = int(np.argmin(criterion))
    if rule == "l-curve" and not criterion[k] < 0:  # no corner anywhere: the prior as it is
        k = int(np.argmin(np.abs(np.log(given))))
    return Regularised(results[k], float(given[k]), given, np.array([r.p for r in results]), s, q, criterion, rule)


def _curvature(x: FloatArray, y: FloatArray) -> FloatArray:
    """Curvature (n,) of a curve by the circle through neighbours, infinite against a corner at the ends; positive where
    the corner of an L is."""
    out = np.full(x.size, -np.inf)
    for i in range(1, x.size - 1):
        a, b = np.array([x[i] - x[i - 1], y[i] - y[i - 1]]), np.array([x[i + 1] - x[i], y[i + 1] - y[i]])
        cross = a[0] * b[1] - a[1] * b[0]
        sides = np.linalg.norm(a) * np.linalg.norm(b) * np.linalg.norm(a + b)
        out[i] = -2 * cross / sides if sides > 1e-12 else 0.0
    return out
