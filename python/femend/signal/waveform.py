"""Angle of a shaft from the whole waveform of its tacho, for pulses that are short against a sample, and for soft ones.

Edges of short pulses cannot be interpolated: on a flank that falls between two samples the crossing is anywhere. On a
soft flank the crossing moves with noise, and with the height of the pulse, which a filter lowers as the shaft gets
faster. The pulse has one shape over the angle, though, which all revolutions together sample finely; every revolution
is shifted to fit it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from scipy.interpolate import BSpline
from scipy.sparse import csc_array
from scipy.sparse.linalg import spsolve

from femend.signal.curve import smooth_curve

__all__ = [
    "align_waveform",
    "flank_share",
    "is_band_limited",
    "refined",
    "samples_per_pulse",
    "thinned",
    "zero_where_it_rises",
]

FloatArray = NDArray[np.float64]

# bins of the waveform per pulse; shifts tried, in pulses; pulses whose misfit is added up for a coarse shift
BINS, REACH, TRIED, WINDOW = 120, 0.1, 61, 9
# steps of the shift over which the misfit must rise
SEEN = 6
# share of the pulses, those with most samples, that make the waveform; coarse and fine rounds
BEST, COARSE, FINE = 0.35, 3, 5
# smoothing of the first rounds, in pulses: where the shaft turns in whole samples, pulses that show a plateau only
# would hold the speed at that
STIFF = (1e4, 1e4, 1e3, 1e3, 1e2, 0.0)
# samples per interval beyond which neighbours are averaged before soft pulses are fitted, two to a bin, and samples
# that a pulse with its flanks keeps
PLENTY, KEPT = 2 * BINS, 40.0
# bands, in sampling rates, and the share of the mean power in the one that the other has at most where a recorder has
# filtered the tacho: 0.004 to 0.015 behind filters of order 2 to 10 at 0.23 to 0.45 of the rate, 0.03 to 0.11 of sharp
# pulses picked without one, which fold back
INNER, TOP, LIMITED = (0.05, 0.25), (0.475, 0.5), 0.02
# deviations within which a bin is not told from the highest or lowest one
TOLD = 3.0


def samples_per_pulse(x: FloatArray, n_pulses: int) -> float:
    """Twice the samples on the rarer side of the middle of the range of `x` (n_samples,), for each of `n_pulses`: with
    the flanks, what a pulse shows of itself."""
    above = int((x > 0.5 * (float(x.max()) + float(x.min()))).sum())
    return 2 * min(above, x.size - above) / max(n_pulses, 1)


def flank_share(x: FloatArray) -> float:
    """Share of the time in which `x` (n_samples,) is in the middle half of its range: on a flank, where it has pulses
    of two levels."""
    low, high = np.percentile(x, [1, 99])
    if high - low < 0.5 * np.ptp(x):  # pulses narrower than 1 % of the time
        low, high = float(x.min()), float(x.max())
    z = (x - low) / (high - low) if high > low else np.zeros(x.size)
    return float(((z > 0.25) & (z < 0.75)).mean())


def align_waveform(
    x: FloatArray,
    t: FloatArray,
    curve: BSpline,
    interval: float,
    ppr: int,
    smoothing: float | None,
    *,
    soft: bool = False,
) -> tuple[BSpline, bool]:
    """The pulse number over t / `interval` that makes `x` (n,) at `t` (n,) s one waveform of the shaft's angle.

    `curve` is the number found from edges, smoothed; it is returned, with False, where nothing becomes better. One
    revolution has `ppr` pulses; `smoothing` is that of `speed_from_edges`. Number 0 is where the waveform rises
    through the middle of its range. `soft` says that edges are interpolated well enough to begin with: they are shifted
    by little, and the curve is as smooth as `smoothing` says from the first round on.
    """
    u = t / interval
    z = (x - x.min()) / np.ptp(x)
    number = curve(u)
    before, n_bins = _misfit(z, number, ppr, BINS * ppr), BINS * ppr
    edges = np.arange(np.ceil(number[0]), np.floor(number[-1]) + 1)  # one shift per pulse, about whole numbers
    for step in range(COARSE if soft else 0, COARSE + FINE):
        at = np.interp(edges, number, u)
        wave = _waveform(z, number, ppr, n_bins)
        pulse = np.clip(np.rint(number - edges[0]).astype(np.int64), 0, edges.size - 1)
        shift, weight = (_coarse if step < COARSE else _fine)(z, number, pulse, edges.size, wave, ppr)
        wanted = curve(at) + shift
        stiff = 0.0 if soft else STIFF[min(step, len(STIFF) - 1)]
        curve_new = smooth_curve(at, wanted, weight, smoothing if smoothing is None else max(smoothing, stiff))
        if not (np.diff(curve_new(u)) > 0).all():
            return curve, False
        curve, number = curve_new, curve_new(u)
    if not _misfit(z, number, ppr, n_bins) < before:
        return curve, False
    return zero_where_it_rises(x, t, curve, interval, ppr), True


def zero_where_it_rises(x: FloatArray, t: FloatArray, curve: BSpline, interval: float, ppr: int) -> BSpline:
    """The pulse number `curve` over t / `interval`, shifted so that number 0 is where the waveform of `x` (n,) at `t`
    (n,) s rises through the middle between its levels."""
    z = (x - x.min()) / np.ptp(x)
    number, n_bins = curve(t / interval), BINS * ppr
    wave = _waveform(z, number, ppr, n_bins)
    slow = _slow(number)
    left = z[slow] - _value(wave, number[slow], ppr)
    # bins are means of the samples around them; hats share their samples with both neighbours
    sd = float(np.sqrt(np.mean(left**2) * np.sqrt(3.0) * n_bins / left.size))
    return BSpline(curve.t, curve.c - _rise(_without_noise(wave, sd), ppr, sd), curve.k)


def _without_noise(wave: FloatArray, sd: float) -> FloatArray:
    """A waveform (n_bins,) whose bins have the deviation `sd`, without the harmonics of a revolution that noise hides:
    of a sine that is all but one."""
    harmonics = np.fft.rfft(wave)
    power = 0.5 * sd**2 * wave.size  # of noise, in the real and in the imaginary part each
    harmonics[np.abs(harmonics) ** 2 < 2 * TOLD**2 * power] = 0.0
    return np.asarray(np.fft.irfft(harmonics, wave.size))


def _levels(wave: FloatArray, sd: float) -> tuple[float, float]:
    """Base and top of a waveform (n_bins,) whose bins have the deviation `sd`: the means of what noise does not tell
    from the lowest and the highest bin, which by themselves are off by noise, the side that lasts longer by more."""
    return float(wave[wave <= wave.min() + TOLD * sd].mean()), float(wave[wave >= wave.max() - TOLD * sd].mean())


def is_band_limited(x: FloatArray) -> bool:
    """Does next to nothing of `x` (n_samples,) reach half the sampling rate, as behind a recorder's filter? Then its
    samples determine what lies between them."""
    freq, power = signal.welch(x - x.mean(), 1.0, nperseg=min(1024, x.size))
    inner, top = (power[(freq >= a) & (freq <= b)] for a, b in (INNER, TOP))
    return bool(inner.size and top.size and top.mean() < LIMITED * inner.mean())


def refined(x: FloatArray, step: int) -> FloatArray:
    """`x` (n,) with `step` - 1 samples more between every two, which hold what lies there where it is limited in band
    (`is_band_limited`); the time of the first stays."""
    return np.asarray(signal.resample_poly(x, step, 1, padtype="line"))[: (x.size - 1) * step + 1]


def thinned(x: FloatArray, t: FloatArray, n_pulses: int) -> tuple[FloatArray, FloatArray]:
    """Means of neighbours where `x` (n,) at `t` (n,) s has more samples per pulse than a waveform takes, and as long as
    a pulse, which may be short against its interval, keeps enough of them."""
    step = min(-(-x.size // (max(n_pulses, 1) * PLENTY)), max(1, int(samples_per_pulse(x, n_pulses) / KEPT)))
    whole = x.size // step * step
    return x[:whole].reshape(-1, step).mean(axis=1), t[:whole].reshape(-1, step).mean(axis=1)


def _hats(number: FloatArray, ppr: int, n_bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Bins on both sides of the samples within the revolution, and the share of the upper one."""
    place = np.mod(number, ppr) * (n_bins / ppr)
    lower = np.minimum(place.astype(np.int64), n_bins - 1)
    return lower, (lower + 1) % n_bins, place - lower


