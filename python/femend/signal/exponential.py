"""An exponential window on a hammer's record, told by the noise that it makes fall, and taken off.

Analysers multiply what a blow leaves by exp(-a t) (ISO 7626-5, 7.4.2), which is damping a of every mode. They do so to
what was recorded, noise included: noise is as strong throughout, and falls with no window but that one, at one rate at
all sensors. Divided by the window, motion and noise are again what they were.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.data import TimeData
from femend.signal.suited import blows

__all__ = ["ExponentialWindow", "exponential_window_of", "window_taken_off"]

FloatArray = NDArray[np.float64]

# noise is looked for above this share of the Nyquist frequency, where what a blow left is gone first, by a filter of so
# many samples: its memory is short, so that the blow does not show in what follows
ABOVE, TAPS = 0.75, 47
# blocks of a record, and the share of it at its end in which the rate is read
BLOCKS, TAIL = 20, 0.5
# the least by which noise falls over the record, as an exponent, and in standard deviations of it
LEAST, SURE = 0.4, 6.0
# standard deviations within which sensors agree on the rate, and how many times as much as white noise logarithms of
# its power may scatter about a straight line
AGREE, SCATTER = 4.0, 2.2
# share of the power on the strongest fiftieth of the lines: of white noise it is 0.1, of a mode that rings nearly all
STRONGEST, OF_POWER = 50, 0.3
# noise of less than this share of the motion beside it may be rounding, which falls with the motion
ROUNDED = 1e-5
# standard errors, and share, by which noise before the blow may be off from what that after it says
BEFORE, NEAR = 4.0, 0.15
# and standard errors by which it has to be nearer to that of a window from the blow on than to that of one from the
# first sample on
TELLING = 2.0
# samples before a blow in which a recorder's filter lets it ring, and the fewest ahead of those that tell a level
RINGS, FEWEST = 8, 24


@dataclass(frozen=True, slots=True)
class ExponentialWindow:
    """A window exp(-`decay` (t - `begin`)) from `begin` s after a record's first sample on, 1 before, with `decay` in
    1/s, on the channels `rows`."""

    decay: float
    begin: float
    rows: tuple[int, ...]

    def values(self, data: TimeData) -> FloatArray:
        """The window (n_samples,) on the samples of `data`."""
        t = data.dt * np.arange(data.n_samples)
        return np.asarray(np.exp(-self.decay * np.maximum(t - self.begin, 0.0)))


def exponential_window_of(data: TimeData) -> ExponentialWindow | None:
    """The exponential window that was put on `data`, a record of one blow and what it left; None where its noise is as
    strong at the end as at the beginning, where noise does not show, and of other records."""
    at, outs = blows(data), _responses(data)
    if len(at) != 1 or not outs or data.n_samples < BLOCKS * TAPS:
        return None
    strike = int(round(float(at[0]) / data.dt))
    noise = _high_passed(data.values[outs])
    found = [_fall(noise[i], data.values[row], data.dt) for i, row in enumerate(outs)]
    told = [one for one in found if one is not None]
    if len(told) < len(outs):
        return None
    rates, levels, sd = (np.array(v) for v in zip(*told, strict=True))
    decay = float(rates.mean())
    sure = decay * data.duration > LEAST and decay > SURE * sd.mean() / np.sqrt(len(outs))
    if not sure or np.abs(rates - decay).max() > AGREE * sd.max():
        return None
    if not all(_white(x, decay, data.dt) for x in noise):
        return None
    decay, moved = _refined(noise, decay, levels, data.dt)
    begin = _begin(noise, levels + moved, decay, data.dt, strike)
    if begin is None:
        return None
    forces = _forces_with(data, decay, sd.max())
    return ExponentialWindow(decay, begin, tuple(sorted([*outs, *forces])))


def window_taken_off(data: TimeData, window: ExponentialWindow) -> TimeData:
    """`data` as it was before the `window` was put on it."""
    values = np.array(data.values)
    values[list(window.rows)] /= window.values(data)
    return replace(data, values=values)


def _responses(data: TimeData) -> list[int]:
    """Channels of what moves."""
    return [row for row, c in enumerate(data.channels) if c.quantity in ("acceleration", "velocity", "displacement")]


def _high_passed(x: FloatArray) -> FloatArray:
    """What signals x (n_ch, n) hold near the Nyquist frequency, without delay: (n_ch, n)."""
    from scipy.signal import firwin, oaconvolve

    taps = firwin(TAPS, ABOVE, window=("kaiser", 8.0), pass_zero=False)
    return np.asarray(oaconvolve(x, taps[None], mode="same", axes=1))


def _fall(noise: FloatArray, x: FloatArray, dt: float) -> tuple[float, float, float] | None:
    """Rate (1/s) at which the `noise` (n,) of a signal x (n,) falls at its end, its logarithm at the first sample and
    the rate's standard deviation; None where there is none, or it does not fall as an exponential does."""
    n = noise.size
    length = n // BLOCKS
    first = int((1 - TAIL) * BLOCKS)
    # the filter's transient at the record's end is left out
    blocks = np.arange(first, BLOCKS - 1)
    pieces = noise[: BLOCKS * length].reshape(BLOCKS, length)[blocks]
    power = (pieces**2).mean(axis=1)
    beside = (x[: BLOCKS * length].reshape(BLOCKS, length)[blocks] ** 2).mean(axis=1)
    if (power <= ROUNDED**2 * beside).any():
        return None
    t = (blocks + 0.5) * length * dt
    off = t - t.mean()
    half = 0.5 * np.log(power)
    slope = float(off @ half / (off @ off))
    # a share 1 - ABOVE of the samples of filtered noise are independent
    error = 0.5 * np.sqrt(2 / (length * (1 - ABOVE)))
    rest = half - half.mean() - slope * off
    if rest.std() > SCATTER * error:
        return None
    return -slope, float(half.mean() - slope * t.mean()), float(error / np.sqrt(off @ off))


