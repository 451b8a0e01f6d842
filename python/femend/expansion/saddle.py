"""The quadratic form behind the expansion by least dynamic residual: one mode, one factor."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import ExpansionError
from femend.expansion._matrices import Solver, sparse

__all__ = ["DynamicResidual", "energy_norm"]

FloatArray = NDArray[np.float64]


class DynamicResidual:
    """J(u) = d^T N d / a + sum ((u[rows] - y) / sd)^2 with N d = Z u + g, for one mode.

    `norm` N and `Z` = K - omega^2 M (n, n) are sparse, `rows` (n_a,) measured with deviations `sd` (n_a,); `a` is the
    energy that the residual may have. Minimum by the symmetric indefinite system of both unknowns d and u. Raises
    ExpansionError where the sensors do not determine u.
    """

    def __init__(self, norm: Any, Z: Any, rows: NDArray[np.int64], sd: FloatArray, a: float) -> None:
        from scipy.sparse import block_array, csc_array

        self.rows, self.sd, self.a, self.n = rows, sd, a, Z.shape[0]
        self._size = float(norm.diagonal().max())
        weight = np.zeros(self.n)
        weight[rows] = a / sd**2
        at = np.arange(self.n)
        W = csc_array((weight, (at, at)), shape=Z.shape)
        saddle = csc_array(block_array([[-norm, Z], [Z, W]])) / self._size
        self._solve = Solver(saddle, "the sensors do not determine the shape: add some", indefinite=True)

    def minimum(self, g: FloatArray | None = None, y: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """d and u (n,) or (n, k) at the minimum, for forces `g` (n,) or (n, k) and measured `y` (n_a,), zero where not
        given."""
        shape = (2 * self.n, *g.shape[1:]) if g is not None else (2 * self.n,)
        load = np.zeros(shape)
        if g is not None:
            load[: self.n] = -g
        if y is not None:
            load[self.n + self.rows] = self.a * y / self.sd**2
        x = self._solve(load / self._size)
        return x[: self.n], x[self.n :]

    def deviation(self, at: NDArray[np.int64]) -> FloatArray:
        """Standard deviation (len(at),) of u at DOFs `at`: the root of the diagonal of the inverse of J's Hessian."""
        unit = np.zeros((2 * self.n, at.size))
        unit[self.n + at, np.arange(at.size)] = self.a / self._size
        return np.asarray(np.sqrt(np.maximum(self._solve(unit)[self.n + at, np.arange(at.size)], 0.0)))


def energy_norm(K: Any, M: Any) -> Any:
    """The norm of residuals: `K` (n, n), with a millionth of `M`'s share where the structure moves freely.

    Raises ExpansionError for a matrix that is not (n, n).
    """
    from scipy.sparse import csc_array

    k, m = sparse(K, "stiffness"), sparse(M, "mass")
    try:
        solve = Solver(k, "the structure is free")
        load = np.ones(k.shape[0])
        x = solve(load)
        if solve.inertia == 0 and np.isfinite(x).all() and np.abs(k @ x - load).max() < 1e-4:
            return k
    except ExpansionError:
        pass
    return csc_array(k + 1e-6 * k.diagonal().sum() / m.diagonal().sum() * m)
