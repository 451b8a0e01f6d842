"""Stiffness of a region's elements, or of a bedding, in a basis: of thousands together, made once for every basis."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from femend.model import Model, Place, ReducedModel
from femend.model.reduced.static_basis import LARGE

__all__ = ["elements_stiffness", "prepare_regions", "region_stiffness"]

FloatArray = NDArray[np.float64]

# of every place, the basis it was made in last and what came out
_made: weakref.WeakKeyDictionary[Place, tuple[weakref.ReferenceType[Any], FloatArray]] = weakref.WeakKeyDictionary()


def region_stiffness(place: Place, reduced: ReducedModel) -> FloatArray:
    """Stiffness (r, r) of the place's elements in the basis of `reduced`, at the deck's values."""
    if _is_made(place, reduced):
        return _made[place][1]
    K = _in_basis(elements_stiffness(place, reduced.model), reduced)
    _made[place] = (weakref.ref(reduced.V), K)
    return K


def prepare_regions(places: Sequence[Place], reduced: ReducedModel) -> None:
    """Makes the stiffness of many regions of a large model in its basis together: regions overlap, and each cell that
    lies in the same of them is projected once, where every region by itself projects its elements as often as there are
    regions around them. Small models, and places that are known already, are left to `region_stiffness`."""
    todo = [p for p in places if p.kind == "region" and not _is_made(p, reduced)]
    if reduced.model.fe.n_a < LARGE or len(todo) < 2:
        return
    inside: dict[int, list[int]] = {}
    for i, place in enumerate(todo):
        for eid in place.elements:
            inside.setdefault(eid, []).append(i)
    cells: dict[tuple[int, ...], list[int]] = {}
    for eid, where in inside.items():
        cells.setdefault(tuple(where), []).append(eid)
    K = np.zeros((len(todo), reduced.r, reduced.r))
    for of, elements in cells.items():
        K[list(of)] += _in_basis(_assembled(elements, reduced.model), reduced)
    for place, own in zip(todo, K, strict=True):
        _made[place] = (weakref.ref(reduced.V), own)


def _is_made(place: Place, reduced: ReducedModel) -> bool:
    known = _made.get(place)
    return known is not None and known[0]() is reduced.V


def _in_basis(whole: csr_array, reduced: ReducedModel) -> FloatArray:
    touched = np.flatnonzero(np.diff(whole.indptr))
    V = reduced.V[touched]
    return np.asarray(V.T @ (whole[touched][:, touched] @ V))


def elements_stiffness(place: Place, model: Model) -> csr_array:
    """Stiffness (n_g, n_g) of the place's elements at the deck's values, or of its bedding."""
    if place.bed:
        rows, values = [g for _, g, _ in place.bed], [x for _, _, x in place.bed]
        start = np.cumsum([0, *(len(g) for g in rows)])
        B = csr_array((np.hstack(values), np.hstack(rows), start), shape=(len(place.bed), model.fe.n_g))
        return csr_array(B.T @ B)
    return _assembled(place.elements, model)


def _assembled(elements: Sequence[int], model: Model) -> csr_array:
    fe = model.fe
    ones = np.ones(len(model.parameters))
    at: list[NDArray[np.int64]] = []
    values: list[FloatArray] = []
    for eid in elements:
        rows, K, _ = fe.element_matrices(eid, ones)
        at.append(np.array([np.repeat(rows, len(rows)), np.tile(rows, len(rows))]))
        values.append(np.asarray(K).ravel())
    shape = (fe.n_g, fe.n_g)
    return csr_array(coo_array((np.concatenate(values), np.hstack(at)), shape=shape))