def _refined(noise: FloatArray, decay: float, levels: FloatArray, dt: float) -> tuple[float, float]:
    """The common rate (1/s) at which `noise` (n_ch, n) falls, read from the first block on that lies on the line of
    what was read at the end, and by how much that moves the logarithms `levels` (n_ch,) at the first sample."""
    length = noise.shape[1] // BLOCKS
    power = (noise[:, : BLOCKS * length].reshape(len(noise), BLOCKS, length) ** 2).mean(axis=2)
    t = (np.arange(BLOCKS) + 0.5) * length * dt
    error = 0.5 * np.sqrt(2 / (length * (1 - ABOVE) * len(noise)))
    rest = (0.5 * np.log(np.maximum(power, 1e-300)) - levels[:, None]).mean(axis=0) + decay * t
    first = int((1 - TAIL) * BLOCKS)
    while first > 1 and abs(rest[first - 1]) < AGREE * error:
        first -= 1
    slope, level = np.polyfit(t[first:-1], rest[first:-1], 1)
    return decay - float(slope), float(level)


def _white(noise: FloatArray, decay: float, dt: float) -> bool:
    """Whether what falls at a rate (1/s) is white: a mode that rings is one line of it."""
    first = int((1 - TAIL) * noise.size)
    flat = noise[first:] * np.exp(decay * dt * np.arange(noise.size - first))
    power = np.abs(np.fft.rfft(flat)) ** 2
    power = power[int(ABOVE * power.size) :]
    return bool(np.sort(power)[-max(1, power.size // STRONGEST) :].sum() < OF_POWER * power.sum())


def _begin(noise: FloatArray, levels: FloatArray, decay: float, dt: float, strike: int) -> float | None:
    """Seconds after the first sample at which a window begins, at that sample or at the blow, by the noise before the
    sample `strike`; None where that noise is neither as strong, so that it is no window that falls after it. `levels`
    (n_ch,) are logarithms of the noise at the first sample as what comes after the blow has it."""
    edge = TAPS // 2
    quiet = noise[:, edge : strike - RINGS - edge]
    if quiet.shape[1] < FEWEST:
        return 0.0
    shown = float((0.5 * np.log(np.maximum((quiet**2).mean(axis=1), 1e-300)) - levels).mean())
    middle, sd = 0.5 * (strike - RINGS) * dt, float(np.sqrt(0.5 / (quiet.size * (1 - ABOVE))))
    from_first, from_blow = abs(shown + decay * middle), abs(shown + decay * strike * dt)
    if min(from_first, from_blow) > BEFORE * sd + NEAR:
        return None
    # most begin with the record; a factor that force and responses share makes no difference to a linear structure
    return strike * dt if from_first > from_blow + TELLING * sd else 0.0


def _forces_with(data: TimeData, decay: float, sd: float) -> list[int]:
    """The force, unless its noise tells that it has no window: an analyser puts one on both, and a force window leaves
    no noise to tell it by."""
    rows = data.rows("force")
    found = _fall(_high_passed(data.values[rows])[0], data.values[rows[0]], data.dt)
    plain = found is not None and abs(found[0]) < AGREE * sd and decay > 2 * AGREE * sd
    return [] if plain else list(rows)
