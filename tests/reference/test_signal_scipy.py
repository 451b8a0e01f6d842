"""Spectra, FRFs and filters as scipy has them."""

from __future__ import annotations

import numpy as np
import scipy.signal as ss

from femend.data import Channel, TimeData
from femend.dof import Dof
from femend.signal import autospectra, cross_spectra, h1, h2

RATE = 256.0
RNG = np.random.default_rng(3)
X = RNG.standard_normal(8192)
Y = ss.lfilter([1.0, 0.4], [1.0, -1.2, 0.8], X) + 0.3 * RNG.standard_normal(8192)
DATA = TimeData(
    "r",
    1 / RATE,
    [X, Y],
    [Channel(Dof(1, 3), "force", "N"), Channel(Dof(1, 3), "acceleration", "m/s^2")],
)
WELCH = {"fs": RATE, "nperseg": 512, "noverlap": 256, "window": "hann", "detrend": "constant"}


def test_auto_and_cross_spectra() -> None:
    freq, Pyy = ss.welch(Y, **WELCH)
    ours = autospectra(DATA, resolution=0.5)
    assert np.array_equal(ours.freq, freq)
    assert np.abs(ours.values[1].real - Pyy).max() < 1e-12 * Pyy.max()
    _, Pxy = ss.csd(X, Y, **WELCH)  # scipy: conj(X) Y
    S = cross_spectra(DATA, resolution=0.5).S
    assert np.abs(S[:, 1, 0] - Pxy).max() < 1e-12 * np.abs(Pxy).max()


def test_frf_and_coherence() -> None:
    freq, Pxy = ss.csd(X, Y, **WELCH)
    Pxx, Pyy = ss.welch(X, **WELCH)[1], ss.welch(Y, **WELCH)[1]
    coherence = ss.coherence(X, Y, **WELCH)[1]
    one, two = h1(DATA, resolution=0.5), h2(DATA, resolution=0.5)
    assert np.array_equal(one.freq, freq[1:])
    assert np.abs(one.H[:, 0, 0] - (Pxy / Pxx)[1:]).max() < 1e-11 * np.abs(one.H).max()
    assert np.abs(two.H[:, 0, 0] - (Pyy / Pxy.conj())[1:]).max() < 1e-11 * np.abs(two.H).max()
    assert one.coherence is not None
    assert np.abs(one.coherence[:, 0, 0] - coherence[1:]).max() < 1e-11
