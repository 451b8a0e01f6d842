"""FRF estimators against structures whose FRFs are known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import Channel, TimeData
from femend.dof import Dof
from femend.errors import SignalError
from femend.signal import estimate_frf, exponential_window, h1, h2, hv, make_window, without_window

from .signal_models import accelerance, acceleration, force, measured

DT = 1 / 256


def random_force(n_in: int = 1, n: int = 2**17, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((n_in, n))


def away(freq: np.ndarray) -> np.ndarray:
    """Lines where the Hann window's leakage at the two resonances is small: more than a Hertz away from them."""
    return (freq > 4) & (freq < 60) & (np.abs(freq - 12) > 1.5) & (np.abs(freq - 31) > 2)


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
@pytest.mark.parametrize("n_in", [1, 2])
def test_without_noise_every_estimator_finds_the_structure(estimator: str, n_in: int) -> None:
    found = estimate_frf(measured(random_force(n_in), DT), estimator, resolution=1 / 8)
    true = accelerance(found.frf.freq, DT, n_in)
    error = np.abs(found.frf.H - true)[away(found.frf.freq)]
    # what a Hann window of 8 s leaks at half-power widths of 0.5 and 0.9 Hz; two inputs share the averages
    assert error.max() < 0.03 * np.abs(true[away(found.frf.freq)]).max()
    assert found.frf.kind == "accelerance"
    assert found.frf.unit == "m/s^2/N"


def test_noise_on_the_response_biases_h2_up_and_h1_not() -> None:
    data = measured(random_force(), DT, noise=0.5)
    freq = h1(data, resolution=0.25).freq
    keep = away(freq)
    true = accelerance(freq, DT, 1)[keep, 0, 0]
    ratio = {f: np.mean(np.abs(f(data, resolution=0.25).H[keep, 0, 0])) / np.mean(np.abs(true)) for f in (h1, h2, hv)}
    assert ratio[h1] == pytest.approx(1, abs=0.02)  # random error of 500 averages on 400 lines
    assert ratio[h2] > 1.2
    assert ratio[h1] < ratio[hv] < ratio[h2]


def test_noise_on_the_force_biases_h1_down_and_h2_not() -> None:
    data = measured(random_force(), DT, noise_in=0.5)
    freq = h1(data, resolution=0.25).freq
    keep = away(freq)
    true = np.mean(np.abs(accelerance(freq, DT, 1)[keep, 1, 0]))
    assert np.mean(np.abs(h2(data, resolution=0.25).H[keep, 1, 0])) / true == pytest.approx(1, abs=0.02)
    # H1 -> H / (1 + noise power) = H / 1.25
    assert np.mean(np.abs(h1(data, resolution=0.25).H[keep, 1, 0])) / true == pytest.approx(0.8, abs=0.02)


@pytest.mark.parametrize("n_in", [1, 2])
def test_the_variance_is_what_repeated_estimates_scatter_by(n_in: int) -> None:
    found = [
        estimate_frf(measured(random_force(n_in, 2**13, seed), DT, 0.4, seed=seed + 99), resolution=0.5)
        for seed in range(30)
    ]
    keep = away(found[0].frf.freq)
    scatter = np.array([f.frf.H[keep] for f in found]).var(axis=0, ddof=1)
    told = np.array([f.variance[keep] for f in found]).mean(axis=0)
    # mean over 80 lines and 30 repeats: the ratio is known to a few per cent, leakage adds scatter that is not told
    assert scatter.mean() / told.mean() == pytest.approx(1, abs=0.15)


def test_multiple_coherence_counts_both_inputs_and_the_ordinary_one_each() -> None:
    found = estimate_frf(measured(random_force(2), DT), resolution=0.25)
    keep = away(found.frf.freq)
    assert found.multiple[keep].min() > 0.97  # noise-free: what is missing is leakage
    true = accelerance(found.frf.freq[keep], DT, 2)
    share = np.abs(true) ** 2 / (np.abs(true) ** 2).sum(axis=2, keepdims=True)  # of independent forces of one size
    assert np.abs(found.ordinary[keep] - share).mean() < 0.03
    assert np.array_equal(found.frf.coherence[:, :, 0], found.multiple)


