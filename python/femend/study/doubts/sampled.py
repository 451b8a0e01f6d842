"""Time records that are sampled too slowly for the band that is asked for, or for the modes of the model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.data import Recording
from femend.model.free_body import elastic
from femend.numerals import plain

__all__ = ["too_slow_for_band", "too_slow_for_modes"]

# share of the Nyquist frequency up to which the anti-aliasing filters of recorders let everything through
USABLE = 0.8
# a band or a mode above the Nyquist frequency by more than this factor speaks for a time axis in another unit
FAR = 20.0


def too_slow_for_band(recording: Recording, band: tuple[float, float] | None) -> tuple[str, ...]:
    """A sentence where the sampling of `recording` does not reach to the end of the `band` (Hz) that is asked for;
    nothing without a band, or where it holds no time records."""
    if band is None or not recording.is_time or band[1] <= USABLE * _nyquist(recording):
        return ()
    cut = f", or end the band at {plain(USABLE * _nyquist(recording))} Hz"
    return (_said(recording, f"[correlation] band goes to {plain(band[1])} Hz", band[1], cut),)


def too_slow_for_modes(recording: Recording, freq: NDArray[np.float64]) -> tuple[str, ...]:
    """A sentence where the sampling of `recording` does not reach to the lowest elastic mode of the model's `freq`
    (n_modes,) Hz; nothing where it holds no time records."""
    lowest = float(min(elastic(freq), default=0.0))
    if not recording.is_time or lowest <= USABLE * _nyquist(recording):
        return ()
    return (_said(recording, f"the model's lowest mode is at {plain(lowest)} Hz", lowest, ""),)


def _nyquist(recording: Recording) -> float:
    return 0.5 * recording.time.rate


def _said(recording: Recording, wanted: str, top: float, also: str) -> str:
    nyquist = _nyquist(recording)
    if top > FAR * nyquist:
        return (
            f"recording {recording.name!r} is sampled at {plain(2 * nyquist)} Hz by its time axis, and {wanted}, "
            f"{plain(top / (USABLE * nyquist), 2)} times above what that reaches: is the axis in milliseconds? A "
            f"column that counts them is called 'time [ms]'; if it is right, sample at {plain(2 * top / USABLE)} Hz or "
            f"more{also}"
        )
    return (
        f"recording {recording.name!r} is sampled at {plain(2 * nyquist)} Hz, so that its Nyquist frequency is "
        f"{plain(nyquist)} Hz and {plain(USABLE * nyquist)} Hz can be used, and {wanted}: what is above was filtered "
        f"off, or folds back and looks like sensors that are mistaken; sample at {plain(2 * top / USABLE)} Hz or more, "
        f"behind an anti-aliasing filter{also}, or check the time step of the file"
    )
