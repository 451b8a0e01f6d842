"""Records at other times: resampling without aliases, and several records brought to one time axis."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray
from scipy.signal import resample_poly
from scipy.sparse import csr_array

from femend.data import TimeData
from femend.errors import SignalError

__all__ = ["merge", "resample", "sample_at"]

FloatArray = NDArray[np.float64]

# zero crossings of the sinc on either side and its Kaiser window's shape: pass band flat to 1e-4 up to 0.8 of the edge
LOBES, BETA = 16, 8.0
# places between two samples whose weights are tabulated; linear interpolation between them is good to 1e-6
TABLE = 2048
# largest numerator and denominator of a polyphase ratio
RATIO = 1000


def sample_at(
    values: FloatArray, dt: float, times: FloatArray, *, t0: float = 0.0, cutoff: float | None = None
) -> FloatArray:
    """`values` (n_ch, n), sampled every `dt` s from `t0` on, at `times` (m,) s: (n_ch, m).

    Band-limited interpolation by a sinc under a Kaiser window, which passes what is below `cutoff` (Hz; by default the
    Nyquist frequency): set it to that of the new samples where they are fewer. Records end in their first and last
    value. Raises SignalError for times outside the record.
    """
    values = np.atleast_2d(np.asarray(values, float))
    n = values.shape[1]
    place = (np.asarray(times, float) - t0) / dt
    if place.size and (place.min() < -1e-6 or place.max() > n - 1 + 1e-6):
        raise SignalError(
            f"samples are asked for from {np.min(times):.6g} to {np.max(times):.6g} s, the record has {t0:.6g} to "
            f"{t0 + (n - 1) * dt:.6g} s",
            time=float(np.min(times)),
        )
    share = 1.0 if cutoff is None else min(1.0, 2 * dt * cutoff)
    half = int(np.ceil(LOBES / share))
    first = np.floor(place).astype(np.int64) - half + 1
    taps = np.arange(2 * half)
    out = np.empty((values.shape[0], place.size))
    table = _kernels(half, share)
    chunk = max(1, 4_000_000 // taps.size)
    for start in range(0, place.size, chunk):
        part = slice(start, start + chunk)
        index = first[part, None] + taps
        between = (place[part] - np.floor(place[part])) * TABLE
        step = np.minimum(between.astype(np.int64), TABLE - 1)
        rest = (between - step)[:, None]
        weight = table[step] * (1 - rest) + table[step + 1] * rest
        rows = np.arange(0, weight.size + 1, taps.size)
        matrix = csr_array((weight.ravel(), np.clip(index, 0, n - 1).ravel(), rows), shape=(len(weight), n))
        out[:, part] = (matrix @ values.T).T
    return out


def _kernels(half: int, share: float) -> FloatArray:
    """Weights (TABLE + 1, 2 half) of the samples around for places between two samples, each with sum 1."""
    away = np.linspace(0, 1, TABLE + 1)[:, None] - (np.arange(2 * half) - half + 1)
    weight = np.sinc(share * away) * _kaiser(away / half)
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def _kaiser(x: FloatArray) -> FloatArray:
    return np.asarray(np.i0(BETA * np.sqrt(np.clip(1 - x**2, 0, None))) / np.i0(BETA))


def resample(data: TimeData, rate: float) -> TimeData:
    """`data` at `rate` in Hz, low-passed below the new Nyquist frequency where that is lower.

    Ratios of whole numbers up to 1000 go through a polyphase filter (scipy.signal.resample_poly), others through
    `sample_at`. Tachos are interpolated between neighbouring samples, since a filter rings on their edges. Raises
    SignalError for a rate that is not positive or a record that keeps fewer than two samples.
    """
    if not (np.isfinite(rate) and rate > 0):
        raise SignalError(f"a rate of {rate} Hz is none; it must be positive", recording=data.name)
    ratio = Fraction(rate * data.dt).limit_denominator(RATIO)
    exact = 0 < ratio.numerator <= RATIO and abs(float(ratio) / (rate * data.dt) - 1) < 1e-12
    last = (data.n_samples - 1) * data.dt
    times = np.arange(int(np.floor(last * rate * (1 + 1e-12))) + 1) / rate
    if times.size < 2:
        raise SignalError(
            f"recording {data.name!r} of {data.duration:.6g} s has {times.size} samples at {rate:.6g} Hz; at least 2 "
            "are needed",
            recording=data.name,
        )
    if exact:
        values = resample_poly(data.values, ratio.numerator, ratio.denominator, axis=1, padtype="line")[:, : times.size]
    else:
        values = sample_at(data.values, data.dt, times, cutoff=rate / 2 if rate * data.dt < 1 else None)
    for row in data.rows("tacho"):
        values[row] = np.interp(times, data.dt * np.arange(data.n_samples), data.values[row])
    return TimeData(data.name, 1 / rate, values, data.channels, data.t0)


def merge(records: Sequence[TimeData], *, rate: float | None = None, cut: bool = False, name: str = "") -> TimeData:
    """The channels of several `records` on one time axis, under the name of the first or `name`.

    Records of different rates are refused unless a common `rate` (Hz) is given, records of different beginning or end
    unless `cut` takes the stretch that all have. Raises SignalError naming the record that differs, by how much.
    """
    if not records:
        raise SignalError("there are no records to merge")
    first = records[0]
    for other in records[1:]:
        if abs(other.dt / first.dt - 1) > 1e-9 and rate is None:
            raise SignalError(
                f"recording {other.name!r} has {other.rate:.9g} Hz, {first.name!r} {first.rate:.9g} Hz; say the rate "
                "to bring both to",
                recording=other.name,
            )
    parts = [r if rate is None else resample(r, rate) for r in records]
    dt = parts[0].dt
    apart = [(r.t0 - parts[0].t0) / dt for r in parts]
    differs = [i for i, r in enumerate(parts) if abs(apart[i]) > 1e-6 or r.n_samples != parts[0].n_samples]
    if differs and not cut:
        r, one = parts[differs[0]], parts[0]
        raise SignalError(
            f"recording {r.name!r} has {r.n_samples} samples from {r.t0:.6g} s on, {one.name!r} {one.n_samples} from "
            f"{one.t0:.6g} s on; cut both to what they share (cut=True)",
            recording=r.name,
            time=r.t0,
        )
    start = max(r.t0 for r in parts)
    stop = min(r.t0 + (r.n_samples - 1) * dt for r in parts)
    n = int(np.floor((stop - start) / dt + 1e-6)) + 1
    if n < 2:
        raise SignalError(f"the records {', '.join(r.name for r in parts)} share no time: {start:.6g} to {stop:.6g} s")
    values = np.vstack([_shifted(r, start, n) for r in parts])
    return TimeData(name or first.name, dt, values, tuple(c for r in parts for c in r.channels), start)


def _shifted(record: TimeData, start: float, n: int) -> FloatArray:
    """`n` samples of a record from `start` on, interpolated where its own lie between."""
    ahead = (start - record.t0) / record.dt
    whole = int(round(ahead))
    if abs(ahead - whole) < 1e-6:
        return record.values[:, whole : whole + n]
    last = record.t0 + (record.n_samples - 1) * record.dt
    times = np.minimum(start + record.dt * np.arange(n), last)
    return sample_at(record.values, record.dt, times, t0=record.t0)
