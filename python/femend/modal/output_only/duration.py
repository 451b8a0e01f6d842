"""How long a recording must be for a mode, and how well a mode can be known at best.

Au's uncertainty laws (Au, Uncertainty law in ambient modal identification, Part I: theory, MSSP 48 (2014) 15-33): with
N_c = f T periods recorded, a well separated mode in little noise has coefficients of variation

    of frequency  sqrt(zeta / (4 pi N_c)),    of damping  1 / sqrt(2 pi zeta N_c)

at best. No method gets below; one near them uses the recording well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.errors import RecordingTooShortError
from femend.numerals import plain

__all__ = ["MIN_PERIODS", "WORST_ZETA_COV", "best_freq_cov", "best_zeta_cov", "needed_duration", "refuse_short"]

# Below this many periods of a mode there are fewer than ten stretches of the two periods that its correlation function
# is read from: neither a mean nor its scatter can be formed.
MIN_PERIODS = 20.0
# A damping ratio whose coefficient of variation is over one half at best is not known.
WORST_ZETA_COV = 0.5


def best_freq_cov(freq: NDArray[np.float64], zeta: NDArray[np.float64], duration: float) -> NDArray[np.float64]:
    """Smallest coefficient of variation of frequencies `freq` (n,) in Hz at damping `zeta` (n,) from `duration` s.

    >>> float(np.round(best_freq_cov(np.array([10.0]), np.array([0.01]), 100.0)[0], 6))
    0.000892
    """
    return np.sqrt(zeta / (4 * np.pi * freq * duration))


def best_zeta_cov(freq: NDArray[np.float64], zeta: NDArray[np.float64], duration: float) -> NDArray[np.float64]:
    """Smallest coefficient of variation of damping `zeta` (n,) at `freq` (n,) in Hz from `duration` s.

    >>> float(np.round(best_zeta_cov(np.array([10.0]), np.array([0.01]), 100.0)[0], 3))
    0.126
    """
    return 1.0 / np.sqrt(2 * np.pi * zeta * freq * duration)


def needed_duration(freq: float, zeta: float, zeta_cov: float = WORST_ZETA_COV) -> float:
    """Seconds of recording for a mode at `freq` Hz with damping `zeta`: for a coefficient of variation `zeta_cov` of
    the damping at best, and at least MIN_PERIODS periods.

    >>> round(needed_duration(1.0, 0.01), 1)
    63.7
    """
    return float(max(1 / (2 * np.pi * zeta * freq * zeta_cov**2), MIN_PERIODS / freq))


def refuse_short(name: str, duration: float, freq: float, needed: float, what: str) -> None:
    """Raises RecordingTooShortError where `duration` is below `needed` s for the mode at `freq` Hz that `what` names,
    in the recording `name`."""
    if duration >= needed:
        return
    raise RecordingTooShortError(
        f"recording {name!r}: {plain(duration)} s hold {plain(duration * freq, 3)} periods of {what} {plain(freq)} Hz, "
        f"too few to tell its frequency and damping; record at least {plain(needed)} s, or raise the lower band edge "
        "above the mode",
        recording=name,
        duration=duration,
        needed=needed,
        freq=freq,
    )
