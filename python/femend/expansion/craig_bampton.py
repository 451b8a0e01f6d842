"""Reduction to measured DOFs and modes with these held."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend import _core
from femend.errors import ExpansionError
from femend.expansion._matrices import measured_rows, others, same_size, sparse
from femend.expansion.reductions import Reduction, guyan

__all__ = ["craig_bampton"]

FloatArray = NDArray[np.float64]


def craig_bampton(K: Any, M: Any, rows: ArrayLike, n_fixed: int) -> Reduction:
    """Guyan's reduction with the lowest `n_fixed` modes of the structure with the measured DOFs held as coordinates.

    `K`, `M` (n, n), `rows` (n_a,): T = [static shapes, fixed-interface modes] (Craig and Bampton 1968, AIAA J. 6,
    1313-1319), (n, n_a + n_fixed). For measured shapes make a TAM of it with `hybrid`. Raises ExpansionError as
    `guyan`, and for more modes than there are DOFs left.
    """
    from scipy.sparse import csc_array

    k, m = sparse(K, "stiffness"), sparse(M, "mass")
    same_size(k, m)
    at = measured_rows(rows, k.shape[0])
    rest = others(at, k.shape[0])
    if not 1 <= n_fixed <= rest.size:
        raise ExpansionError(f"{n_fixed} modes with the measured DOFs held; there are {rest.size} DOFs left")
    static = guyan(k, at)
    k_o, m_o = csc_array(k[rest][:, rest]), csc_array(m[rest][:, rest])
    phi = _modes(k_o, m_o, n_fixed)
    T = np.zeros((k.shape[0], len(at) + n_fixed))
    T[:, : len(at)] = static.T
    T[rest, len(at) :] = phi
    return Reduction("Craig-Bampton", T, at, n_fixed)


def _modes(k: Any, m: Any, n_modes: int) -> FloatArray:
    """Lowest shapes (n, n_modes), mass-normalised, of sparse `k`, `m`, brought to one pattern."""
    from scipy.sparse import csc_array, eye_array

    n = k.shape[0]
    pattern = csc_array(abs(k) + abs(m) + eye_array(n))
    pattern.sort_indices()
    columns = np.repeat(np.arange(n), np.diff(pattern.indptr))
    on_k, on_m = (np.asarray(A.tocsr()[pattern.indices, columns], dtype=np.float64).ravel() for A in (k, m))
    _, phi, _, _ = _core.modes(pattern.indptr, pattern.indices, on_k, on_m, n_modes=n_modes)
    return np.asarray(phi)
