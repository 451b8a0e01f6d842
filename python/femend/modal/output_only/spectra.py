"""Spectral density of the responses: matrices over frequency, and peaks that stand out of their scatter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from femend.data.bands import within_band

__all__ = ["segment_spectra", "spectral_peaks"]

# A peak counts when it stands this many standard deviations of the log spectrum over its saddles: of some hundred
# maxima of pure noise fewer than one does.
PEAK_SIGMAS = 4.0


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
    length = 2 * y.shape[1] // (n_averages + 1)
    if length < 16:
        return np.empty(0)
    freq, Y = segment_spectra(y, length, dt)
    level = np.log((np.abs(Y) ** 2).mean(axis=0).sum(axis=1) + np.finfo(float).tiny)
    inside = within_band(freq, band) & (np.arange(freq.size) >= 2)
    found, _ = signal.find_peaks(level[inside], prominence=PEAK_SIGMAS * np.sqrt(2.0 / Y.shape[0]))
    return freq[inside][found]
