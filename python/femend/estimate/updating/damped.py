"""Damping of a system's matrices: what a deck has itself, proportional damping and a loss factor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.estimate.updating.matrices import DeckMatrices, Matrices
from femend.estimate.updating.morphed import MorphedMatrices
from femend.estimate.updating.requests import damping_matrix

__all__ = ["damping_of", "damping_slopes_of"]

FloatArray = NDArray[np.float64]


def damping_of(matrices: Matrices, K: FloatArray, M: FloatArray, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """C and H (nnz,) at `factors` (n_parameters + 3,), those of alpha, beta and eta last, with `K`, `M` (nnz,)
    there."""
    n = len(matrices.names)
    C, H = damping_matrix(K, M, factors[n:])
    if isinstance(matrices, (DeckMatrices, MorphedMatrices)):
        own = matrices.damping(factors[:n])
        C, H = C + own[0], H + own[1]
    return C, H


def damping_slopes_of(
    matrices: Matrices, K: FloatArray, M: FloatArray, dK: FloatArray, dM: FloatArray, factors: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """d C and d H (n_parameters + 3, nnz) at `factors` (n_parameters + 3,), those with respect to alpha, beta and eta
    last, from `K`, `M` (nnz,) and `dK`, `dM` (n_parameters, nnz)."""
    n = len(matrices.names)
    alpha, beta, eta = factors[n:]
    dC, dH = alpha * dM + beta * dK, eta * dK
    if isinstance(matrices, (DeckMatrices, MorphedMatrices)):
        own = matrices.damping_slopes(factors[:n])
        dC, dH = dC + own[0], dH + own[1]
    zero = np.zeros_like(K)
    return np.vstack([dC, M, K, zero]), np.vstack([dH, zero, zero, K])
