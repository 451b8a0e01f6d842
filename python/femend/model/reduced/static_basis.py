"""Static answers of a structure, and vectors that join a basis with what they add to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.model.free_body import is_elastic
from femend.model.reduced.wider import Basis, onto

__all__ = ["LARGE", "Held", "added", "joined", "static_responses", "static_shift"]

FloatArray = NDArray[np.float64]

# vectors that leave less than this of their own length outside the span of the others add nothing
RANK_TOLERANCE = 1e-6
# share of what a vector would weigh with the heaviest DOF's mass everywhere below which it has none but by rounding
MASSLESS = 1e-7
# independent DOFs from which static responses are computed with the core's factorisation, projections are of sparse
# coefficients of the parameters' factors, and vectors join a basis some at a time, so many
LARGE, AT_ONCE = 5000, 16


def static_shift(omega: FloatArray) -> float:
    """The w at which (K + w M)⁻¹ answers as good as statically, regular for free structures too: well below the square
    of the first elastic of the circular frequencies `omega` (n,)."""
    elastic = omega[is_elastic(omega)]
    return float((0.1 * elastic.min()) ** 2) if elastic.size else 1.0


def joined(phi: FloatArray, static: FloatArray, M: Any, tolerance: float = RANK_TOLERANCE) -> FloatArray:
    """The M-orthonormal basis `phi` with what the columns of `static` add to it; nothing where less than `tolerance` of
    a column's own length lies outside, and nothing of columns without mass, which have no length."""
    # column by column, so that one stiff pattern does not hide a soft one; V is filled in place, since a copy of a
    # large basis for every column takes longer than the products
    V = np.empty((len(phi), phi.shape[1] + static.shape[1]), order="F")
    V[:, : phi.shape[1]] = phi
    n = phi.shape[1]
    if len(phi) >= LARGE:
        for first in range(0, static.shape[1], AT_ONCE):
            new = added(V[:, :n], static[:, first : first + AT_ONCE], M, tolerance)
            V[:, n : n + new.shape[1]] = new
            n += new.shape[1]
        return V[:, :n]
    for column, length in zip(static.T, _lengths(static, M), strict=True):
        if length == 0:
            continue
        vector = column.copy()
        for _ in range(2):
            vector = vector - V[:, :n] @ (V[:, :n].T @ (M @ vector))
        left = np.sqrt(max(vector @ (M @ vector), 0.0))
        if left > tolerance * length and left > 0:
            V[:, n] = vector / left
            n += 1
    return V[:, :n]


def added(phi: Basis, static: FloatArray, M: Any, tolerance: float = RANK_TOLERANCE) -> FloatArray:
    """What the columns of `static` add to the M-orthonormal basis `phi`, as `joined` has it, without the basis: few
    columns and a large basis, so that both are gone through for all columns at once."""
    size = _lengths(static, M)
    new = static * np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)
    for _ in range(2):
        # twice, since what is left of a column may be a millionth of it, and no more exact than that
        new = new - phi @ onto(phi, M @ new)
        new = new @ _independent(new.T @ (M @ new), tolerance)
        tolerance = 0.0
    return new


def _lengths(static: FloatArray, M: Any) -> FloatArray:
    """Lengths (m,) in M of columns (n, m); 0 of those that move what has no mass alone."""
    size = np.sqrt(np.maximum((static * (M @ static)).sum(axis=0), 0.0))
    heaviest = np.sqrt(max(float(np.max(M.diagonal(), initial=0.0)), 0.0))
    return np.asarray(np.where(size > MASSLESS * heaviest * np.linalg.norm(static, axis=0), size, 0.0))


def _independent(gram: FloatArray, tolerance: float) -> FloatArray:
    """Combinations (m, k) of vectors with products `gram` (m, m) that are orthonormal, of each vector and those before
    it; none for a vector of which at most `tolerance` lies outside."""
    C = np.zeros((len(gram), 0))
    for own in np.eye(len(gram)):
        for _ in range(2):
            own = own - C @ (C.T @ (gram @ own))
        left = np.sqrt(max(float(own @ gram @ own), 0.0))
        if left > tolerance and left > 0:
            C = np.column_stack([C, own / left])
    return C


def static_responses(A: Any, loads: FloatArray) -> FloatArray:
    """A⁻¹ times `loads` (n, m) for a sparse symmetric matrix (n, n)."""
    return Held.of(A).responses(loads)


@dataclass(frozen=True, eq=False)
class Held:
    """A stiffness `A` (n, n) that holds a structure, with its `factor`."""

    A: Any
    factor: Any

    @classmethod
    def of(cls, A: Any) -> Held:
        """A sparse symmetric matrix `A` (n, n), factorised."""
        if A.shape[0] < LARGE:
            from scipy.sparse.linalg import splu

            return cls(A, splu(A.tocsc()))
        # scipy orders for unsymmetric matrices: the factor of a large frame would outgrow the memory
        columns = A.tocsc()
        columns.sort_indices()
        indptr, indices = columns.indptr.astype(np.int64), columns.indices.astype(np.int64)
        return cls(A, _core.Factor(indptr, indices, columns.data))

    def responses(self, loads: FloatArray) -> FloatArray:
        """A⁻¹ times `loads` (n, m)."""
        return np.asarray(self.factor.solve(np.ascontiguousarray(loads)))
