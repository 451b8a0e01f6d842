"""The dashpots of a deck (CDAMPi, B of PBUSH, direct matrices) as rows of a reduced basis, each of 1 N s/m."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from femend.model.model import Model
from femend.model.wider import Basis

__all__ = ["dashpot_dofs", "dashpot_forces", "dashpot_rows"]

FloatArray = NDArray[np.float64]

# rows kept at most, those that damp the modes most: each is a coordinate that laws are simulated beside
MOST = 4
# damping ratio that a row has to give to some mode to be kept
LEAST = 1e-5
# cards without which a deck has none
CARDS = ("CDAMP1", "CDAMP2", "CDAMP3", "CDAMP4", "CBUSH", "DMIG")
# dashpots up to which a basis holds what a force at each does
EXACT = 12
# DOFs up to which the matrix of a deck's dashpots is taken apart itself, and not as a small model has it
DENSE = 2000


def dashpot_rows(model: Model, V: Basis, freq: FloatArray) -> FloatArray:
    """Rows (n, r) of a basis `V` (n_g, r) whose Ritz frequencies are `freq` (r,) in Hz; their products add up to the
    viscous damping matrix of the deck in it. Of more than four the combinations that damp modes most are kept; what is
    left over is damping of single modes, whose ratios are unknowns anyway. Empty without dashpots.
    """
    rows, C, L = _taken_apart(model)
    if not rows.size:
        return np.zeros((0, V.shape[1]))
    D = _root(V[rows].T @ (C @ V[rows])).T if L is None else L.T @ V[rows]
    # the first vectors are the modes of the deck: a row d gives a mode the damping ratio d^2 / (2 omega)
    omega = 2 * np.pi * np.maximum(freq, 1e-3 * freq[-1])
    U, size, _ = np.linalg.svd(D / np.sqrt(2 * omega), full_matrices=False)
    kept = size[:MOST] ** 2 > LEAST
    return np.ascontiguousarray(U[:, :MOST][:, kept].T @ D)


def dashpot_dofs(model: Model) -> NDArray[np.int64]:
    """Rows (k,) of the g-set, supports left aside, between which, or to ground, the deck's dashpots act."""
    return _taken_apart(model)[0]


def dashpot_forces(model: Model) -> FloatArray:
    """Forces (n_a, n) along the deck's dashpots, of which a basis holds the static answers; none of more than twelve
    dashpots, of which no single one is worth that."""
    rows, _, L = _taken_apart(model)
    if L is None or not rows.size or L.shape[1] > EXACT:
        return np.zeros((model.fe.n_a, 0))
    return np.asarray(model.transformation()[rows].T @ (L / np.linalg.norm(L, axis=0)))


# DOFs (k,) of the g-set between which dashpots act, supports left aside, their matrix (k, k), and L (k, n) with
# C = L L^T where there are no more than `DENSE`
_Apart = tuple[NDArray[np.int64], Any, FloatArray | None]

_made: weakref.WeakKeyDictionary[Model, _Apart] = weakref.WeakKeyDictionary()


def _taken_apart(model: Model) -> _Apart:
    if model not in _made:
        _made[model] = _dashpots_of(model)
    return _made[model]


def _dashpots_of(model: Model) -> _Apart:
    from scipy.sparse import csc_array

    # most decks have none, and a model without supports is made for the others alone
    if not set(model.deck.card_counts()) & set(CARDS) or not np.any(model.fe.assemble()[4]):
        return np.zeros(0, dtype=np.int64), csc_array((0, 0)), np.zeros((0, 0))
    free = model.unsupported
    indptr, indices, _, _, c, _ = free.fe.assemble()
    C = csc_array((c, indices, indptr), shape=(free.fe.n_a, free.fe.n_a))
    C.eliminate_zeros()
    at = np.flatnonzero(np.diff(C.indptr))
    C = C[at][:, at]
    return free.g_rows()[at], C, _root(C.toarray()) if at.size <= DENSE else None


def _root(A: FloatArray) -> FloatArray:
    """L (n, m) with A = L L^T, m the rank of the semi-definite A (n, n)."""
    if not np.any(A):
        return np.zeros((len(A), 0))
    values, vectors = eigh(A)
    kept = values > 1e-12 * values[-1]
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))
