"""Stiffness of a region's elements in a basis: of thousands of elements together, made once for every basis."""

from __future__ import annotations

import weakref

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from femend.model import Model, Place, ReducedModel

__all__ = ["elements_stiffness", "region_stiffness"]

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
    whole = elements_stiffness(place, reduced.model)
    touched = np.flatnonzero(np.diff(whole.indptr))
    K = np.asarray(reduced.V[touched].T @ (whole[touched] @ reduced.V))
    _made[place] = (weakref.ref(reduced.V), K)
    return K


def elements_stiffness(place: Place, model: Model) -> csr_array:
    """Stiffness (n_g, n_g) of the place's elements at the deck's values."""
    fe = model.fe
    ones = np.ones(len(model.parameters))
    at: list[NDArray[np.int64]] = []
    values: list[FloatArray] = []
    for eid in place.elements:
        rows, K, _ = fe.element_matrices(eid, ones)
        at.append(np.array([np.repeat(rows, len(rows)), np.tile(rows, len(rows))]))
        values.append(np.asarray(K).ravel())
    shape = (fe.n_g, fe.n_g)
    return csr_array(coo_array((np.concatenate(values), np.hstack(at)), shape=shape))
