"""Auto and cross spectra, correlation functions and half spectra of responses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from femend.data import Channel, Spectra, TimeData
from femend.errors import SignalError
from femend.signal.blocks import cut_blocks
from femend.signal.windows import Window, exponential_window

__all__ = ["Correlations", "SpectralMatrix", "autospectra", "correlations", "cross_spectra", "half_spectra"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False)
class SpectralMatrix:
    """Spectra `S` (n_freq, n_ch, n_ref) of `channels` with `references` at `freq` (n_freq,) Hz, unit^2/Hz.

    `kind` is "psd" (one-sided density, E[y conj(ref)]) or "half" (transform of the positive lags, which has the
    structure's poles only once). `n_averages` is what the averages are worth; an exponential window has added `decay`
    (1/s) to zeta omega of every mode (`without_window` takes it out).
    """

    name: str
    freq: FloatArray
    S: ComplexArray
    channels: tuple[Channel, ...]
    references: tuple[Channel, ...]
    kind: str
    n_averages: float
    decay: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Correlations:
    """Correlation functions `R` (n_lags, n_ch, n_ref) at lags 0, dt, 2 dt ...: E[y(t + lag) ref(t)] of `n_samples`."""

    name: str
    dt: float
    R: FloatArray
    channels: tuple[Channel, ...]
    references: tuple[Channel, ...]
    n_samples: int


def autospectra(
    data: TimeData, *, resolution: float | None = None, overlap: float = 0.5, window: str | Window = "hann"
) -> Spectra:
    """One-sided power spectral density of every channel of `data`, in unit^2/Hz.

    `resolution`, `overlap` and `window` are those of `cut_blocks`, which says what SignalError is raised for. The sum
    of the density times the step is the mean square.
    """
    blocks = cut_blocks(data, resolution=resolution, overlap=overlap, window=window)
    rows = list(range(len(data.channels)))
    return Spectra(data.name, blocks.freq, blocks.auto(rows).T.astype(complex), data.channels, "psd")


def cross_spectra(
    data: TimeData,
    references: Sequence[int] | None = None,
    *,
    resolution: float | None = None,
    overlap: float = 0.5,
    window: str | Window = "hann",
) -> SpectralMatrix:
    """One-sided cross spectral densities of all channels of `data` with the rows `references` (default all).

    `resolution`, `overlap` and `window` are those of `cut_blocks`, which says what SignalError is raised for.
    """
    chosen = list(range(len(data.channels))) if references is None else list(references)
    blocks = cut_blocks(data, resolution=resolution, overlap=overlap, window=window)
    S = blocks.cross(list(range(len(data.channels))), chosen)
    refs = tuple(data.channels[i] for i in chosen)
    return SpectralMatrix(data.name, blocks.freq, S, data.channels, refs, "psd", blocks.n_averages, blocks.decay)


def correlations(data: TimeData, n_lags: int, references: Sequence[int] | None = None) -> Correlations:
    """Correlation functions of all channels of `data` with the rows `references` (default all) at `n_lags` lags.

    Means are taken out; every lag is divided by the number of products in it, so that it is unbiased (Bendat and
    Piersol, Random Data, 4th ed., eq. 11.96). Raises SignalError for fewer than two lags or more than half the record.
    """
    if not 2 <= n_lags <= data.n_samples // 2:
        raise SignalError(
            f"recording {data.name!r}: {n_lags} lags of {data.n_samples} samples; take 2 to {data.n_samples // 2}",
            recording=data.name,
        )
    chosen = list(range(len(data.channels))) if references is None else list(references)
    x = data.values - data.values.mean(axis=1, keepdims=True)
    n = data.n_samples
    size = next_fast_len(n + n_lags, real=True)
    X = np.fft.rfft(x, size, axis=1)
    count = n - np.arange(n_lags)
    R = np.empty((n_lags, len(x), len(chosen)))
    for j, ref in enumerate(chosen):
        R[:, :, j] = (np.fft.irfft(X * X[ref].conj(), size, axis=1)[:, :n_lags] / count).T
    return Correlations(data.name, data.dt, R, data.channels, tuple(data.channels[i] for i in chosen), n)


def half_spectra(given: Correlations, *, end: float = 0.01) -> SpectralMatrix:
    """Half spectra of the correlation functions `given`: their positive lags under an exponential window, transformed.

    S+(omega) = dt (R_0 / 2 + sum_k R_k exp(-decay t_k) exp(-i omega t_k)) (Cauberghe, PhD thesis, VUB 2004, ch. 3): of
    the form sum_m phi_m g_m^T / (i omega - lambda_m), so that what fits FRFs fits it too. The window falls to `end` at
    the last lag; 1 is no window. Raises SignalError for an `end` outside (0, 1].
    """
    n = len(given.R)
    window = exponential_window(n, given.dt, end)
    R = given.R * window.values[:, None, None]
    R[0] *= 0.5
    S = given.dt * np.fft.rfft(R, axis=0)
    freq = np.asarray(np.fft.rfftfreq(n, given.dt), dtype=np.float64)
    averages = given.n_samples / n
    return SpectralMatrix(given.name, freq, S, given.channels, given.references, "half", averages, window.decay)
