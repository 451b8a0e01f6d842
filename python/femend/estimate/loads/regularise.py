"""Least squares on many lines at once, regularised by the data: truncation or Tikhonov, by GCV or the L-curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.errors import LoadError

__all__ = ["CHOICES", "METHODS", "Regularised", "regularised_lines"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

METHODS = ("tikhonov", "truncation", "none")
CHOICES = ("gcv", "l-curve")

# Tikhonov's parameters that are tried, relative to the largest squared singular value of the line
TRIED = np.logspace(-14, 0, 57)


@dataclass(frozen=True, eq=False)
class Regularised:
    """Solutions of A x = b on every line: `x` (K, n), their covariance `C` (K, n, n) for b with unit deviation,
    `resolution` (K, n, n) with E x = resolution x_true, `condition` (K,) of A, `parameter` (K,) as chosen (Tikhonov:
    relative to the largest squared singular value; truncation: singular values kept), `freedom` (K,) values of b that
    the solution does not use, `squares` (K,) that it leaves of b."""

    x: ComplexArray
    C: ComplexArray
    resolution: ComplexArray
    condition: FloatArray
    parameter: FloatArray
    freedom: FloatArray
    squares: FloatArray


def regularised_lines(A: ComplexArray, b: ComplexArray, method: str = "tikhonov", choice: str = "gcv") -> Regularised:
    """Solves min |A x - b|^2 on every line, for `A` (K, m, n) and `b` (K, m) scaled to the same deviation everywhere.

    `method` "tikhonov" adds lambda |x|^2, "truncation" keeps the largest singular values, "none" keeps all. The amount
    is chosen line by line: `choice` "gcv" takes the least generalised cross validation (Golub, Heath and Wahba,
    Technometrics 21 (1979) 215-223), "l-curve" the corner of ln|x| over ln|A x - b|: for Tikhonov the largest curvature
    (Hansen and O'Leary, SIAM J. Sci. Comput. 14 (1993) 1487-1503), for truncation, whose curve is a few points, the
    least product of the two (Reginska, SIAM J. Sci. Comput. 17 (1996) 740-749). Where the true x is smooth the L-curve
    regularises less than would be best (Hanke, BIT 36 (1996) 287-301).

    Raises LoadError for another method or choice, fewer rows than columns, and for truncation with as many (what a full
    solution leaves is 0 then, and says nothing).

    >>> A = np.array([[[1.0], [1.0]]]) + 0j
    >>> complex(regularised_lines(A, np.array([[2.0 + 0j, 4.0]]), "none").x[0, 0].round(9))
    (3+0j)
    """
    m, n = A.shape[1:]
    _refuse(method, choice, m, n)
    U, sigma, Vh = np.linalg.svd(A, full_matrices=False)
    s = np.asarray(sigma, dtype=np.float64)
    beta = np.einsum("kmi,km->ki", U.conj(), b)
    power = np.abs(beta) ** 2
    outside = np.maximum((np.abs(b) ** 2).sum(axis=1) - power.sum(axis=1), 0.0)
    largest = np.where(s[:, 0] > 0, s[:, 0], 1.0)
    relative = s / largest[:, None]
    if method == "tikhonov":
        grid = relative[:, None, :] ** 2 / (relative[:, None, :] ** 2 + TRIED[:, None])
        at = _gcv(grid, power, outside, m) if choice == "gcv" else _corner(grid, power, outside, s)
        kept, parameter = grid[np.arange(len(s)), at], np.asarray(TRIED[at], dtype=np.float64)
    elif method == "truncation":
        grid = np.asarray(np.broadcast_to(np.tri(n), (len(s), n, n)), dtype=np.float64)
        at = _gcv(grid, power, outside, m) if choice == "gcv" else _least_product(grid, power, outside, s)
        kept, parameter = grid[np.arange(len(s)), at], np.asarray(at + 1.0, dtype=np.float64)
    else:
        kept, parameter = np.ones(s.shape), np.zeros(len(s))
    inverse = np.where(s > 0, kept / np.where(s > 0, s, 1.0), 0.0)
    V = Vh.conj().transpose(0, 2, 1)
    left = ((1 - kept) ** 2 * power).sum(axis=1) + outside
    with np.errstate(divide="ignore"):
        condition = np.where(s[:, -1] > 0, s[:, 0] / s[:, -1], np.inf)
    return Regularised(
        np.einsum("kji,ki->kj", V, inverse * beta),
        (V * (inverse**2)[:, None, :]) @ Vh,
        (V * kept[:, None, :]) @ Vh,
        condition,
        np.asarray(parameter, dtype=np.float64),
        m - kept.sum(axis=1),
        left,
    )


def _refuse(method: str, choice: str, m: int, n: int) -> None:
    if method not in METHODS or choice not in CHOICES:
        raise LoadError(
            f"method {method!r}, choice {choice!r}: the methods are {', '.join(METHODS)}, the choices "
            f"{', '.join(CHOICES)}"
        )
    if m < n:
        raise LoadError(
            f"{m} responses cannot tell {n} loads apart; use at least {n} responses, or leave loads out",
            n_responses=m,
            n_loads=n,
        )
    if method == "truncation" and m == n:
        raise LoadError(
            f"{m} responses for {n} loads leave nothing over that could choose a truncation; add a response, or use "
            "method 'tikhonov'",
            n_responses=m,
            n_loads=n,
        )


def _gcv(kept: FloatArray, power: FloatArray, outside: FloatArray, m: int) -> NDArray[np.int64]:
    """Positions (K,) in the grid `kept` (K, tried, n) of least |r|^2 / (m - sum kept)^2."""
    left = ((1 - kept) ** 2 * power[:, None, :]).sum(axis=2) + outside[:, None]
    free = np.maximum(m - kept.sum(axis=2), 1e-12)
    return np.asarray(np.argmin(left / free**2, axis=1))


def _norms(kept: FloatArray, power: FloatArray, outside: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """ln |r|^2 and ln |x|^2 (K, tried); what rounding leaves is no residual."""
    size = power.sum(axis=1) + outside
    left = ((1 - kept) ** 2 * power[:, None, :]).sum(axis=2) + outside[:, None] + 1e-24 * size[:, None] + 1e-300
    inverse = np.where(s > 0, 1.0 / np.where(s > 0, s, 1.0), 0.0)
    solution = ((kept * inverse[:, None, :]) ** 2 * power[:, None, :]).sum(axis=2) + 1e-300
    return np.log(left), np.log(solution)


def _corner(kept: FloatArray, power: FloatArray, outside: FloatArray, s: FloatArray) -> NDArray[np.int64]:
    """Positions (K,) of the largest curvature of (ln|r|, ln|x|) along the grid."""
    rho, eta = _norms(kept, power, outside, s)
    d_rho, d_eta = np.gradient(rho, axis=1), np.gradient(eta, axis=1)
    bend = d_rho * np.gradient(d_eta, axis=1) - d_eta * np.gradient(d_rho, axis=1)
    curvature = bend / np.maximum(d_rho**2 + d_eta**2, 1e-20) ** 1.5
    # where neither changes any more there is no curve
    moving = d_rho**2 + d_eta**2 > 1e-8
    curvature = np.where(moving, curvature, -np.inf)
    curvature[:, [0, -1]] = -np.inf
    best = np.argmax(curvature, axis=1)
    bends = curvature[np.arange(len(best)), best] > 0
    return np.asarray(np.where(bends, best, 0))


def _least_product(kept: FloatArray, power: FloatArray, outside: FloatArray, s: FloatArray) -> NDArray[np.int64]:
    rho, eta = _norms(kept, power, outside, s)
    return np.asarray(np.argmin(rho + eta, axis=1))
