"""Steady operating shapes from a run-up of any speed: the response to one order by deconvolution."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from femend.data import ODS, Speed, TimeData
from femend.data.bands import within_band
from femend.errors import SignalError
from femend.numerals import plain
from femend.signal.check import notes_of

__all__ = ["run_up_shapes"]

FloatArray = NDArray[np.float64]

# share of the band left out at either end, where the sweep begins and stops; share of a run that a response may last
EDGE, LONGEST = 0.05, 0.25
# share of a run over which it is faded in and out: less than a sweep takes to enter the band
FADE = 0.02
# rounds of deconvolution
ROUNDS = 4


def run_up_shapes(
    data: TimeData,
    speed: Speed,
    order: float = 1.0,
    *,
    power: float = 2.0,
    memory: float | None = None,
    band: tuple[float, float] | None = None,
    channels: Sequence[int] | None = None,
) -> ODS:
    """Shapes of `order` that the structure would have at rest in speed, for speeds of a run-up or run-down.

    An order whose forces grow as Omega^`power` (2 for unbalance) acts as one known sweep u = Omega^power exp(i order
    angle) times constants; a linear structure answers with spectra Y = H F U / 2, so that 2 Y / U times Omega^power is
    the amplitude of the steady state at every frequency, phase against the tacho (deconvolution of a sweep: Farina,
    AES 108 (2000) preprint 5093). An order track of the same run shows resonances late, low and with ripples instead.

    The quotient's inverse transform is the impulse response to the order; only its first `memory` s are kept (an eighth
    of the run by default), which takes out noise and, since their sweeps do not match, most of the other orders.
    `memory` should last until the least damped mode has died out, and widens lines to 1/`memory`. `band` (Hz) limits
    the lines, by default those the order passes but for 5 % at either end; lines are 1/(4 `memory`) apart. `channels`
    are rows, by default all but tachos and voltages.

    Raises SignalError for a dead channel, where the speed does not cover a quarter of the record, `memory` is longer
    than a quarter of the run, the order's band is empty, or it lies above the Nyquist frequency.
    """
    rows = [i for i, c in enumerate(data.channels) if c.quantity not in ("tacho", "voltage")]
    rows = rows if channels is None else list(channels)
    faults = notes_of(data, rows)
    t = data.t
    inside = (t >= speed.start) & (t <= speed.stop)
    if inside.mean() < 0.25:
        raise SignalError(
            f"recording {data.name!r}: the speed covers {inside.mean():.0%} of the samples; bring both to one "
            f"time axis",
            recording=data.name,
        )
    rev, angle = speed.at(t[inside])
    span = float(inside.sum() * data.dt)
    keep = _memory(data, span, memory)
    low, high = _band(data, rev, order, band)
    force = (2 * np.pi * rev) ** power * np.exp(1j * order * angle)
    freq, G = _deconvolved(data.values[rows][:, inside], force, (low, high), keep, data.dt)
    step = max(1, int(round(1 / (4 * keep * freq[1]))))
    lines = np.flatnonzero(within_band(freq, (low, high)))[::step]
    at = freq[lines] / order
    said = f"steady state deconvolved from a run of {plain(span)} s, memory {plain(keep)} s"
    return ODS(
        data.name,
        freq[lines],
        np.asarray(G[:, lines] * (2 * np.pi * at) ** power, dtype=np.complex128),
        tuple(data.channels[i] for i in rows),
        "order",
        None,
        float(order),
        at,
        notes=(*speed.notes, *faults, said),
    )


def _memory(data: TimeData, span: float, memory: float | None) -> float:
    keep = span / 8 if memory is None else float(memory)
    if not 0 < keep <= LONGEST * span:
        raise SignalError(
            f"recording {data.name!r}: responses of {plain(keep)} s cannot be told apart in a run of {plain(span)} s; "
            f"at most "
            f"{plain(LONGEST * span)} s",
            recording=data.name,
        )
    return keep


def _deconvolved(
    x: FloatArray, force: NDArray[np.complex128], band: tuple[float, float], keep: float, dt: float
) -> tuple[FloatArray, NDArray[np.complex128]]:
    """Frequencies and response per force (n_ch, n_freq) of records `x` (n_ch, n) to the real part of `force` (n,)."""
    size = next_fast_len(force.size + int(np.ceil(2 * keep / dt)), real=True)
    freq = np.asarray(np.fft.rfftfreq(size, dt), dtype=np.float64)
    x = (x - x.mean(axis=1, keepdims=True)) * _faded(force.size)
    force = force * _faded(force.size)
    U = np.fft.fft(force, size)[: freq.size]
    G = np.zeros((len(x), freq.size), dtype=np.complex128)
    left = x
    for _ in range(ROUNDS):  # what the sweep's beginning and end smear is found in what is left
        G += _gated(2 * np.fft.rfft(left, size, axis=1), U, freq, band, keep, dt, size)
        left = x - np.fft.irfft(0.5 * G * U, size, axis=1)[:, : force.size]
    return freq, G


def _faded(n: int) -> FloatArray:
    """Window (n,) that sets in and ends smoothly, for response and force alike.

    A machine that runs when the record begins has answered to what was before; a force that sets in at once with the
    level of full speed, as in a run-down, says otherwise and smears over the lines where the order is weak.
    """
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(max(int(FADE * n), 1)) / max(int(FADE * n), 1))
    window = np.ones(n)
    window[: rise.size] = rise
    window[n - rise.size :] = rise[::-1]
    return window


def _band(data: TimeData, rev: FloatArray, order: float, band: tuple[float, float] | None) -> tuple[float, float]:
    lowest, highest = order * float(rev.min()), order * float(rev.max())
    edge = EDGE * (highest - lowest)
    low, high = (lowest + edge, highest - edge) if band is None else band
    low, high = max(low, lowest), min(high, highest, 0.48 * data.rate)
    if not high > low:
        raise SignalError(
            f"recording {data.name!r}: order {plain(order)} passes {lowest:.6g} to {highest:.6g} Hz; nothing of it "
            f"lies in "
            f"the band wanted and below {0.48 * data.rate:.6g} Hz",
            recording=data.name,
        )
    return low, high


def _gated(
    Y: NDArray[np.complex128],
    U: NDArray[np.complex128],
    freq: FloatArray,
    band: tuple[float, float],
    keep: float,
    dt: float,
    size: int,
) -> NDArray[np.complex128]:
    """Y / U on the band with a gate of `keep` s on its (complex) impulse response.

    The band's own edges ring on both sides of every lag; a gate between two lags is a convolution over the lines, done
    on Y conj(U) and |U|^2 alike, so that no division meets a line without force.
    """
    inside = within_band(freq, (0.5 * band[0], 1.5 * band[1]))
    lag = np.arange(size) * dt
    fall = 0.5 * keep
    gate = np.where(lag <= keep, 1.0, np.where(lag < keep + fall, 0.5 + 0.5 * np.cos(np.pi * (lag - keep) / fall), 0.0))
    ahead = size * dt - lag  # a little before zero: the band limits' own width
    early = 0.05 * keep
    gate = np.maximum(gate, np.where(ahead < early, 0.5 + 0.5 * np.cos(np.pi * np.minimum(ahead / early, 1)), 0.0))
    spectrum = np.zeros(size, complex)
    product = np.where(inside, 1.0, 0.0) * U.conj()
    spectrum[: freq.size] = np.abs(U) ** 2 * inside
    base = np.fft.fft(np.fft.ifft(spectrum) * _narrow(np.asarray(lag, dtype=np.float64), size * dt, keep))[
        : freq.size
    ].real
    out = np.empty_like(Y)
    for i, y in enumerate(Y):
        spectrum[:] = 0
        spectrum[: freq.size] = y * product / np.maximum(base, 1e-6 * base.max())
        out[i] = np.fft.fft(np.fft.ifft(spectrum) * gate)[: freq.size]
    return out


def _narrow(lag: FloatArray, span: float, keep: float) -> FloatArray:
    """Lag window of the smoothing of |U|^2: both sides of zero, narrower than what the gate resolves."""
    away = np.minimum(lag, span - lag)
    return np.where(away < 0.25 * keep, 0.5 + 0.5 * np.cos(np.pi * np.minimum(away / (0.25 * keep), 1)), 0.0)
