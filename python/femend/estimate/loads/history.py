"""Loads as time histories: every line of the whole record, and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import ODS, TimeData
from femend.data.bands import within_band
from femend.data.channel import Channel
from femend.errors import LoadError
from femend.estimate.loads.identify import Loads, identify_loads
from femend.estimate.loads.unit_responses import UnitResponses
from femend.units import quantity_of

__all__ = ["LoadHistory", "load_history"]

FloatArray = NDArray[np.float64]

# ends of a record that the motion from before it, or cut off behind it, may reach are faded over this share of it
FADE = 0.02
# the first line of a history, in lines of the record: below it a trend cannot be told from a motion
FIRST = 3


@dataclass(frozen=True, eq=False)
class LoadHistory:
    """`time` the loads as records over the band, `lines` what they are on each line of the record (spectrum of the
    whole record, in units times samples), `band` in Hz. `trusted` (begin, end) in s is the part that the fading at both
    ends leaves alone."""

    time: TimeData
    lines: Loads
    band: tuple[float, float]
    trusted: tuple[float, float]


def load_history(
    unit_responses: Callable[[FloatArray], UnitResponses],
    response: TimeData,
    band: tuple[float, float],
    *,
    noise: FloatArray | None = None,
    method: str = "tikhonov",
    choice: str = "gcv",
    model_error: float = 0.0,
) -> LoadHistory:
    """Histories of the loads behind the records `response`, in a `band` (low, high) in Hz.

    `unit_responses` gives the responses to the loads on lines in Hz (`ModelSide.base`, `.forces`, `.pressures`);
    `noise` (n_ch,) is the standard deviation of the samples' white noise. The record, faded in and out over 2 % at each
    end, is transformed as a whole; every line is solved as in `identify_loads`, and transformed back. Lines are taken
    to be periodic: what moved before the record began is explained by loads in its first moments, as long as the
    slowest decay lasts. Lines that are not reliable are in the history, too: `lines.verdict` tells them.

    Raises LoadError for a band that holds no lines or reaches beyond half the sampling rate, and what `identify_loads`
    raises.
    """
    n, dt = response.n_samples, response.dt
    freq = np.asarray(np.fft.rfftfreq(n, dt), dtype=np.float64)
    if band[1] > 0.5 / dt:
        raise LoadError(
            f"the band ends at {band[1]:.6g} Hz, the record of {response.name!r} at {0.5 / dt:.6g} Hz; lower the band"
        )
    inside = np.flatnonzero(within_band(freq, (max(band[0], FIRST * freq[1]), band[1])))
    if not inside.size:
        raise LoadError(f"no line of {response.name!r} lies between {band[0]:.6g} and {band[1]:.6g} Hz; widen the band")
    faded = max(1, int(FADE * n))
    ramp = 0.5 * (1 - np.cos(np.pi * (np.arange(faded) + 0.5) / faded))
    window = np.ones(n)
    window[:faded], window[n - faded :] = ramp, ramp[::-1]
    Y = np.fft.rfft(response.values * window, axis=1)[:, inside]
    sigma = None if noise is None else np.repeat(np.asarray(noise)[:, None] * np.sqrt((window**2).sum()), Y.shape[1], 1)
    shapes = ODS(response.name, freq[inside], Y, response.channels, "ods", sigma=sigma)
    lines = identify_loads(unit_responses(shapes.freq), shapes, method=method, choice=choice, model_error=model_error)
    spectrum = np.zeros((len(lines.names), len(freq)), dtype=np.complex128)
    spectrum[:, inside] = lines.values.T
    channels = tuple(Channel(None, quantity_of(u) or "unknown", u, m) for m, u in zip(lines.names, lines.units))
    time = TimeData(f"loads of {response.name}", dt, np.fft.irfft(spectrum, n, axis=1), channels, response.t0)
    begin, end = response.t0 + faded * dt, response.t0 + (n - 1 - faded) * dt
    return LoadHistory(time, lines, (float(freq[inside[0]]), float(freq[inside[-1]])), (begin, end))
