"""One step of a bounded Gauss-Newton search: the linear problem inside a box."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["best_step", "root"]

FloatArray = NDArray[np.float64]

# keeps directions that no residual sees where they are: share of the span in which they may move freely
RIDGE = 1e-9


def root(precision: FloatArray) -> FloatArray:
    """R (n, n) with R^T R = `precision` (n, n), which may be singular.

    >>> np.abs(root(np.diag([4.0, 0.0]))).tolist()
    [[0.0, 0.0], [2.0, 0.0]]
    """
    values, vectors = np.linalg.eigh(precision)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)


def best_step(
    residual: FloatArray, jacobian: FloatArray, lower: FloatArray, upper: FloatArray, scale: FloatArray
) -> tuple[FloatArray, float]:
    """Minimises |`residual` + `jacobian` d|^2 over `lower` <= d <= `upper` (n,): the step and the decrease of the
    square.

    The bounded problem is solved exactly by active sets (Stark and Parker, Computational Statistics 10, 1995), so a
    trust region that is a box and the limits of the unknowns are one and the same. `scale` (n,) are the unknowns'
    spans.
    """
    A = jacobian * scale
    # a tall system says no more than its triangle
    if A.shape[0] > A.shape[1]:
        Q, A = np.linalg.qr(A)
        right = -Q.T @ residual
    else:
        right = -residual
    size = max(float(np.abs(A).max(initial=0.0)), 1e-300)
    A = np.vstack([A, RIDGE * size * np.eye(A.shape[1])])
    right = np.concatenate([right, np.zeros(A.shape[1])])
    low, high = np.minimum(lower / scale, 0.0), np.maximum(upper / scale, 0.0)
    gap = high - low < 1e-12
    free = ~gap
    d = np.zeros(A.shape[1])
    if free.any():
        d[free] = _solve(A[:, free], right, low[free], high[free])
    step = d * scale
    moved = residual + jacobian @ step
    return step, float(residual @ residual - moved @ moved)


def _solve(A: FloatArray, b: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """min |A d - b|^2 with low <= d <= high."""
    from scipy.optimize import lsq_linear

    free = np.asarray(np.linalg.lstsq(A, b, rcond=None)[0])
    if np.all(free >= low) and np.all(free <= high):
        return free
    found = lsq_linear(A, b, bounds=(low, high), method="bvls", max_iter=20 * A.shape[1])
    return np.clip(found.x, low, high)
