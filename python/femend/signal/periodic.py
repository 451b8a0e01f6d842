"""FRF under periodic excitation, with the variances of noise and of nonlinear distortion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, TimeData
from femend.data.bands import within_band
from femend.errors import SignalError
from femend.numerals import plain
from femend.signal.frf import KINDS, frf_kind

__all__ = ["PeriodicEstimate", "find_period", "periodic_frf"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# a line is excited where the force's power is above this share of the largest
EXCITED = 1e-4
# deviations by which the change of a period against the last one exceeds that of the later ones where it holds a
# transient, and the change, as a share of the rms, that rounding may make
SETTLED, ROUNDING = 5.0, 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class PeriodicEstimate:
    """FRF on the excited lines and what scatters it.

    Attributes:
        frf: the FRF; its coherence is 1 / (1 + total_variance * n / |H|^2) with n periods in all.
        noise_variance: (n_freq, n_out, n_in) of the complex mean, from what periods differ by.
        total_variance: (n_freq, n_out, n_in) of the complex mean, noise and distortion, from what realisations differ
            by; equals the noise variance where there is one realisation.
        distortion_variance: (n_freq, n_out, n_in) of one realisation, total less noise, not below 0; None for one
            realisation.
        n_periods: periods used of each realisation; `n_realisations`; `skipped` transient periods.
        silent: level of the responses on lines without force, (n_lines, n_out) at `silent_freq` Hz, in units of the
            response's amplitude, and `silent_noise` (n_lines, n_out) the standard deviation of noise there: what stands
            above it is nonlinear, on even lines even and on odd lines odd.
    """

    frf: FRF
    noise_variance: FloatArray
    total_variance: FloatArray
    distortion_variance: FloatArray | None
    n_periods: int
    n_realisations: int
    skipped: int
    silent_freq: FloatArray
    silent: FloatArray
    silent_noise: FloatArray


def find_period(data: TimeData, *, force: int | None = None, tolerance: float = 0.02) -> int:
    """Samples of the shortest period of the force of `data` (row `force`): it repeats to `tolerance` of its rms.

    Raises SignalError where the force repeats nowhere within half the record.

    >>> from femend.data import Channel
    >>> x = np.tile([0.0, 3.0, -1.0, -2.0], 5)
    >>> find_period(TimeData("r", 0.1, [x], [Channel(None, "force", "N")]))
    4
    """
    rows = data.rows("force") if force is None else [force]
    if not rows:
        raise SignalError(f"recording {data.name!r} has no force channel, whose period is wanted", recording=data.name)
    x = data.values[rows[0]] - data.values[rows[0]].mean()
    n = x.size
    size = 1 << int(np.ceil(np.log2(2 * n)))
    X = np.fft.rfft(x, size)
    product = np.fft.irfft(np.abs(X) ** 2, size)[: n // 2 + 1]
    square = np.concatenate([[0.0], np.cumsum(x**2)])
    lag = np.arange(n // 2 + 1)
    apart = square[n] - square[lag] + square[n - lag] - 2 * product  # sum over t of (x(t + lag) - x(t))^2
    limit = tolerance**2 * (square[n] - square[lag] + square[n - lag]) / 2
    # the comparison of near samples is good at small lags too: only after the force has run apart once does it repeat
    parted = np.flatnonzero(apart > 0.5 * (square[n] - square[lag] + square[n - lag]))
    repeats = np.flatnonzero(apart <= limit + 1e-9 * square[n])
    repeats = repeats[repeats > (parted[0] if parted.size else n)]
    if not repeats.size:
        channel = data.channels[rows[0]].text
        raise SignalError(
            f"recording {data.name!r}: the force {channel} does not repeat within {n // 2} samples; say the period, or "
            "average spectra (estimate_frf)",
            recording=data.name,
            channel=channel,
        )
    first = int(repeats[0])
    group = repeats[repeats < first + max(2, first // 50)]
    return int(group[np.argmin(apart[group])])


def periodic_frf(
    records: TimeData | Sequence[TimeData],
    period: int | None = None,
    *,
    skip: int | None = None,
    band: tuple[float, float] | None = None,
) -> PeriodicEstimate:
    """FRF from whole periods of `period` samples (found where not given), robust to nonlinear distortion.

    `records` are realisations of the excitation; with n_in forces, n_in records in a row with independent forces make
    one realisation. Within a realisation the periods tell the noise, between realisations the distortion adds to it
    (Pintelon and Schoukens, System Identification, 2nd ed., eq. 4-30 to 4-34, robust method). `skip` periods at the
    beginning are left out, by default those that still differ by transients. `band` (Hz) limits the lines.

    Raises SignalError for fewer than two periods, records of different channels or rates, a number of records that is
    no multiple of the forces, and forces that excite no line or are not independent.
    """
    several = [records] if isinstance(records, TimeData) else list(records)
    first = several[0]
    ins = first.rows("force")
    outs = [i for i in first.rows(*KINDS) if first.channels[i].dof is not None]
    kind, unit = frf_kind(first.name, first.channels, ins, outs)
    _refuse_unlike(several, len(ins))
    n = find_period(first) if period is None else int(period)
    cut = [_periods(r, n) for r in several]
    skipped = max(_transient(c[:, outs]) for c in cut) if skip is None else int(skip)
    count = min(len(c) for c in cut) - skipped
    if count < 2:
        raise SignalError(
            f"recording {first.name!r}: {count} whole periods of {n} samples are left after {skipped} transient ones; "
            "at least 2 tell the noise",
            recording=first.name,
        )
    X = np.array([np.fft.rfft(c[len(c) - count :], axis=2) * (2 / n) for c in cut])  # (records, periods, n_ch, n_freq)
    freq = np.asarray(np.fft.rfftfreq(n, first.dt), dtype=np.float64)
    excited, inside = _excited(first, freq, X[:, :, ins], band)
    n_real = len(several) // len(ins)
    H, noise = _solved(first, X[..., excited], ins, outs, n_real)
    noise_of_mean = noise.mean(axis=0) / n_real
    if n_real > 1:
        total = H.var(axis=0, ddof=1) / n_real
        distortion = np.maximum(n_real * (total - noise_of_mean), 0.0)
    else:
        total, distortion = noise_of_mean, None
    averages, channels = count * n_real, first.channels
    mean = H.mean(axis=0)
    power = np.maximum(np.abs(mean) ** 2, np.finfo(float).tiny)
    coherence = 1 / (1 + np.maximum(total, noise_of_mean) * averages / power)
    responses, forces = tuple(channels[i] for i in outs), tuple(channels[i] for i in ins)
    frf = FRF(first.name, freq[excited], mean, responses, forces, kind, unit, coherence)
    quiet = inside & ~excited
    at_rest = X[:, :, outs][..., quiet]
    level = np.sqrt((np.abs(at_rest.mean(axis=1)) ** 2).mean(axis=0)).T
    scatter = np.sqrt(at_rest.var(axis=1, ddof=1).mean(axis=0) / count).T
    return PeriodicEstimate(frf, noise_of_mean, total, distortion, count, n_real, skipped, freq[quiet], level, scatter)


def _refuse_unlike(records: Sequence[TimeData], n_in: int) -> None:
    first = records[0]
    if len(records) % n_in:
        raise SignalError(
            f"{len(records)} records are no multiple of {n_in} forces; each realisation takes {n_in} with independent "
            "forces",
            recording=first.name,
        )
    for other in records[1:]:
        same = [(c.dof, c.quantity) for c in other.channels] == [(c.dof, c.quantity) for c in first.channels]
        if not same or abs(other.dt / first.dt - 1) > 1e-9:
            raise SignalError(
                f"recording {other.name!r} has {len(other.channels)} channels at {other.rate:.9g} Hz, {first.name!r} "
                f"{len(first.channels)} at {first.rate:.9g} Hz; realisations have the same channels and rate",
                recording=other.name,
            )


def _periods(data: TimeData, n: int) -> FloatArray:
    """The record's last whole periods (n_periods, n_ch, n)."""
    count = data.n_samples // n if n > 1 else 0
    if count < 2:
        raise SignalError(
            f"recording {data.name!r} of {data.n_samples} samples has {count} periods of {n}; at least 2 are needed",
            recording=data.name,
        )
    x = data.values[:, data.n_samples - count * n :]
    return np.moveaxis(x.reshape(len(x), count, n), 0, 1)


