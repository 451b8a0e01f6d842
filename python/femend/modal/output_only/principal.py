"""What most of a structure's responses have in common, line by line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.modal.output_only.spectra import segment_spectra

__all__ = ["principal_responses"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# stretches of a recording whose spectra are averaged
AVERAGES = 30


def principal_responses(y: FloatArray, dt: float) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """Frequencies (n_freq,) in Hz, principal responses h (n_freq, n_ch) and what else every sensor shows, of responses
    `y` (n_ch, n_samples) at step `dt` s: the first singular vectors of their spectral density (Welch, 30 stretches)
    with every sensor of unit deviation, in the units of `y` per root of Hz. Nothing of less than 16 samples a stretch.
    """
    length = 2 * y.shape[1] // (AVERAGES + 1)
    if length < 16:
        return np.zeros(0), np.zeros((0, len(y)), dtype=np.complex128), np.zeros((0, len(y)))
    freq, Y = segment_spectra(y, length, dt)
    # what lies under the second line is the window's, what lies near half the sampling rate the filter's
    inside = np.flatnonzero((np.arange(freq.size) >= 2) & (freq <= 0.4 / dt))
    Y = Y[:, inside]
    scale = np.sqrt((np.abs(Y) ** 2).mean(axis=(0, 1)).clip(np.finfo(float).tiny))
    S = np.einsum("sfi,sfj->fij", Y / scale, (Y / scale).conj()) / len(Y)
    size, vectors = np.linalg.eigh(S)
    h = vectors[:, :, -1] * np.sqrt(size[:, -1:].clip(0.0))
    beside = np.sqrt((np.einsum("fii->fi", S).real - np.abs(h) ** 2).clip(0.0))
    return freq[inside], np.asarray(h * scale), np.asarray(beside * scale)
