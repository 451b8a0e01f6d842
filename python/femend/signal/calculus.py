"""Acceleration, velocity and displacement into each other, without drift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from femend.data import Channel, TimeData
from femend.errors import SignalError
from femend.numerals import plain
from femend.units import parse_unit

__all__ = ["DERIVATIVES", "to_quantity"]

FloatArray = NDArray[np.float64]

# which derivative of the displacement a quantity is
DERIVATIVES = {"displacement": 0, "velocity": 1, "acceleration": 2}
# rounds of single integration, twice those of double: gains are within 0.4 % of one from 2 fc on
ROUNDS = 4
# high pass over sampling rate below which the normal equations of a double integral lose too many digits
SLOWEST = 3e-4
# shares of the Nyquist frequency between which a derivative is faded out
FADE = (0.8, 1.0)


def to_quantity(
    data: TimeData, quantity: str, *, high_pass: float | None = None, rows: Sequence[int] | None = None
) -> TimeData:
    """The responses `rows` of `data` (all displacements, velocities, accelerations by default) as one `quantity`.

    An integral has no known constant: each record loses its straight line and what is slower than `high_pass` (Hz; four
    periods in the record by default), by regularised least squares (Lee et al., J. Sound Vib. 329 (2010) 5083, eq. 11,
    repeated), without phase, with half the gain below `high_pass` and within 0.4 % of one from twice that on. The first
    and last period of `high_pass` are less certain. Derivatives are powers of i omega that fade out between 0.8 and 1
    of the Nyquist frequency; their outermost samples are less certain. Other channels stay as they are. Units follow
    (``mm/s^2`` becomes ``mm``; ``g`` becomes ``m``).

    Raises SignalError for another quantity, a row that is no response, fewer than two periods of `high_pass` in the
    record, and a `high_pass` below 3e-4 of the sampling rate.
    """
    if quantity not in DERIVATIVES:
        raise SignalError(f"quantity {quantity!r} is none of {', '.join(DERIVATIVES)}", recording=data.name)
    chosen = data.rows(*DERIVATIVES) if rows is None else list(rows)
    values, channels = np.array(data.values), list(data.channels)
    for source in DERIVATIVES:
        own = [i for i in chosen if data.channels[i].quantity == source]
        steps = DERIVATIVES[quantity] - DERIVATIVES[source]
        if not own or not steps:
            continue
        scaled = [_relabel(data.channels[i], quantity) for i in own]
        x = data.values[own] * np.array([s[1] for s in scaled])[:, None]
        values[own] = _integrate(data, x, -steps, high_pass) if steps < 0 else _differentiate(x, data.dt, steps)
        for i, (channel, _) in zip(own, scaled, strict=True):
            channels[i] = channel
    left = [i for i in chosen if channels[i].quantity != quantity]
    if left:
        name = data.channels[left[0]].text
        raise SignalError(
            f"recording {data.name!r}: {name} cannot become a {quantity}; choose rows of displacement, velocity or "
            "acceleration",
            recording=data.name,
            channel=name,
        )
    return TimeData(data.name, data.dt, values, tuple(channels), data.t0)


def _relabel(channel: Channel, quantity: str) -> tuple[Channel, float]:
    """The channel as `quantity`, and the factor on its values before."""
    suffix = {"displacement": "", "velocity": "/s", "acceleration": "/s^2"}
    own = suffix[channel.quantity]
    unit = channel.unit.replace("²", "^2").replace("s2", "s^2")
    base = unit[: len(unit) - len(own)] if unit.endswith(own) else ""
    if base and "/" not in base and base != "g":
        return replace(channel, quantity=quantity, unit=base + suffix[quantity]), 1.0
    rotational = channel.dof is not None and channel.dof.is_rotation
    return replace(channel, quantity=quantity, unit=("rad" if rotational else "m") + suffix[quantity]), parse_unit(
        channel.unit
    ).factor


def _integrate(data: TimeData, x: FloatArray, times: int, high_pass: float | None) -> FloatArray:
    """Iterated Tikhonov: min |D y - x|^2 + lambda^2 |y|^2 with the difference D of order `times`, again for what is
    left (ROUNDS / times rounds). No end has to be invented; the gain is 1 - (1 + (f/fc)^(2 times))^-rounds."""
    fc = 4 / data.duration if high_pass is None else float(high_pass)
    if not fc * data.duration >= 2:
        raise SignalError(
            f"recording {data.name!r} of {data.duration:.6g} s has {plain(max(fc, 0) * data.duration, 3)} periods of "
            f"the high pass at {fc:.6g} Hz; integrate with at least {plain(2 / data.duration)} Hz",
            recording=data.name,
            time=data.t0,
        )
    if fc * data.dt < SLOWEST:
        raise SignalError(
            f"recording {data.name!r}: a high pass at {fc:.6g} Hz is too low to integrate {data.rate:.6g} Hz in "
            f"double precision; resample to {plain(fc / SLOWEST)} Hz at most, or take {plain(SLOWEST * data.rate)} Hz",
            recording=data.name,
        )
    n = x.shape[1]
    level = np.linspace(-1, 1, n)
    A = np.column_stack([np.ones(n), level])
    x = x - (A @ np.linalg.lstsq(A, x.T, rcond=None)[0]).T
    smooth = _averaged(x, data.dt, times) * data.dt**times
    small = (2 * np.pi * fc * data.dt) ** (2 * times)
    stencil = [1.0, -1.0] if times == 1 else [1.0, -2.0, 1.0]
    band = _normal(stencil, n)
    band[0] += small
    factor = cholesky_banded(band, lower=True)
    y = np.zeros_like(x)
    for _ in range(ROUNDS // times):
        left = smooth - np.diff(y, times, axis=1)
        y = y + cho_solve_banded((factor, True), _transposed(left, times, n).T).T
    if times == 1:  # a trend of x leaves a constant between the ends
        end = min(n // 4, int(np.ceil(1 / (fc * data.dt))))
        y -= (y[:, end : n - end] @ (weight := np.hanning(n - 2 * end)) / weight.sum())[:, None]
    return y


def _normal(stencil: list[float], n: int) -> FloatArray:
    """D^T D of a difference `stencil` over n samples, lower banded."""
    width = len(stencil)
    band = np.zeros((width, n))
    for i, a in enumerate(stencil):
        for j, b in enumerate(stencil[: i + 1]):
            band[i - j, j : n - width + 1 + j] += a * b
    return band


def _transposed(x: FloatArray, times: int, n: int) -> FloatArray:
    """D^T x for rows x (n_ch, n - times)."""
    out = np.zeros((x.shape[0], n))
    weights = [-1.0, 1.0] if times == 1 else [1.0, -2.0, 1.0]
    for k, w in enumerate(weights):
        out[:, k : n - times + k] += w * x
    return out


def _averaged(x: FloatArray, dt: float, times: int) -> FloatArray:
    """What differences of the integral are, exactly: means over one step (`times` 1), hat-weighted over two (2)."""
    n = x.shape[1]
    freq, X, size = _extended(x, dt, min(n - 1, 64))
    mean = np.sinc(freq * dt) ** times * (np.exp(1j * np.pi * freq * dt) if times == 1 else 1.0)
    pad = min(n - 1, 64)
    out = np.fft.irfft(X * mean, size, axis=1)[:, pad : pad + n]
    return np.asarray(out[:, :-1] if times == 1 else out[:, 1:-1])


def _differentiate(x: FloatArray, dt: float, times: int) -> FloatArray:
    n = x.shape[1]
    pad = n - 1
    freq, X, size = _extended(x, dt, pad)
    share = freq * 2 * dt
    fade = 0.5 + 0.5 * np.cos(np.pi * np.clip((share - FADE[0]) / (FADE[1] - FADE[0]), 0, 1))
    return np.asarray(np.fft.irfft(X * fade * (2j * np.pi * freq) ** times, size, axis=1)[:, pad : pad + n])


def _extended(x: FloatArray, dt: float, pad: int) -> tuple[FloatArray, NDArray[np.complex128], int]:
    """Frequencies, transform and length of `x` (n_ch, n) with `pad` samples of its reflection in the end points.

    The outer half of both is faded to one level, so that the ends meet.
    """
    left = 2 * x[:, :1] - x[:, pad:0:-1]
    right = 2 * x[:, -1:] - x[:, -2 : -pad - 2 : -1]
    whole = np.hstack([left, x, right])
    fade = max(2, pad // 2)
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.arange(fade) / fade)
    middle = 0.5 * (whole[:, :1] + whole[:, -1:])
    whole[:, :fade] = middle + (whole[:, :fade] - middle) * ramp
    whole[:, -fade:] = middle + (whole[:, -fade:] - middle) * ramp[::-1]
    size = whole.shape[1]
    return np.asarray(np.fft.rfftfreq(size, dt), dtype=np.float64), np.fft.rfft(whole, axis=1), size
