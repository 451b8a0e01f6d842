"""Lines of a record that tell something of their own about a model.

What a model leaves out of a resonance it leaves out on all lines of that resonance alike, so that a longer record,
whose lines are closer, says no more about it: lines that count each for itself would make of the same small error of a
model as many times the evidence as the record is longer. So of those closer than a small part of a resonance's width
only one is taken: the one that the recorded force excites most. Of lines without a recorded force it is the middle one;
the strongest response would be that of the noise where there is little else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["spaced"]

FloatArray = NDArray[np.float64]

# lines that a resonance has within its width at half power, 2 zeta f, at most
A_RESONANCE = 32


def spaced(index: NDArray[np.int64], freq: FloatArray, force: FloatArray | None, zeta: float) -> NDArray[np.int64]:
    """Of the lines `index` (K,) of an axis `freq` (Hz) those that stand for all: in every stretch that is as long as
    2 zeta f / 32 the one with the largest power of the `force` (of all lines of the axis), without one the middle one;
    all where they are further apart than half of that."""
    if len(index) < 2:
        return index
    gaps = np.gradient(freq[index])
    together = np.maximum(np.floor(2 * zeta * freq[index] / A_RESONANCE / gaps * (1 + 1e-9)), 1.0)
    if together.max() < 2:
        return index
    stretch = np.floor(np.cumsum(1 / together) - 1 / together + 1e-9).astype(np.int64)
    if force is None:
        _, first, count = np.unique(stretch, return_index=True, return_counts=True)
        return index[first + count // 2]
    strongest_first = np.lexsort((-force[index], stretch))
    _, first = np.unique(stretch[strongest_first], return_index=True)
    return np.sort(index[strongest_first[first]])
