"""Quantities mistaken for each other: a displacement that is declared an acceleration has 1/omega^2 of its FRFs.

No unit does that, and no resonance elsewhere over a band of some width: the ratio to the model's goes with a power of
frequency, and comes to one with it taken out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["mistaken_quantity", "quantity_hint"]

FloatArray = NDArray[np.float64]

# lines from which a slope is told, and by how much (factor) their frequencies have to lie apart
FEWEST, WIDE = 24, 2.0
# how near a slope has to come to a power, and the ratio to one with the power taken out (factor)
NEAR, LEFT = 0.35, 3.0
# powers of omega in the ratio, and what is mistaken for what
_QUANTITIES = {
    -2: "displacements that are declared accelerations",
    -1: "velocities that are declared accelerations, or displacements that are declared velocities",
    1: "accelerations that are declared velocities, or velocities that are declared displacements",
    2: "accelerations that are declared displacements",
}


def mistaken_quantity(ratio: FloatArray, freq: FloatArray) -> int:
    """The power of omega that a `ratio` (n_freq, n) of measured FRFs to the model's has at `freq` (n_freq,) Hz, NaN
    where it is not known; 0 for none that a mistaken quantity gives.

    The slope is the median of those between lines of the lower and the upper half (Theil, 1950), which resonances do
    not bend.
    """
    known = np.isfinite(ratio).any(axis=1) & (freq > 0)
    if known.sum() < FEWEST or freq[known][-1] < WIDE * freq[known][0]:
        return 0
    y, x = np.nanmedian(np.log(ratio[known]), axis=1), np.log(2 * np.pi * freq[known])
    half = len(x) // 2
    slope = float(np.median((y[-half:] - y[:half]) / (x[-half:] - x[:half])))
    power = round(slope)
    if power not in _QUANTITIES or abs(slope - power) > NEAR:
        return 0
    return power if abs(float(np.median(y - power * x))) < np.log(LEFT) else 0


def quantity_hint(power: int) -> str:
    """What a ratio that goes with a `power` of omega, as of `mistaken_quantity`, comes of, and what to do."""
    by = f"times omega{'' if abs(power) == 1 else '²'}" if power > 0 else f"over omega{'' if abs(power) == 1 else '²'}"
    return f"{by}, as of {_QUANTITIES[power]}: correct the quantity of the channels, or the kind of the FRFs"
