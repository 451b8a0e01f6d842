"""FRFs are compared where the force explains the responses."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from femend import Channel, Dof, Recording, TimeData
from femend.bench.reading.measured import _excited
from femend.diagnose.staged.prepare import excited_band, frf_data
from femend.estimate.frf import coherent_band
from femend.signal import estimate_frf

RATE, BAND = 512.0, (20.0, 80.0)


@pytest.fixture(scope="module")
def shaken() -> Recording:
    """A mass on a spring of 40 Hz, shaken by noise of 20 to 80 Hz; noise of 1 % on both channels."""
    rng, n = np.random.default_rng(5), int(60 * RATE)
    taps = signal.firwin(1001, BAND, pass_zero=False, window=("kaiser", 12.0), fs=RATE)
    u = signal.fftconvolve(rng.standard_normal(n), taps, "same")
    w, W = 2 * np.pi * np.fft.rfftfreq(n, 1 / RATE), 2 * np.pi * 40.0
    a = np.fft.irfft(np.fft.rfft(u) * -(w**2) / (W**2 - w**2 + 0.04j * W * w), n)
    values = np.array([u, a]) * 1.0
    values += 0.01 * values.std(axis=1, keepdims=True) * rng.standard_normal(values.shape)
    channels = (Channel(Dof(1, 3), "force", "N"), Channel(Dof(1, 3), "acceleration", "m/s^2"))
    return Recording("shaken", TimeData("shaken", 1 / RATE, values, channels))


def test_lines_outside_the_band_of_the_force_are_left_out(shaken: Recording) -> None:
    data = frf_data(shaken)
    assert data.freq[0] > 0.8 * BAND[0]
    assert data.freq[-1] < 1.1 * BAND[1]


def test_a_band_that_goes_beyond_the_force_is_told_and_cut(shaken: Recording) -> None:
    frf = estimate_frf(shaken.time).frf
    used, told = _excited("shaken", frf, frf.band(5.0, 200.0))
    assert used.freq[-1] < 1.1 * BAND[1]
    assert "'shaken': the force excited" in told[0]
    assert "narrow the band" in told[0]
    inside = frf.band(25.0, 70.0)
    assert _excited("shaken", frf, inside) == (inside, ())


def test_without_coherence_nothing_is_told() -> None:
    freq = np.arange(1.0, 101.0)
    assert coherent_band(freq, np.full((100, 3), 0.2)) is None
    assert coherent_band(freq, np.where(freq[:, None] < 60, 0.9, 0.1) * np.ones((1, 3))) == (1.0, 59.0)
    frf = estimate_frf(
        TimeData(
            "u", 0.01, np.random.default_rng(1).standard_normal((2, 1000)),
            (Channel(Dof(1, 3), "force", "N"), Channel(Dof(1, 3), "acceleration", "m/s^2")),
        )
    ).frf  # fmt: skip
    assert excited_band(frf) is None