def _slow(number: FloatArray) -> NDArray[np.bool_]:
    """The samples (n,) of the slowest pulses, which have most samples."""
    step = np.gradient(number)  # pulses per sample
    return np.asarray(step <= np.quantile(step, BEST))


def _waveform(z: FloatArray, number: FloatArray, ppr: int, n_bins: int, slow_only: bool = True) -> FloatArray:
    """Piecewise linear waveform (n_bins,) over one revolution by least squares, from the pulses with most samples."""
    if slow_only:
        slow = _slow(number)
        z, number = z[slow], number[slow]
    lower, upper, share = _hats(number, ppr, n_bins)
    diagonal = np.bincount(lower, (1 - share) ** 2, n_bins) + np.bincount(upper, share**2, n_bins)
    right = np.bincount(lower, (1 - share) * z, n_bins) + np.bincount(upper, share * z, n_bins)
    coupled = np.bincount(lower, share * (1 - share), n_bins)
    ridge = 1e-3 * len(z) / n_bins  # bins without a sample take their neighbours' mean
    bins = np.arange(n_bins)
    after = (bins + 1) % n_bins
    rows, columns = np.concatenate([bins, bins, after]), np.concatenate([bins, after, bins])
    entries = np.concatenate([diagonal + 2 * ridge, coupled - ridge, coupled - ridge])
    matrix = csc_array((entries, (rows, columns)), shape=(n_bins, n_bins))
    return np.asarray(spsolve(matrix, right))


