"""Where a model's modes were checked against identified ones, and so where loads through it can be believed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["credible_lines"]

FloatArray = NDArray[np.float64]

# a mode of the model is right when it is no farther off than this in frequency (relative), and as like at least (MAC)
OFF, LIKE = 0.02, 0.8
# a wrong mode rules its neighbourhood, so many half-power bandwidths wide, and beyond as far as it is off; the highest
# checked mode answers for what lies above it up to this multiple
WIDE, ABOVE = 3.0, 1.15


def credible_lines(
    freq: FloatArray, identified: FloatArray, zeta: FloatArray, model: FloatArray, mac: FloatArray
) -> NDArray[np.bool_]:
    """Which lines `freq` (n_freq,) in Hz are credible, of a model whose modes `model` (m,) in Hz stand against
    `identified` (m,) ones with damping ratios `zeta` (m,) and likeness of shape `mac` (m,).

    Around a mode that is off by more than 2 % in frequency or less alike than MAC 0.8 loads repeat its error: within
    three half-power bandwidths (2 zeta f) of it nothing is credible, and of a mode that is alike and off in frequency
    nothing from there to the model's and as far beyond; nor is anything more than 15 % above the highest identified
    mode, since nobody looked. Below the lowest mode statics rules, which the modes above have checked. Without
    identified modes no line is credible.

    >>> f = np.array([5.0, 10.0, 20.0, 30.0])
    >>> z = np.full(2, 0.01)
    >>> credible_lines(f, np.array([10.0, 22.0]), z, np.array([11.0, 22.1]), np.ones(2)).tolist()
    [True, False, True, False]
    """
    if not len(identified):
        return np.zeros(len(freq), dtype=bool)
    wrong = (np.abs(model / identified - 1) > OFF) | (mac < LIKE)
    fine = freq <= ABOVE * float(identified.max())
    alike = np.where(mac < LIKE, identified, model)  # a mode that the model does not have is wrong where it is
    for f, z, own in zip(identified[wrong], zeta[wrong], alike[wrong], strict=True):
        reach = WIDE * 2 * z * f + abs(own - f)
        fine &= ~((freq >= min(f, own) - reach) & (freq <= max(f, own) + reach))
    return np.asarray(fine)
