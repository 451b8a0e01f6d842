"""The recorder: every channel passes the same linear-phase filter before it is sampled, so that nothing is folded back.

What a law excites above half the sampling rate (friction, impacts) would otherwise stand in the band as if the
structure had moved so there, which the converters of today's recorders prevent.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import firwin, upfirdn

FINER = 4  # times the sampling rate at which the truth is looked at; its modes end at three times the rate
PASS, STOP = 0.42, 0.52  # of the sampling rate: flat up to the one, 80 dB down from the other
# Kaiser 1974: 209 taps and beta 7.86 for a transition of a fortieth of the finer rate at 80 dB
TAPS = firwin(2 * 26 * FINER + 1, (PASS + STOP) / 2, window=("kaiser", 7.86), fs=FINER)
AFTER = len(TAPS) // (2 * FINER)  # samples beyond the end that the filter looks at


def sampled(fine: np.ndarray, n: int, filtered: bool = True) -> np.ndarray:
    """Channels (..., FINER * (n + AFTER)) from rest at the first sample, filtered without delay: (..., n).

    Samples that are not `filtered` are picked as they come.
    """
    if not filtered:
        return fine[..., : FINER * n : FINER]
    return upfirdn(TAPS, fine, down=FINER, axis=-1)[..., AFTER : AFTER + n]
