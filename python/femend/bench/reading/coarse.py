"""Modes that are narrower than the lines of the FRFs they were identified from can show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, IdentifiedModes, TimeData
from femend.numerals import plain
from femend.signal.impact import RUNG_OUT
from femend.signal.suited import BLOCK, blow_block, blows

__all__ = ["FEWEST_PIECES", "longer_pieces", "too_coarse"]

FloatArray = NDArray[np.float64]

# lines aside of a mode's that show what else there is, first and last: Hann's own peak ends at the second
ASIDE = (3, 8)
# what a response that does not decay is taken to be left with
UNDAMPED = 0.99
# lines that the half-power width of a resonance has to span: Hann's own is 1.44, and of less than twice that what is
# seen is the window as much as the structure
SPAN = 3.0
# pieces that are averaged at least for every force where eight are too short (tests/blind/identified_modes.py says what
# comes of it)
FEWEST_PIECES = 3


def longer_pieces(modes: IdentifiedModes, data: TimeData, frf: FRF, zeta: float) -> float | None:
    """Distance (Hz) of the lines of FRFs from longer pieces of the record `data`, where some of the `modes` are, or
    with the damping ratio `zeta` would be, narrower than those of `frf` show; None where they are not, or pieces are as
    few as they may be.

    What lines too far apart leave out of a resonance no averaging brings back (Bendat and Piersol, Random Data, 4th
    ed., ch. 8.5: a peak of width B_r is too low by (B_e/B_r)^2/3), where the noise of few averages is averaged once
    more by the fit over lines and sensors.
    """
    step, fewest = float(frf.freq[1] - frf.freq[0]), FEWEST_PIECES * len(frf.inputs)
    # of lines too far apart a mode looks wider than it is
    width = 2 * modes.freq * np.minimum(np.abs(modes.zeta), zeta)
    if not (width < SPAN * step).any() or data.duration * step < 1.5 * fewest:
        return None
    return fewest / data.duration


def too_coarse(modes: IdentifiedModes, data: TimeData, frf: FRF) -> list[str]:
    """A sentence about `modes` whose resonances are hardly wider than the lines of `frf`, which was averaged from
    pieces of the record `data`: such peaks look wider, so damping comes out too high, and frequencies are off.

    Their stated deviations are of the fit to the FRF and hold nothing of it. A blow's answer that has died away within
    its piece is whole: its spectrum is the structure's on every line, however far apart these are (ISO 7626-5), and
    nothing is said of it.
    """
    step = float(frf.freq[1] - frf.freq[0])
    width = 2 * np.abs(modes.zeta) * modes.freq
    narrow = np.flatnonzero(width < SPAN * step)
    at = blows(data)
    if narrow.size and at.size and abs(1 / step - blow_block(data, at)) <= data.dt:
        return _cut_off(modes, narrow, data, at, step)
    if not narrow.size:
        return []
    i = int(narrow[np.argmin(width[narrow])])
    n_pieces = data.duration * step
    which = ", ".join(str(k + 1) for k in narrow)
    needed = n_pieces * SPAN / float(width[i])
    return [
        f"mode{'s' * (narrow.size > 1)} {which}: the resonance at {plain(modes.freq[i])} Hz is {plain(width[i], 2)} Hz "
        f"wide at most, and lines of FRFs averaged over pieces of {plain(1 / step, 3)} s are {plain(step, 3)} Hz "
        "apart: damping comes out too high, the frequency may be off by a line, and the deviations hold nothing of it; "
        f"record {plain(needed, 2)} s or more, or give FRFs of your own"
    ]


def _cut_off(
    modes: IdentifiedModes, narrow: NDArray[np.int64], data: TimeData, at: FloatArray, step: float
) -> list[str]:
    """A sentence about those of the `narrow` modes that still ring at the end of the pieces after blows at times `at`
    (n,) in s, as long as lines `step` Hz apart ask for, and whose damping is off by it."""
    left = np.array([still_rings(data, at, 1 / step, float(f)) for f in modes.freq[narrow]])
    decays = -np.log(np.maximum(left, 1e-300)) * step / (2 * np.pi * modes.freq[narrow])
    # what is left at the end is about what the damping is off by; of less nothing is said
    off = (left > RUNG_OUT) & (np.abs(modes.zeta[narrow] / decays - 1) > RUNG_OUT)
    if not off.any():
        return []
    worst = int(np.argmax(np.where(off, left, 0.0)))
    i, r = int(narrow[worst]), float(left[worst])
    needed = np.log(RUNG_OUT) / np.log(r) / (step * BLOCK)
    which = ", ".join(str(k + 1) for k in narrow[off])
    decay, found = plain(100 * decays[worst], 2), plain(100 * modes.zeta[i], 2)
    return [
        f"mode{'s' * (int(off.sum()) > 1)} {which}: the response at {plain(modes.freq[i])} Hz still has "
        f"{plain(100 * r, 2)} % of its size at the end of the pieces of {plain(1 / step, 3)} s that are taken of each "
        f"blow: with that cut off {found} % of damping was found, where the decay within a piece is that of {decay} %, "
        f"and the deviations hold nothing of it; leave {plain(needed, 2)} s or more between blows"
    ]


def still_rings(data: TimeData, at: FloatArray, piece: float, freq: float) -> float:
    """What a response at `freq` (Hz) has of its size at the end of a `piece` (s) of `data` after blows at times `at`
    (n,) in s; 0 where noise is all that is there by then, just below 1 where it does not decay.

    A free decay falls within a piece to exp(-sigma T), and its power from one half of it to the other by as much,
    whatever the window both are seen through. What the lines around show of the second half is no mode's.
    """
    half = max(int(0.5 * piece / data.dt), 8)
    rows = [i for i, c in enumerate(data.channels) if c.quantity != "force" and c.dof is not None]
    starts = [k for k in np.round(at / data.dt).astype(int) if k + 2 * half <= data.n_samples]
    line = round(freq * half * data.dt)
    if not starts or not rows or line + ASIDE[1] > half // 2:
        return 0.0
    window = np.hanning(half)
    cut = np.array([data.values[rows, k : k + 2 * half].reshape(len(rows), 2, half) for k in starts])
    spectra = np.abs(np.fft.rfft((cut - cut.mean(axis=3, keepdims=True)) * window, axis=3)) ** 2
    first, second = spectra.sum(axis=(0, 1))
    sides = [second[max(line - ASIDE[1], 1) : max(line - ASIDE[0] + 1, 1)], second[line + ASIDE[0] : line + ASIDE[1]]]
    noise = min((float(np.median(side)) for side in sides if side.size), default=0.0)
    there = slice(max(line - 1, 0), line + 2)
    before, after = float(first[there].sum()), float(second[there].sum()) - 3 * noise
    return min(max(after / before, 0.0), UNDAMPED) if before > 0 else 0.0
