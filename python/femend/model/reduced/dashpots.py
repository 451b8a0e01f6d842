"""The dashpots of a deck (CDAMPi, B of PBUSH, direct matrices) as rows of a reduced basis, each of 1 N s/m, with the
parameters that are factors on them."""

from __future__ import annotations

import weakref
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from femend.model.model import Model
from femend.model.parameter import is_of_damping
from femend.model.reduced.wider import Basis

__all__ = ["Dashpots", "damped_dofs", "dashpot_forces", "dashpot_owners", "dashpot_rows", "still_dashpots"]

FloatArray = NDArray[np.float64]

# rows kept at most, those that damp the modes most: each is a coordinate that laws are simulated beside
MOST = 6
# damping ratio that a row has to give to some mode to be kept
LEAST = 1e-5
# cards without which a deck has none
CARDS = ("CDAMP1", "CDAMP2", "CDAMP3", "CDAMP4", "CBUSH", "DMIG")
# dashpots up to which a basis holds what a force at each does
EXACT = 12
# DOFs up to which the matrix of a deck's dashpots is taken apart itself, and not as a small model has it
DENSE = 2000
# factor that leaves nothing of a dashpot, and what is left of one beside the largest
GONE, ROUNDING = 1e-12, 1e-10


class Dashpots(NamedTuple):
    """Dashpots of 1 N s/m: `rows` (n, r) of a basis, and `of` each the number of the parameter that is a factor on it,
    None where none is."""

    rows: FloatArray
    of: tuple[int | None, ...]


def dashpot_rows(model: Model, V: Basis, freq: FloatArray) -> Dashpots:
    """The dashpots of the deck in a basis `V` (n_g, r) whose Ritz frequencies are `freq` (r,) in Hz: the products of
    their rows add up to the viscous damping matrix. Of more than six the combinations that damp modes most are kept;
    what is left over is damping of single modes, whose ratios are unknowns anyway. Empty without dashpots.
    """
    # the first vectors are the modes of the deck: a row d gives a mode the damping ratio d^2 / (2 omega)
    omega = 2 * np.pi * np.maximum(freq, 1e-3 * freq[-1])
    found: list[tuple[float, FloatArray, int | None]] = []
    for of, (rows, C, L) in _taken_apart(model).items():
        D = _root(V[rows].T @ (C @ V[rows])).T if L is None else L.T @ V[rows]
        U, size, _ = np.linalg.svd(D / np.sqrt(2 * omega), full_matrices=False)
        found += [(s, row, of) for s, row in zip(size[:MOST] ** 2, U.T @ D, strict=False) if s > LEAST]
    kept = sorted(found, key=lambda one: -one[0])[:MOST]
    rows = np.array([row for _, row, _ in kept]).reshape(-1, V.shape[1])
    return Dashpots(np.ascontiguousarray(rows), tuple(of for *_, of in kept))


def damped_dofs(model: Model) -> NDArray[np.int64]:
    """Rows (k,) of the g-set, supports left aside, between which, or to ground, dashpots of the deck act."""
    return np.unique(np.concatenate([np.zeros(0, np.int64), *(rows for rows, _, _ in _taken_apart(model).values())]))


def still_dashpots(model: Model) -> NDArray[np.int64]:
    """Rows (k,) of the g-set, supports left aside, between which, or to ground, dashpots of the deck act that no
    parameter moves."""
    known = _taken_apart(model).get(None)
    return np.zeros(0, dtype=np.int64) if known is None else known[0]


def dashpot_owners(model: Model) -> set[int]:
    """Numbers of the parameters that are factors on dashpots of the deck."""
    return {of for of in _taken_apart(model) if of is not None}


def dashpot_forces(model: Model) -> FloatArray:
    """Forces (n_a, n) along the deck's dashpots, of which a basis holds the static answers; none of more than twelve
    dashpots, of which no single one is worth that."""
    T, made = model.transformation(), [np.zeros((model.fe.n_a, 0))]
    for rows, _, L in _taken_apart(model).values():
        if L is None:
            return made[0]
        made.append(np.asarray(T[rows].T @ (L / np.linalg.norm(L, axis=0))))
    forces = np.hstack(made)
    return forces if forces.shape[1] <= EXACT else made[0]


# DOFs (k,) of the g-set between which dashpots act, supports left aside, their matrix (k, k), and L (k, n) with
# C = L L^T where there are no more than `DENSE`
_Apart = tuple[NDArray[np.int64], Any, FloatArray | None]

# by the number of the parameter that is a factor on them, None for the others
_made: weakref.WeakKeyDictionary[Model, dict[int | None, _Apart]] = weakref.WeakKeyDictionary()


def _taken_apart(model: Model) -> dict[int | None, _Apart]:
    if model not in _made:
        _made[model] = _dashpots_of(model)
    return _made[model]


def _dashpots_of(model: Model) -> dict[int | None, _Apart]:
    # most decks have none, and a model without supports is made for the others alone
    if not set(model.deck.card_counts()) & set(CARDS) or not np.any(model.fe.assemble()[4]):
        return {}
    from scipy.sparse import csc_array

    free = model.unsupported
    found: dict[int | None, _Apart] = {}
    factors = np.ones(len(model.parameters))
    indptr, indices, _, _, left, _ = free.fe.assemble(factors)
    rounding = ROUNDING * np.abs(left).max()
    # what goes with a parameter, then with the next one of what it leaves, and what is left goes with none
    owners = [i for i, p in enumerate(model.parameters) if is_of_damping(p)]
    for of in (*owners, None):
        c = left
        if of is not None:
            factors[of] = GONE
            left = free.fe.assemble(factors)[4]
            c = c - left
        c = np.where(np.abs(c) > rounding, c, 0.0)
        if not np.any(c):
            continue
        C = csc_array((c, indices, indptr), shape=(free.fe.n_a, free.fe.n_a))
        C.eliminate_zeros()
        at = np.flatnonzero(np.diff(C.indptr))
        C = C[at][:, at]
        found[of] = (free.g_rows()[at], C, _root(C.toarray()) if at.size <= DENSE else None)
    return found


def _root(A: FloatArray) -> FloatArray:
    """L (n, m) with A = L L^T, m the rank of the semi-definite A (n, n)."""
    if not np.any(A):
        return np.zeros((len(A), 0))
    values, vectors = eigh(A)
    kept = values > 1e-12 * values[-1]
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))
