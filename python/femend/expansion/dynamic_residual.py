"""The quadratic form behind the expansion by least dynamic residual: one mode, one factor of its dynamic stiffness.

With Z = K - omega^2 M the least of d^T N d / a + |(S u - y) / sd|^2 over u, N d = Z u + g, is known from the answers
X = Z^-1 S^T at the sensors' DOFs alone, by the identity of Woodbury: d = a X c and u = Z^-1 (N d - g), where
(sd^2 + a X^T N X) c = y + S Z^-1 g. So the size of a model costs one factor of Z whatever sd and a are. A system of
both unknowns, d and u, which has zeros on its diagonal where no sensor is, could not be factored for shells.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import ExpansionError
from femend.expansion._matrices import Solver, sparse

__all__ = ["DynamicResidual", "DynamicStiffness", "energy_norm"]

FloatArray = NDArray[np.float64]

# at a frequency of the model Z has no inverse; it is taken so far beside it, relatively, which is nothing to a test
ASIDE = (0.0, 1e-6, -1e-6, 1e-5, -1e-5, 1e-4)
# the sensors' unit forces are answered as exactly as this, or Z is singular
EXACT = 1e-6


class DynamicStiffness:
    """Z = `K` - `omega2` `M` (n, n), factored, with its answers to unit forces at the DOFs `rows` (n_a,), and their
    squares in the `norm` N (n, n).

    Where `omega2` is a frequency of the model it is taken beside it, by a millionth or a little more. Raises
    ExpansionError where there is no answer all the same: a DOF has neither stiffness nor mass.
    """

    def __init__(self, norm: Any, K: Any, M: Any, omega2: float, rows: NDArray[np.int64]) -> None:
        self.norm, self.rows, self.n = norm, rows, K.shape[0]
        forces = np.zeros((self.n, rows.size))
        forces[rows, np.arange(rows.size)] = 1.0
        trouble = ""
        for aside in ASIDE:
            Z = K - omega2 * (1.0 + aside) * M
            try:
                solve = Solver(Z, "the model cannot be solved at a measured frequency", indefinite=True)
            except ExpansionError as error:
                trouble = str(error)
                continue
            answers = solve(forces)
            if np.isfinite(answers).all() and np.abs(Z @ answers - forces).max() < EXACT:
                self.solve, self.answers = solve, answers
                self.squares = answers.T @ np.asarray(norm @ answers)
                return
        raise ExpansionError(
            trouble or "the model has a frequency at a measured one, where its equations of motion tell nothing"
        )


class DynamicResidual:
    """J(u) = d^T N d / a + sum ((u[rows] - y) / sd)^2 with N d = Z u + g, for one mode.

    `stiffness` is Z with the norm N, at its rows are sensors with deviations `sd` (n_a,); `a` is the energy that the
    residual may have.
    """

    def __init__(self, stiffness: DynamicStiffness, sd: FloatArray, a: float) -> None:
        self.stiffness, self.sd, self.a = stiffness, sd, a
        squares = a * stiffness.squares / np.outer(sd, sd)
        self._values, self._vectors = np.linalg.eigh(0.5 * (squares + squares.T))

    def minimum(self, g: FloatArray | None = None, y: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """d and u (n,) or (n, k) at the minimum, for forces `g` (n,) or (n, k) and measured `y` (n_a,), zero where not
        given."""
        s = self.stiffness
        alone = np.zeros(s.n) if g is None else -s.solve(g)
        c = self._weighed((0.0 if y is None else y) - alone[s.rows])
        d = self.a * (s.answers @ c)
        return d, alone + s.solve(np.asarray(s.norm @ d))

    def deviation(self, at: NDArray[np.int64]) -> FloatArray:
        """Standard deviation (len(at),) of u at DOFs `at`: the root of the diagonal of the inverse of J's Hessian."""
        s = self.stiffness
        forces = np.zeros((s.n, at.size))
        forces[at, np.arange(at.size)] = 1.0
        own = s.solve(forces)
        moved = np.asarray(s.norm @ own)
        free = self.a * np.einsum("ni,ni->i", own, moved)
        seen = self.a * (s.answers.T @ moved)
        return np.asarray(np.sqrt(np.maximum(free - np.einsum("ai,ai->i", seen, self._weighed(seen)), 0.0)))

    def _weighed(self, x: FloatArray) -> FloatArray:
        """(sd^2 + a X^T N X)^-1 x for x (n_a,) or (n_a, k)."""
        sd = self.sd if x.ndim == 1 else self.sd[:, None]
        size = 1.0 + np.maximum(self._values, 0.0)
        inside = self._vectors.T @ (x / sd)
        return np.asarray((self._vectors @ (inside / (size if x.ndim == 1 else size[:, None]))) / sd)


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
