"""The stretch of a band in which a modal model holds, where it misses modes of the whole."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femend.modal.parts import FEWEST_LINES, misses, octaves

if TYPE_CHECKING:
    from femend.modal.result import ModalTest

__all__ = ["held_band"]


def held_band(test: ModalTest) -> tuple[float, float] | None:
    """The neighbouring octaves of the band of `test` that its modes explain, (low, high) in Hz: of several stretches
    that with most modes. None where the modes miss every octave, or none.

    An octave is missed as the whole is (`misses`); the scatter from line to line is taken to be even over the band.
    """
    freq, H = test.measured.freq, test.measured.H
    left = np.sum(np.abs(H - test.resynthesised.H) ** 2, axis=(1, 2))
    size = np.sum(np.abs(H) ** 2, axis=(1, 2))
    scatter = test.noise_share**2 * float(size.sum()) / freq.size
    stretches: list[tuple[int, int]] = []
    whole = True
    for low, high in octaves(freq, FEWEST_LINES):
        if misses(float(left[low:high].sum()), float(size[low:high].sum()), scatter * (high - low)):
            whole = False
        elif stretches and stretches[-1][1] == low:
            stretches[-1] = (stretches[-1][0], high)
        else:
            stretches.append((low, high))
    ends = [(float(freq[a]), float(freq[b - 1])) for a, b in stretches]
    n_modes = [int(np.count_nonzero((test.modes.freq >= a) & (test.modes.freq <= b))) for a, b in ends]
    if whole or not any(n_modes):
        return None
    return ends[int(np.argmax(n_modes))]
