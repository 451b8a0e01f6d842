"""Lines of a record that tell something of their own about a model.

What a model leaves out of a resonance it leaves out on all lines of that resonance alike, so that a longer record,
whose lines are closer, says no more about it: lines that count each for itself would make of the same small error of a
model as many times the evidence as the record is longer. So of those closer than a small part of a resonance's width
only one is taken: the one that the recorded force excites most. Of lines without a recorded force it is the middle one;
the strongest response would be that of the noise where there is little else.

A record of many resonances over a wide band has thousands of such lines. Every fit takes as long as there are lines,
while what it leaves is the model's error long before it is the noise: they may then be further apart, as long as a few
are within each resonance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["spaced"]

FloatArray = NDArray[np.float64]

# lines that a resonance has within its width at half power, 2 zeta f, at most; and at least, where there are many
A_RESONANCE, AT_LEAST = 32, 8
# lines of a record from which on they are further apart than that
MANY = 3000


def spaced(index: NDArray[np.int64], freq: FloatArray, force: FloatArray | None, zeta: float) -> NDArray[np.int64]:
    """Of the lines `index` (K,) of an axis `freq` (Hz) those that stand for all: in every stretch that is as long as
    2 zeta f / 32 the one with the largest power of the `force` (of all lines of the axis), without one the middle one;
    all where they are further apart than half of that. Where more than `MANY` are left, the stretches are up to four
    times as long."""
    if len(index) < 2:
        return index
    width = 2 * zeta * freq[index] / np.gradient(freq[index])
    share = 1 / _together(width, A_RESONANCE)
    if share.sum() > MANY:
        within = max(A_RESONANCE * MANY / share.sum(), AT_LEAST)
        share = 1 / _together(width, within)
    if share.min() > 0.5:
        return index
    stretch = np.floor(np.cumsum(share) - share + 1e-9).astype(np.int64)
    if force is None:
        _, first, count = np.unique(stretch, return_index=True, return_counts=True)
        return index[first + count // 2]
    strongest_first = np.lexsort((-force[index], stretch))
    _, first = np.unique(stretch[strongest_first], return_index=True)
    return np.sort(index[strongest_first[first]])


def _together(width: FloatArray, within: float) -> FloatArray:
    """Lines that one stands for, where resonances are so many lines wide (K,) and have so many `within`."""
    return np.maximum(np.floor(width / within * (1 + 1e-9)), 1.0)
