"""K and M of a model as polynomials in the factors of its parameters, every coefficient a sparse matrix.

A large model is projected on its basis as often as its parameters are sampled where the projections are what the
coefficients are told from. Told from the entries themselves each is projected once, and on the rows alone that it
reaches; those of a small model are told from its projections (`reduction.py`).
"""

from __future__ import annotations

import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from femend.model.model import Model

__all__ = ["DEGREE", "SAMPLES", "FactorParts", "coefficients", "factor_parts", "sandwich"]

FloatArray = NDArray[np.float64]

# a parameter's stiffness is taken as a polynomial of this degree in its factor (a thickness enters with its cube)
DEGREE = 3
# factors at which it is computed for that
SAMPLES = (0.6, 1.0, 1.3, 1.6)
# share of an entry's largest sample below which a coefficient of it is rounding
ROUNDING = 1e-10
# rows whose products with a basis are held at once
AT_ONCE = 8192


@dataclass(frozen=True, eq=False)
class FactorParts:
    """K and M (n_a, n_a) at the deck's values, and of every parameter the coefficients of K and M over the powers 1 to
    `DEGREE` of its factor, those that are there; None where one of both has none."""

    K: csr_array
    M: csr_array
    powers: tuple[Mapping[int, tuple[csr_array | None, csr_array | None]], ...]


# of every model, since a diagnosis extends the basis of one again and again
_made: weakref.WeakKeyDictionary[Model, FactorParts] = weakref.WeakKeyDictionary()


def factor_parts(model: Model) -> FactorParts:
    """The parts of a model, made once.

    Exact for every property that enters as a polynomial (all but nu); nu is met at the factors used, which bracket any
    sensible prior.
    """
    known = _made.get(model)
    if known is None:
        # symmetric, so that their columns are their rows, by which products with a basis go
        K, M = (A.T for A in model.matrices())
        powers = tuple(_powers(model, p.name) for p in model.parameters)
        known = _made[model] = FactorParts(K, M, powers)
    return known


def _powers(model: Model, name: str) -> dict[int, tuple[csr_array | None, csr_array | None]]:
    """Coefficients of K and M over the powers of one parameter's factor."""
    sampled = [model.matrices({name: factor}) for factor in SAMPLES]
    K, M = (_told([pair[which] for pair in sampled]) for which in (0, 1))
    degrees = range(1, DEGREE + 1)
    return {n: (K[n], M[n]) for n in degrees if K[n] is not None or M[n] is not None}


def _told(sampled: Sequence[csc_array]) -> list[csr_array | None]:
    """Coefficients over powers 0 to `DEGREE` from matrices of one pattern at `SAMPLES`; None for those without any."""
    values = np.array([A.data for A in sampled])
    # what no factor reaches needs no coefficients
    moved = np.flatnonzero(np.ptp(values, axis=0) > 0)
    at, size = sampled[0].indices[moved], np.abs(values[:, moved]).max(axis=0)
    column = np.searchsorted(sampled[0].indptr, moved, side="right") - 1
    found: list[csr_array | None] = []
    for own in coefficients(values[:, moved]):
        kept = np.abs(own) > ROUNDING * size
        entries = (own[kept], (at[kept], column[kept]))
        found.append(csr_array(entries, shape=sampled[0].shape) if kept.any() else None)
    return found


def coefficients(sampled: FloatArray) -> list[FloatArray]:
    """Coefficients over powers 0 to `DEGREE` of a factor from the values `sampled` (4, ...) at `SAMPLES`."""
    inverse = np.linalg.inv(np.vander(np.array(SAMPLES), DEGREE + 1, increasing=True))
    return [np.asarray(np.tensordot(row, sampled, 1)) for row in inverse]


def sandwich(A: csr_array, V: FloatArray) -> FloatArray:
    """Vᵀ A V (r, r), symmetric as A (n, n) is, for a basis V (n, r); rows that A does not reach are left out."""
    reached = np.flatnonzero(np.diff(A.indptr))
    out = np.zeros((V.shape[1], V.shape[1]))
    for first in range(0, len(reached), AT_ONCE):
        rows = reached[first : first + AT_ONCE]
        out += V[rows].T @ (A[rows] @ V)
    return np.asarray(0.5 * (out + out.T))
