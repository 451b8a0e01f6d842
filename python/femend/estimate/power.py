"""What a record's power says of its force: where it is, and what of it may be noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["PASSED", "holds_power", "may_be_noise", "smoothed"]

FloatArray = NDArray[np.float64]

# width, in lines, over which a recording's power is smoothed
SMOOTH = 9
# share of a force's power below its band and up to its end
LOWER, UPPER = 0.005, 0.99
# parts of the lines of which the one with the least power is taken for noise
PARTS = 16
# recorders pass what lies below this multiple of their rate unchanged
PASSED = 0.42


def smoothed(power: FloatArray) -> FloatArray:
    """Running mean of the power (n, K) over `SMOOTH` lines."""
    kernel = np.ones(SMOOTH) / SMOOTH
    padded = np.pad(power, ((0, 0), (SMOOTH // 2, SMOOTH // 2)), "reflect")
    return np.array([np.convolve(p, kernel, "valid") for p in padded])


def holds_power(u: FloatArray, dt: float) -> tuple[float, float]:
    """Frequencies (Hz) between which the forces u (n_in, n) sampled at `dt` have all but half a per cent of their power
    at the low end and one at the top; 0 both of no force."""
    freq = np.fft.rfftfreq(u.shape[1], dt)
    share = np.cumsum(_power(u))
    if share[-1] == 0:
        return 0.0, 0.0
    begin, end = (float(freq[np.searchsorted(share, part * share[-1])]) for part in (LOWER, UPPER))
    return begin, end


def may_be_noise(u: FloatArray, dt: float) -> FloatArray:
    """Share (n // 2 + 1,) of the power of forces u (n_in, n) that may be their transducers' noise, 1 at most.

    The noise is no more than the least power, as a mean over a part of the lines, below what recorders cut off. Where
    the force itself has hardly less anywhere, the shares come out too large.
    """
    freq, power = np.fft.rfftfreq(u.shape[1], dt), _power(u)
    passed = power[freq <= PASSED / dt]
    floor = min(part.mean() for part in np.array_split(passed, min(PARTS, len(passed))))
    return np.minimum(floor / np.maximum(smoothed(power[None])[0], 1e-300), 1.0)


def _power(u: FloatArray) -> FloatArray:
    """Power (n // 2 + 1,) of forces u (n_in, n), all together."""
    return np.asarray((np.abs(np.fft.rfft(u, axis=1)) ** 2).sum(axis=0))
