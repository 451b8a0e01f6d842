"""What the responses say about the unknowns before anything is updated: sensitivities, collinearity, silence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.estimate.updating.problem import Problem
from femend.estimate.updating.unknown import spans

__all__ = ["Collinear", "Sensitivity", "collinear_groups", "sensitivities"]

FloatArray = NDArray[np.float64]

# condition index and share of variance from which columns are dependent (Belsley, Kuh and Welsch 1980, section 3.2)
CONDITION, SHARE = 30.0, 0.5


@dataclass(frozen=True, slots=True)
class Collinear:
    """Unknowns of which the data tell a combination only: `condition` index of the direction, `names`, their
    `weights`."""

    condition: float
    names: tuple[str, ...]
    weights: tuple[float, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Sensitivity:
    """`table` (n_values, n_unknowns): change of every residual, in deviations, for one span of every unknown (prior
    1-sigma, else a quarter of the bounds, else 1).

    `size` (n_unknowns,) is the length of its columns; `insensitive` names unknowns that move all responses together by
    less than one deviation; `collinear` are groups that the responses cannot tell apart.
    """

    names: tuple[str, ...]
    table: FloatArray
    size: FloatArray
    singular_values: FloatArray
    insensitive: tuple[str, ...]
    collinear: tuple[Collinear, ...]

    def __repr__(self) -> str:
        lines = [f"{'unknown':20} {'deviations a span':>18}"]
        order = np.argsort(-self.size)
        lines += [f"{self.names[i]:20} {self.size[i]:18.3g}" for i in order]
        if self.insensitive:
            lines.append("hardly seen: " + ", ".join(self.insensitive))
        for c in self.collinear:
            terms = " ".join(f"{w:+.2f} {n}" for n, w in zip(c.names, c.weights, strict=True))
            lines.append(f"not told apart (condition index {c.condition:.0f}): {terms}")
        return "\n".join(lines)


def sensitivities(problem: Problem, p: ArrayLike | None = None) -> Sensitivity:
    """Sensitivities of `problem` at `p` (n_unknowns,), the prior mean by default; raises what `evaluate` raises."""
    here = problem.evaluate(problem.unknowns.mean if p is None else p, slopes=True)
    assert here.jacobian is not None
    table = here.jacobian * spans(problem.unknowns)
    size = np.sqrt((table**2).sum(axis=0))
    names = problem.unknowns.names
    seen = size > 1.0
    quiet = tuple(n for n, s in zip(names, seen, strict=True) if not s)
    groups = collinear_groups(table[:, seen], tuple(n for n, s in zip(names, seen, strict=True) if s))
    return Sensitivity(
        names, table, size, np.asarray(np.linalg.svd(table, compute_uv=False), dtype=np.float64), quiet, groups
    )


def collinear_groups(table: FloatArray, names: tuple[str, ...]) -> tuple[Collinear, ...]:
    """Near dependencies among the columns `names` of `table` (n_values, n) by variance decomposition.

    Columns are scaled to unit length; a singular direction with a condition index above 30 in which two or more columns
    have more than half of their variance is a dependency (Belsley, Kuh and Welsch, Regression Diagnostics, 1980,
    chapter 3). Columns that only together reach more than half with the directions above 30 are counted there as well.

    >>> one = collinear_groups(np.array([[1.0, 1.0, 0.0], [1.0, 1.001, 0.0], [0.0, 0.0, 1.0]]), ("a", "b", "c"))
    >>> one[0].names
    ('a', 'b')
    """
    n = table.shape[1]
    if n < 2:
        return ()
    length = np.linalg.norm(table, axis=0)
    scaled = table / np.where(length > 0, length, 1.0)
    if scaled.shape[0] < n:  # fewer values than unknowns: directions that no value sees
        scaled = np.vstack([scaled, np.zeros((n - scaled.shape[0], n))])
    _, s, Vt = np.linalg.svd(scaled, full_matrices=False)
    s = np.maximum(s, 1e-12 * s[0])
    part = (Vt / s[:, None]) ** 2
    share = part / part.sum(axis=0)
    index = s[0] / s
    weak = np.flatnonzero(index > CONDITION)
    if weak.size == 0:
        return ()
    involved = share[weak].sum(axis=0) > SHARE
    out = []
    for k in weak[::-1]:
        own = np.flatnonzero(involved & (np.abs(Vt[k]) > 1.0 / np.sqrt(4.0 * n)))
        if own.size >= 2:
            sign = np.sign(Vt[k, own[0]])
            out.append(
                Collinear(float(index[k]), tuple(names[i] for i in own), tuple(float(sign * Vt[k, i]) for i in own))
            )
    return tuple(out)
