"""Checks, splitting and solving that all reductions share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend import _core
from femend.errors import ExpansionError, FemendError

__all__: list[str] = []

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def sparse(A: Any, what: str) -> Any:
    """`A` (n, n), dense or sparse, as compressed columns with sorted rows and its whole diagonal in the pattern."""
    from scipy.sparse import csc_array, issparse

    given: Any = A if issparse(A) else np.asarray(A, dtype=np.float64)
    out = csc_array(given)
    if out.ndim != 2 or out.shape[0] != out.shape[1] or out.shape[0] == 0:
        raise ExpansionError(f"the {what} matrix has shape {out.shape}; it is (n, n)")
    if not np.isfinite(out.data).all():
        raise ExpansionError(f"the {what} matrix has values that are not finite")
    return out.astype(np.float64)


def same_size(K: Any, M: Any) -> None:
    """Raises ExpansionError unless `K` and `M` are of one model."""
    if K.shape != M.shape:
        raise ExpansionError(f"stiffness {K.shape} and mass {M.shape} are not of one model")


def measured_rows(rows: ArrayLike, n: int) -> IntArray:
    """DOF numbers of the sensors; raises ExpansionError for none, repeated ones or ones beyond `n`."""
    at = np.asarray(rows, dtype=np.int64).ravel()
    if at.size == 0:
        raise ExpansionError("no measured DOF is given; name the rows of the model that sensors are at")
    wrong = at[(at < 0) | (at >= n)]
    if wrong.size:
        raise ExpansionError(f"row {int(wrong[0])} is none of the model, which has {n}, from 0 to {n - 1}; correct it")
    if len(np.unique(at)) != at.size:
        raise ExpansionError(f"{at.size - len(np.unique(at))} measured DOFs stand twice; average or leave out sensors")
    return at


def others(rows: IntArray, n: int) -> IntArray:
    """The DOFs that are not measured."""
    mask = np.ones(n, dtype=bool)
    mask[rows] = False
    return np.flatnonzero(mask).astype(np.int64)


class Solver:
    """Solutions with a sparse symmetric matrix `A`; raises ExpansionError saying `advice` where it is singular."""

    def __init__(self, A: Any, advice: str, indefinite: bool = False) -> None:
        from scipy.sparse import coo_array, csc_array

        entries, own = coo_array(A), np.arange(A.shape[0])
        # the factor wants the whole diagonal in the pattern: zeros are written there, and stay
        data = np.concatenate([entries.data, np.zeros(own.size)])
        places = (np.concatenate([entries.row, own]), np.concatenate([entries.col, own]))
        pattern = csc_array(coo_array((data, places), shape=A.shape))
        pattern.sort_indices()
        try:
            self._factor = _core.Factor(
                pattern.indptr, pattern.indices, pattern.data, indefinite=True if indefinite else None
            )
        except (FemendError, ValueError, ArithmeticError) as error:
            raise ExpansionError(f"{advice} ({error})") from error
        self.inertia = self._factor.inertia

    def __call__(self, b: Any) -> FloatArray:
        full = np.asarray(b.toarray() if hasattr(b, "toarray") else b, dtype=np.float64)
        x = self._factor.solve(np.ascontiguousarray(full.reshape(full.shape[0], -1)))
        return np.asarray(x).reshape(full.shape)


def sensor_shapes(phi: ArrayLike, n_rows: int) -> NDArray[Any]:
    """Shapes (n_rows, n_modes); one vector becomes one column. Raises ExpansionError for others."""
    x = np.asarray(phi)
    x = x[:, None] if x.ndim == 1 else x
    if x.ndim != 2 or x.shape[0] != n_rows or x.shape[1] == 0:
        raise ExpansionError(f"measured shapes {x.shape} for {n_rows} sensors; they are (n_sensors, n_modes)")
    if not np.isfinite(x).all():
        raise ExpansionError("a measured shape has values that are not finite; leave that sensor out")
    return x
