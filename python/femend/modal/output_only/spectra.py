"""Spectral density of the responses: matrices over frequency, and peaks that stand out of their scatter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from femend.data.bands import within_band

__all__ = ["clear_peaks", "segment_spectra", "spectral_peaks"]

# A peak counts when it stands this many standard deviations of the log spectrum over its saddles: of some hundred
# maxima of pure noise fewer than one does.
PEAK_SIGMAS = 4.0
# Probability that scatter alone makes a clear peak anywhere in the spectrum of a record.
FALSE_ALARM = 0.01
# Widths in lines that a peak is looked at in, each to be told from flanks at least so wide on either side, beyond the
# lines that Hann's window spreads a line to.
WIDTHS, FLANK, SPREAD = (1, 3, 9, 27, 81), 9, 2
# Squared correlation of Hann-windowed white noise one and two lines apart: (2/3)^2 and (1/6)^2.
LINE_CORRELATION = (4 / 9, 1 / 36)


def segment_spectra(
    y: NDArray[np.float64], length: int, dt: float
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Frequencies (n_freq,) in Hz and Hann-windowed, half-overlapping Fourier segments (n_seg, n_freq, n_ch) of `y`
    (n_ch, n_samples), `length` samples each of step `dt` s, scaled so that the mean of Y Y^H is the one-sided
    density per Hz (Welch)."""
    window = signal.get_window("hann", length)
    hop = length // 2
    n_seg = (y.shape[1] - length) // hop + 1
    at = hop * np.arange(n_seg)[:, None] + np.arange(length)
    scale = float(np.sqrt(2 * dt / (window**2).sum()))
    Y = np.empty((n_seg, length // 2 + 1, y.shape[0]), dtype=np.complex128)
    for channel, row in enumerate(y):
        part = row[at]
        Y[:, :, channel] = np.fft.rfft((part - part.mean(axis=1, keepdims=True)) * window, axis=1)
    Y *= scale
    return np.arange(length // 2 + 1) / (length * dt), Y


def spectral_peaks(
    y: NDArray[np.float64], dt: float, band: tuple[float, float], n_averages: int = 9
) -> NDArray[np.float64]:
    """Frequencies (n,) in Hz of the peaks inside `band` of the summed spectral density of `y` (n_ch, n_samples),
    sampled with `dt` s, each channel of unit variance, from `n_averages` half-overlapping segments. A peak must stand
    out by PEAK_SIGMAS times the standard deviation sqrt(2 / n_averages) of a difference of log densities."""
    freq, power, n_seg = _summed(y, dt, n_averages)
    if not freq.size:
        return np.empty(0)
    inside = within_band(freq, band) & (np.arange(freq.size) >= 2)
    found = _maxima(np.log(power[inside]), n_seg)
    return np.asarray(freq[inside][found])


def clear_peaks(
    y: NDArray[np.float64], dt: float, band: tuple[float, float], n_averages: int = 9
) -> NDArray[np.float64]:
    """Frequencies (n,) in Hz of those of the `spectral_peaks` of `y` (n_ch, n_samples) that scatter does not make: the
    probability of one in a whole record whose spectrum is smooth is FALSE_ALARM.

    Of a smooth spectrum the mean of some lines over that of the lines on either side (the geometric mean of both, so
    that a slope makes no peak) is distributed as F, with two degrees of freedom for every independent average and line:
    half-overlapping Hann segments and neighbouring lines count as what their correlation leaves of them (Welch, IEEE
    Trans. Audio Electroacoust. 15 (1967) 70), and all channels as one, since they may move together. Every line in the
    band may be the largest one, in each of WIDTHS: the probability is shared by all of these (Bonferroni).
    """
    freq, power, n_seg = _summed(y, dt, n_averages)
    if not freq.size:
        return np.empty(0)
    lines = np.flatnonzero(within_band(freq, band) & (np.arange(freq.size) >= 2))
    if not lines.size:
        return np.empty(0)
    own = power[lines]
    limit = FALSE_ALARM / (lines.size * len(WIDTHS))
    # a segment shares (1/6)^2 of its power with the next, which overlaps it by half
    averages = n_seg / (1 + 2 * (1 - 1 / n_seg) * LINE_CORRELATION[1])
    found = [k for k in _maxima(np.log(own), n_seg) if any(_chance(own, int(k), w, averages) < limit for w in WIDTHS)]
    return np.asarray(freq[lines][found])


def _summed(y: NDArray[np.float64], dt: float, n_averages: int) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Frequencies (n_freq,) in Hz, density (n_freq,) summed over the channels of `y`, and the number of segments; none
    of a record that is too short."""
    length = 2 * y.shape[1] // (n_averages + 1)
    if length < 16:
        return np.empty(0), np.empty(0), 0
    freq, Y = segment_spectra(y, length, dt)
    return freq, (np.abs(Y) ** 2).mean(axis=0).sum(axis=1) + np.finfo(float).tiny, len(Y)


def _maxima(level: NDArray[np.float64], n_seg: int) -> NDArray[np.int64]:
    """Positions of the maxima of a log density from `n_seg` segments that stand PEAK_SIGMAS over their saddles."""
    return np.asarray(signal.find_peaks(level, prominence=PEAK_SIGMAS * np.sqrt(2.0 / n_seg))[0], dtype=np.int64)


def _chance(power: NDArray[np.float64], k: int, width: int, averages: float) -> float:
    """Probability that scatter makes `width` lines around line `k` of a density as large beside their flanks; 1 where
    there is no room for these."""
    from scipy import stats

    half, flank = width // 2, max(width, FLANK)
    left = power[max(k - half - SPREAD - flank, 0) : max(k - half - SPREAD, 0)]
    right = power[k + half + SPREAD + 1 : k + half + SPREAD + 1 + flank]
    if len(left) < flank or len(right) < flank:
        return 1.0
    ratio = power[k - half : k + half + 1].mean() / np.sqrt(left.mean() * right.mean())
    beside = 2 * _independent(flank)
    return float(stats.f.sf(ratio, 2 * averages * _independent(width), 2 * averages * beside))


def _independent(width: int) -> float:
    """Independent values that the power of so many neighbouring lines is worth."""
    shared = sum(max(1 - (i + 1) / width, 0.0) * rho for i, rho in enumerate(LINE_CORRELATION))
    return width / (1 + 2 * shared)
