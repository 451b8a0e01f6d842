"""What the modes of a model answer with on a record's lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["receptances"]


def receptances(
    omega: NDArray[np.float64], zeta: NDArray[np.float64], s: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Displacement of every mode to a modal force of one, (K, r), at lines `s` (K,) in rad/s.

    `omega` (r,) in rad/s and `zeta` (r,) are those of mass-normalised modes.

    >>> receptances(np.array([2.0]), np.array([0.0]), np.array([0j])).real
    array([[0.25]])
    """
    return 1 / (omega**2 + s[:, None] ** 2 + 2 * (zeta * omega) * s[:, None])