def test_coherence_tells_the_noise() -> None:
    found = estimate_frf(measured(random_force(), DT, noise=0.5), resolution=0.25)
    keep = away(found.frf.freq)
    power = np.abs(accelerance(found.frf.freq[keep], DT, 1)[:, :, 0]) ** 2
    assert np.abs(found.multiple[keep] - power / (power + 0.25)).mean() < 0.02


def test_inputs_that_are_one_are_refused_by_name() -> None:
    f = random_force()
    data = measured(np.vstack([f, 2 * f]), DT)
    with pytest.raises(SignalError, match=r"force 1:\+Z \(f1\), force 2:\+Z \(f2\) move as one on \d+ of"):
        estimate_frf(data)
    dead = data.with_values(np.vstack([data.values[:1], np.zeros((1, data.n_samples)), data.values[2:]]))
    with pytest.raises(SignalError, match=r"force 2:\+Z \(f2\) does not move"):
        estimate_frf(dead)
    mute = data.with_values(np.vstack([data.values[:3], np.zeros((1, data.n_samples))]))
    with pytest.raises(SignalError, match=r"acceleration 2:\+Z \(a2\) is 0 in all"):
        estimate_frf(mute, inputs=[0])


def test_what_makes_no_frf_is_refused() -> None:
    data = measured(random_force(n=4096), DT)
    with pytest.raises(SignalError, match="16 s is too short for a resolution of 0.05 Hz, which takes 20 s"):
        h1(data, resolution=0.05)
    with pytest.raises(SignalError, match="no force channel"):
        h1(data.select([1, 2]))
    with pytest.raises(SignalError, match="no response"):
        h1(data.select([0]))
    with pytest.raises(SignalError, match="'H3' is none of"):
        estimate_frf(data, "H3")
    with pytest.raises(SignalError, match="overlap of 1"):
        estimate_frf(data, overlap=1.0)
    mixed = TimeData("m", DT, data.values, (force(1), acceleration(1), Channel(Dof(2, 3), "velocity", "m/s")))
    with pytest.raises(SignalError, match=r"acceleration \[m/s\^2\], velocity \[m/s\]; one FRF"):
        h1(mixed)
    with pytest.raises(SignalError, match="2 averages cannot|move as one|averages cannot"):
        estimate_frf(measured(random_force(2, 512), DT), resolution=0.5, overlap=0.0)


def test_one_average_says_that_its_coherence_is_void() -> None:
    found = estimate_frf(measured(random_force(n=1024), DT), resolution=0.25)
    assert found.n_averages == 1
    assert any("one average" in note for note in found.notes)


def test_an_exponential_window_is_taken_out_of_the_damping_exactly() -> None:
    n, dt = 4096, 1 / 512
    window = exponential_window(n, dt, 0.01)
    assert window.values[-1] == pytest.approx(0.01)
    freq, zeta = 20.0, 0.01
    pole = 2 * np.pi * freq * (-zeta + 1j * np.sqrt(1 - zeta**2)) - window.decay
    back = without_window(np.array([abs(pole) / 2 / np.pi]), np.array([-pole.real / abs(pole)]), window.decay)
    assert back[0][0] == pytest.approx(freq, rel=1e-12)
    assert back[1][0] == pytest.approx(zeta, rel=1e-10)


def test_windows_that_are_none_are_refused() -> None:
    with pytest.raises(SignalError, match="window 'boxcarr' is unknown"):
        make_window("boxcarr", 8)
    with pytest.raises(SignalError, match="cannot end at 0"):
        exponential_window(10, 0.1, 0.0)