def _transient(periods: FloatArray) -> int:
    """Periods at the beginning that differ from the last one by more than the later ones do."""
    if len(periods) < 3:
        return 0
    apart = np.sqrt(((periods[:-1] - periods[-1]) ** 2).mean(axis=2)).max(axis=1)
    usual = max(float(np.median(apart[len(apart) // 2 :])), ROUNDING * float(np.sqrt((periods[-1] ** 2).mean())))
    late = np.flatnonzero(apart > usual * (1 + SETTLED / np.sqrt(2 * periods.shape[2])))
    return int(min(late[-1] + 1, len(periods) - 2)) if late.size else 0


def _excited(
    data: TimeData, freq: FloatArray, U: ComplexArray, band: tuple[float, float] | None
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    power = (np.abs(U.mean(axis=1)) ** 2).sum(axis=(0, 1))
    low, high = (freq[1], freq[-2]) if band is None else band
    inside = within_band(freq, (low, high))
    excited = inside & (power > EXCITED * power[1:].max())
    if not excited.any():
        raise SignalError(
            f"recording {data.name!r}: the force excites no line between {low:.6g} and {high:.6g} Hz",
            recording=data.name,
        )
    if band is None:  # silent lines count between the excited ones
        at = np.flatnonzero(excited)
        inside &= (np.arange(freq.size) >= at[0]) & (np.arange(freq.size) <= at[-1])
    return excited, inside


def _solved(
    data: TimeData, X: ComplexArray, ins: list[int], outs: list[int], n_real: int
) -> tuple[ComplexArray, FloatArray]:
    """FRF of every realisation (n_real, n_freq, n_out, n_in) and the noise variance of each, of the same shape."""
    count, n_in = X.shape[1], len(ins)
    Z = X.reshape(n_real, n_in, *X.shape[1:])  # realisation, experiment, period, channel, line
    mean = Z.mean(axis=2)
    U = np.moveaxis(mean[:, :, ins], (1, 3), (3, 1))  # realisation, line, input, experiment
    Y = np.moveaxis(mean[:, :, outs], (1, 3), (3, 1))
    if n_in > 1:
        condition = np.linalg.cond(U)
        if condition.max() > 1e6:
            raise SignalError(
                f"recording {data.name!r}: the {n_in} forces of a realisation are not independent (condition "
                f"{plain(condition.max(), 3)}); change their signs or phases from record to record",
                recording=data.name,
            )
    inverse = np.linalg.inv(U)
    H = Y @ inverse
    # per period: residuals of outputs against the mean's FRF carry the noise of outputs and inputs alike
    Ud = np.moveaxis(Z[:, :, :, ins], (2, 4), (1, 2)).swapaxes(3, 4)  # realisation, period, line, input, experiment
    Yd = np.moveaxis(Z[:, :, :, outs], (2, 4), (1, 2)).swapaxes(3, 4)
    E = Yd - H[:, None] @ Ud  # zero on average
    variance = (np.abs(E) ** 2).sum(axis=1) / (count - 1) / count  # of the mean of the periods, per experiment
    return H, np.asarray(variance @ np.abs(inverse) ** 2)
