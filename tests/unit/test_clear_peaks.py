"""Peaks of the spectra of responses that scatter does not make."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from femend.modal.output_only.judge import _missed
from femend.modal.output_only.spectra import clear_peaks, spectral_peaks

DT, N, BAND = 1 / 512, 60 * 512, (5.0, 200.0)


def scatter(seed: int, n_ch: int, *, steep: bool = False) -> NDArray[np.float64]:
    """Broad excitation alone, of unit variance: white, or falling with the frequency."""
    y = np.random.default_rng(seed).standard_normal((n_ch, N))
    y = np.cumsum(y, axis=1) if steep else y
    y -= y.mean(axis=1, keepdims=True)
    return np.asarray(y / y.std(axis=1, keepdims=True))


def test_scatter_makes_no_clear_peak() -> None:
    """Of 40 records without a mode half were told to peak where no mode was found."""
    records = [scatter(seed, 1 + 5 * (seed % 2), steep=seed % 3 == 0) for seed in range(40)]
    assert sum(spectral_peaks(y, DT, BAND).size > 0 for y in records) > 10
    # one in a hundred records may: of 40 two or more do with a probability of 6 %
    assert sum(clear_peaks(y, DT, BAND).size > 0 for y in records) <= 1


def test_only_clear_peaks_are_told_as_modes_that_were_missed() -> None:
    none = SimpleNamespace(freq=np.zeros(0), zeta=np.zeros(0))
    # the first has a peak of scatter
    y = next(y for y in map(lambda seed: scatter(seed, 1), range(40)) if spectral_peaks(y, DT, BAND).size)
    tone = np.sin(2 * np.pi * 60.0 * DT * np.arange(N))
    for record, told in ((y, []), (y + 0.3 * tone, [60.0])):
        signals = SimpleNamespace(y=record, dt=DT, band=BAND, duration=N * DT)
        assert _missed(signals, none, []) == pytest.approx(told, abs=0.2)  # type: ignore[arg-type]


@pytest.mark.parametrize("zeta", [0.003, 0.03])
def test_a_weak_mode_that_stands_out_is_a_clear_peak(zeta: float) -> None:
    f = 40.0
    pole = np.exp(2 * np.pi * f * DT * (-zeta + 1j))
    own = np.random.default_rng(7).standard_normal(N)
    mode = lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], own)
    y = scatter(8, 3) + 10 * np.sqrt(zeta) * mode / mode.std() * np.array([[0.25], [0.12], [0.18]])
    peaks = clear_peaks(y / y.std(axis=1, keepdims=True), DT, BAND)
    assert peaks.size
    assert np.abs(peaks / f - 1).max() < 2 * zeta + 0.005
    # without it nothing is left of them
    assert clear_peaks(scatter(8, 3), DT, BAND).size == 0


def test_a_record_too_short_for_segments_has_none() -> None:
    assert clear_peaks(np.ones((2, 40)), DT, BAND).size == 0
