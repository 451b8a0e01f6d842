"""Sparse matrices on one pattern, as the core takes them: a sum of SciPy's leaves out entries that are zero."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["on_one_pattern"]


def on_one_pattern(matrices: Sequence[csc_array]) -> tuple[NDArray[Any], NDArray[Any], list[NDArray[np.float64]]]:
    """indptr, indices of the union of the patterns (symmetric, with the diagonal), and the values of each on it."""
    from scipy.sparse import csc_array, eye_array

    first = matrices[0]
    same = all(np.array_equal(a.indptr, first.indptr) and np.array_equal(a.indices, first.indices) for a in matrices)
    if same and first.has_sorted_indices:
        full = csc_array((np.ones(first.nnz), first.indices, first.indptr), shape=first.shape)
        if full.diagonal().all() and (full - full.T).nnz == 0:
            return first.indptr, first.indices, [np.asarray(a.data, dtype=np.float64) for a in matrices]
    n = first.shape[0]
    union = csc_array(eye_array(n, format="csc"))
    for a in matrices:
        ones = csc_array((np.ones(a.nnz), a.indices, a.indptr), shape=a.shape)
        union = csc_array(union + ones + ones.T)
    union.sort_indices()
    values = []
    for a in matrices:
        # the union holds every entry, so adding a zero of its pattern leaves its order
        zero = csc_array((np.zeros(union.nnz), union.indices, union.indptr), shape=union.shape)
        values.append(_values_on(zero, csc_array(a)))
    return union.indptr, union.indices, values


def _values_on(zero: csc_array, a: csc_array) -> NDArray[np.float64]:
    """Values of `a` in the order of the pattern of `zero`."""
    a = a.copy()
    a.sum_duplicates()
    n = a.shape[0]
    columns = np.repeat(np.arange(n), np.diff(zero.indptr))
    place = columns * n + zero.indices
    own = np.repeat(np.arange(n), np.diff(a.indptr)) * n + a.indices
    out = np.zeros(zero.nnz)
    out[np.searchsorted(place, own)] = a.data
    return out
