"""Standard deviations from leaving groups of the recording out, for methods without cheap derivatives.

Delete-a-group jackknife: var = (G - 1) / G sum_g (theta_g - mean)^2 (Efron and Tibshirani, An Introduction to the
Bootstrap (1993), chapter 11, with groups in place of single observations).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["N_GROUPS", "jackknife_sd", "leave_out_means", "pole_sd", "shape_sd"]

N_GROUPS = 20


def leave_out_means(blocks: NDArray, n_groups: int = N_GROUPS) -> list[NDArray]:
    """Means over `blocks` (n_b, ...) with one of `n_groups` stretches of neighbouring blocks left out at a time."""
    groups = np.array_split(np.arange(blocks.shape[0]), min(n_groups, blocks.shape[0]))
    total = blocks.sum(axis=0)
    return [(total - blocks[g].sum(axis=0)) / (blocks.shape[0] - g.size) for g in groups]


def jackknife_sd(replicates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard deviation of an estimate from its `replicates` (G, ...), each without one group.

    >>> float(jackknife_sd(np.array([1.0, 2.0, 3.0])).round(4))
    1.1547
    """
    n = replicates.shape[0]
    return np.sqrt((n - 1) / n * ((replicates - replicates.mean(axis=0)) ** 2).sum(axis=0))


def pole_sd(replicates: NDArray[np.complex128]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Deviations of frequency (Hz) and damping of poles from their `replicates` (G, p) in rad/s."""
    size = np.abs(replicates)
    return jackknife_sd(size) / (2 * np.pi), jackknife_sd(-replicates.real / size)


def shape_sd(replicates: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Deviations (n_ch, p) of shapes with largest component 1 from `replicates` (G, n_ch, p)."""
    return np.hypot(jackknife_sd(replicates.real), jackknife_sd(replicates.imag))