def _value(wave: FloatArray, number: FloatArray, ppr: int) -> FloatArray:
    lower, upper, share = _hats(number, ppr, wave.size)
    return np.asarray(wave[lower] * (1 - share) + wave[upper] * share)


def _misfit(z: FloatArray, number: FloatArray, ppr: int, n_bins: int) -> float:
    return float(((z - _value(_waveform(z, number, ppr, n_bins, False), number, ppr)) ** 2).sum())


def _coarse(
    z: FloatArray, number: FloatArray, pulse: NDArray[np.int64], count: int, wave: FloatArray, ppr: int
) -> tuple[FloatArray, FloatArray]:
    """Shift (count,) of every pulse by the least misfit of the WINDOW pulses around it, among those tried."""
    tried = np.linspace(-REACH, REACH, TRIED)
    cost = np.array([np.bincount(pulse, (z - _value(wave, number + s, ppr)) ** 2, count) for s in tried])
    kernel = np.ones(min(WINDOW, count))
    cost = np.array([np.convolve(row, kernel, "same") for row in cost])
    at = np.clip(np.argmin(cost, axis=0), 1, TRIED - 2)
    rows = np.arange(count)
    left, middle, right = cost[at - 1, rows], cost[at, rows], cost[at + 1, rows]
    bend = np.maximum(left - 2 * middle + right, 1e-12)
    shift = tried[at] + np.clip(0.5 * (left - right) / bend, -1, 1) * (tried[1] - tried[0])
    # a shift is known as well as the misfit rises around it
    below, above = np.maximum(at - SEEN, 0), np.minimum(at + SEEN, TRIED - 1)
    wide = np.minimum(cost[below, rows], cost[above, rows]) - middle
    return shift, np.maximum(wide / max(float(wide.mean()), 1e-300), 1e-3)


def _fine(
    z: FloatArray, number: FloatArray, pulse: NDArray[np.int64], count: int, wave: FloatArray, ppr: int
) -> tuple[FloatArray, FloatArray]:
    """Shift (count,) of every pulse by one Gauss-Newton step, and the weight (count,) that its samples give it."""
    h = 0.25 * ppr / wave.size
    slope = (_value(wave, number + h, ppr) - _value(wave, number - h, ppr)) / (2 * h)
    known = np.bincount(pulse, slope**2, count)
    gain = np.bincount(pulse, slope * (z - _value(wave, number, ppr)), count)
    typical = float(known.mean())
    shift = np.clip(gain / (known + 0.05 * typical), -0.05, 0.05)
    return shift, np.maximum(known / typical, 1e-3)


def _rise(wave: FloatArray, ppr: int, sd: float) -> float:
    """Number, nearest 0, at which the waveform rises through the middle between its levels."""
    finer = np.arange(-wave.size // (2 * ppr), wave.size // (2 * ppr) + 1)
    values = wave[finer % wave.size] - 0.5 * sum(_levels(wave, sd))
    rises = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    if not rises.size:
        return 0.0
    at = finer[rises] - values[rises] / (values[rises + 1] - values[rises])
    return float(at[np.argmin(np.abs(at))] * ppr / wave.size)
