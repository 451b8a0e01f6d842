"""Modes of a body that nothing holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["FREE", "RIGID", "elastic", "is_elastic"]

# modes of 0 Hz of a free body
FREE = 6
# share of the highest frequency below which one is of 0 Hz, up to round-off: a heavy lump on a light beam goes down to
# 1e-5
RIGID = 1e-6
# the same where a mode that moves is meant, and none of a part that hardly anything holds
LOW = 1e-3


def elastic(freq: NDArray[np.float64]) -> NDArray[np.float64]:
    """Those of the frequencies `freq` (n_modes,) that are not of 0 Hz, in their order."""
    return np.asarray(freq[freq > RIGID * freq.max(initial=0.0)])


def is_elastic(freq: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of the frequencies `freq` (n_modes,), circular ones or not, are a thousandth of the highest and more."""
    return np.asarray(freq > LOW * freq.max(initial=0.0))
