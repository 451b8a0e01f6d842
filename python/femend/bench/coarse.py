"""Modes that are narrower than the lines of the FRFs they were identified from can show."""

from __future__ import annotations

import numpy as np

from femend.data import FRF, IdentifiedModes, TimeData

__all__ = ["too_coarse"]

# lines that the half-power width of a resonance has to span: Hann's own is 1.44, and of less than twice that what is
# seen is the window as much as the structure
SPAN = 3.0


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
        f"mode{'s' * (narrow.size > 1)} {which}: the resonance at {modes.freq[i]:.4g} Hz is {width[i]:.2g} Hz wide at "
        f"most, and lines of FRFs averaged over pieces of {1 / step:.3g} s are {step:.3g} Hz apart: damping comes out "
        "too high, the frequency may be off by a line, and the deviations hold nothing of it; record "
        f"{needed:.2g} s or more, or give FRFs of your own"
    ]
