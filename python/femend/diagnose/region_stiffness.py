"""Stiffness of a region's elements in a basis: of thousands of elements together, made once for every basis."""

from __future__ import annotations

import weakref

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from femend.model import Place, ReducedModel

__all__ = ["region_stiffness"]

FloatArray = NDArray[np.float64]

# of every place, the basis it was made in last and what came out
_made: weakref.WeakKeyDictionary[Place, tuple[weakref.ReferenceType[FloatArray], FloatArray]] = (
    weakref.WeakKeyDictionary()
)


def region_stiffness(place: Place, reduced: ReducedModel) -> FloatArray:
    """Stiffness (r, r) of the place's elements in the basis of `reduced`, at the deck's values."""
    known = _made.get(place)
    if known is not None and known[0]() is reduced.V:
        return known[1]
    fe = reduced.model.fe
    ones = np.ones(len(reduced.model.parameters))
    at: list[NDArray[np.int64]] = []
    values: list[FloatArray] = []
    for eid in place.elements:
        rows, K, _ = fe.element_matrices(eid, ones)
        at.append(np.array([np.repeat(rows, len(rows)), np.tile(rows, len(rows))]))
        values.append(np.asarray(K).ravel())
    n = len(reduced.V)
    whole = csr_array(coo_array((np.concatenate(values), np.hstack(at)), shape=(n, n)))
    touched = np.flatnonzero(np.diff(whole.indptr))
    K = np.asarray(reduced.V[touched].T @ (whole[touched] @ reduced.V))
    _made[place] = (weakref.ref(reduced.V), K)
    return K
