"""Bands: which frequencies lie in one."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["within_band"]


def within_band(freq: ArrayLike, band: tuple[float, float]) -> NDArray[np.bool_]:
    """Which of the frequencies `freq` (n_freq,) in Hz lie in `band`, (lower, upper) in Hz with both ends in it.

    >>> within_band([10.0, 20.0, 30.0], (10.0, 25.0)).tolist()
    [True, True, False]
    """
    f = np.asarray(freq, dtype=np.float64)
    low, high = band
    return np.asarray((f >= low) & (f <= high))
