"""Modes that are narrower than the lines of the FRFs they were identified from can show."""

from __future__ import annotations

import numpy as np

from femend.data import FRF, IdentifiedModes, TimeData
from femend.numerals import plain

__all__ = ["FEWEST_PIECES", "longer_pieces", "too_coarse"]

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

    Their stated deviations are of the fit to the FRF and hold nothing of it.
    """
    step = float(frf.freq[1] - frf.freq[0])
    width = 2 * np.abs(modes.zeta) * modes.freq
    narrow = np.flatnonzero(width < SPAN * step)
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
