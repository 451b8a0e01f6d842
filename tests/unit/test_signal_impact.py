"""Impact tests: hits found and judged, their FRF and its damping; periodic excitation with noise and distortion."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import TimeData
from femend.errors import SignalError
from femend.signal import estimate_frf, find_hits, find_period, impact_frf, periodic_frf

from .signal_models import accelerance, acceleration, force, measured, respond

DT = 1 / 512


def hammer(times: tuple[float, ...], seconds: float, peaks: tuple[float, ...] | None = None) -> np.ndarray:
    """Half sines of 10 ms."""
    t = DT * np.arange(int(seconds / DT))
    f = np.zeros(t.size)
    for at, peak in zip(times, peaks or (100.0,) * len(times), strict=True):
        s = t - at
        f += np.where((s > 0) & (s < 0.01), peak * np.sin(np.pi * s / 0.01), 0.0)
    return f[None]


def record(times: tuple[float, ...], seconds: float, noise: float = 0.0, **options: object) -> TimeData:
    return measured(hammer(times, seconds, **options), DT, noise, noise)  # type: ignore[arg-type]


HITS = (1.0, 9.0, 17.0, 25.0)


def test_repeated_hits_give_the_structure() -> None:
    found = impact_frf(record(HITS, 34.0, noise=0.01), 7.5)
    assert [hit.kept for hit in found.hits] == [True] * 4
    freq = found.frf.freq
    keep = (freq > 5) & (freq < 80)
    true = accelerance(freq[keep], DT, 1)
    # modes of 1.5 rad/s decay to e^-11 in a block: what is left is noise, 0.01 against a pulse of 100 for 10 ms
    assert np.abs(found.frf.H[keep] - true).max() < 0.03 * np.abs(true).max()
    assert found.decay == 0


def test_the_exponential_window_moves_the_poles_by_its_decay() -> None:
    found = impact_frf(record(HITS, 34.0), 7.5, end=0.01)
    assert found.decay == pytest.approx(np.log(100) / 7.5, rel=1e-3)
    freq = found.frf.freq
    keep = (freq > 5) & (freq < 60)
    # the window's poles: each mode with zeta omega + decay, at the same damped frequency
    moved = []
    for f, zeta, shape in ((12.0, 0.02, (0.8, 0.5)), (31.0, 0.015, (0.5, -0.9))):
        pole = 2 * np.pi * f * (-zeta + 1j * np.sqrt(1 - zeta**2)) - found.decay
        moved.append((abs(pole) / 2 / np.pi, -pole.real / abs(pole), shape))
    H = found.frf.H[keep, 0, 0]
    s = 2j * np.pi * freq[keep] + found.decay
    exact = sum(
        shape[0] ** 2 * s**2 / (s**2 + 2 * z * 2 * np.pi * f * s + (2 * np.pi * f) ** 2)
        for f, z, shape in ((12.0, 0.02, (0.8, 0.5)), (31.0, 0.015, (0.5, -0.9)))
    )
    half_sample = np.exp(-1j * np.pi * freq[keep] * DT)  # forces are held between samples
    assert np.abs(H - exact * half_sample).max() < 0.05 * np.abs(exact).max()
    assert moved[0][1] > 0.02


def test_double_hits_weak_hits_and_cut_ones_are_rejected_with_the_reason() -> None:
    f = hammer((*HITS, 9.05, 33.0, 41.0), 48.0, (100.0, 90.0, 110.0, 100.0, 30.0, 12.0, 100.0))
    found = find_hits(measured(f, DT, 0.01, 0.01), 7.5)
    assert [round(hit.time) for hit in found] == [1, 9, 17, 25, 33, 41]
    assert [hit.kept for hit in found] == [True, False, True, True, False, False]
    assert "% at 9.05" in found[1].reasons[0]
    assert "against a median" in found[4].reasons[0]
    assert "reaches beyond the record" in found[5].reasons[0]
    assert "double hit" in str(found[1])


def filtered(pulses: tuple[tuple[float, float], ...], seconds: float) -> np.ndarray:
    """Blows of 2 ms (time, peak) behind a recorder's filter that lets pass up to 0.45 of the rate: it rings by 15 %."""
    fine = 16
    t = DT / fine * np.arange(int(seconds / DT) * fine)
    f = np.zeros(t.size)
    for at, peak in pulses:
        f += np.where((t > at) & (t < at + 0.002), peak * np.sin(np.pi * (t - at) / 0.002), 0.0)
    F = np.fft.rfft(f)
    F[np.fft.rfftfreq(t.size, DT / fine) > 0.45 / DT] = 0.0
    return np.fft.irfft(F, t.size)[None, ::fine]


def test_what_a_recorders_filter_rings_is_no_second_blow() -> None:
    f = filtered(((1.0, 100.0), (5.0, 100.0), (5.05, 25.0), (9.0, 100.0)), 13.0)
    rings = f[0, int(1.0 / DT) :][:30]
    after = rings[np.argmax(rings < 0) :]
    assert after.max() > 0.05 * rings.max()
    found = find_hits(measured(f, DT, 0.0, 0.0), 3.5)
    assert [hit.kept for hit in found] == [True, False, True]
    assert "at 5.05" in found[1].reasons[0]
    # the force keeps its highest frequencies: ringing cut off by the window took 15 % of them
    both = measured(filtered(((1.0, 100.0), (5.0, 100.0)), 9.0), DT, 1e-3, 1e-3)
    found = impact_frf(both, 3.5).frf
    high = (found.freq > 180) & (found.freq < 215)
    H, whole = found.H[high], impact_frf(both, 3.5, window_force=False).frf.H[high]
    assert np.linalg.norm(H - whole) < 0.03 * np.linalg.norm(whole)


def test_overloads_are_rejected_naming_the_channel() -> None:
    data = record(HITS, 34.0, noise=0.01)
    values = np.array(data.values)
    first, last = int(17 / DT), int(24 / DT)
    values[1, first:last] = np.clip(values[1, first:last], -1e9, 0.6 * values[1, first:last].max())
    values[1] = np.minimum(values[1], values[1, first:last].max())
    found = find_hits(data.with_values(values), 7.5)
    assert not found[2].kept
    assert any("acceleration 1:+Z (a1) is overloaded at 17.0" in reason for reason in found[2].reasons)
    scale = find_hits(data, 7.5, full_scale=50.0)
    assert all("force 1:+Z (f1) is overloaded" in hit.reasons[0] for hit in scale)
    with pytest.raises(SignalError, match=r"none of 4 hits can be used: hit at 1\.\d+ s in 'test'.*overloaded"):
        impact_frf(data, 7.5, full_scale=50.0)


def test_a_record_without_hits_and_responses_that_still_ring() -> None:
    data = record(HITS, 34.0, noise=0.01)
    flat = data.with_values(np.random.default_rng(0).standard_normal(data.values.shape))
    with pytest.raises(SignalError, match="there is no hit in it"):
        find_hits(flat, 2.0)
    with pytest.raises(SignalError, match="cannot be cut into blocks of 100 s"):
        find_hits(data, 100.0)
    assert any("still ring" in note for note in impact_frf(data, 0.5).estimate.notes)
    assert not impact_frf(data, 7.5).estimate.notes


def multisine(seed: int, n: int = 1024, lines: slice = slice(3, 300, 2)) -> np.ndarray:
    """Odd random-phase multisine; every fourth odd line stays silent."""
    k = np.arange(n // 2 + 1)[lines]
    k = k[np.arange(k.size) % 4 != 3]
    U = np.zeros(n // 2 + 1, complex)
    U[k] = np.exp(2j * np.pi * np.random.default_rng(seed).random(k.size)) * n / 20
    return np.fft.irfft(U, n)


def periodic(seed: int, noise: float = 0.05, cubic: float = 0.0, periods: int = 12) -> TimeData:
    u = np.tile(multisine(seed), periods)[None]
    y = respond(u, DT)
    y = y + cubic * y**3
    rng = np.random.default_rng(seed + 1000)
    values = np.vstack([u, y + noise * rng.standard_normal(y.shape)])
    return TimeData(f"r{seed}", DT, values, (force(1), acceleration(1), acceleration(2)))


def test_the_period_is_found_and_a_random_force_refused() -> None:
    assert find_period(periodic(0)) == 1024
    noise = measured(np.random.default_rng(0).standard_normal((1, 4096)), DT)
    with pytest.raises(SignalError, match=r"force 1:\+Z \(f1\) does not repeat within 2048 samples"):
        find_period(noise)


def test_periodic_excitation_gives_the_structure_without_leakage_and_its_noise() -> None:
    found = periodic_frf([periodic(i) for i in range(8)])
    true = accelerance(found.frf.freq, DT, 1)
    error = found.frf.H - true
    told = np.sqrt(found.noise_variance)
    assert found.skipped >= 1  # the slowest mode decays by e^-3 in a period
    assert np.sqrt((np.abs(error) ** 2).mean()) == pytest.approx(np.sqrt((told**2).mean()), rel=0.25)
    assert np.abs(error / told).max() < 5
    assert found.distortion_variance is not None
    # a linear structure: total and noise variance are one
    assert found.total_variance.mean() == pytest.approx(found.noise_variance.mean(), rel=0.25)


def test_distortion_is_told_from_noise_and_odd_from_even() -> None:
    found = periodic_frf([periodic(i, noise=0.01, cubic=0.02) for i in range(8)])
    assert found.distortion_variance is not None
    assert found.total_variance.mean() > 20 * found.noise_variance.mean()
    line = np.rint(found.silent_freq * 1024 * DT).astype(int)
    ratio = (found.silent / found.silent_noise).mean(axis=1)
    assert np.median(ratio[line % 2 == 1]) > 5  # a cubic answers odd lines with odd ones
    assert np.median(ratio[line % 2 == 0]) < 2


def test_periods_that_are_too_few_or_differ_are_refused() -> None:
    with pytest.raises(SignalError, match="has 1 periods of 1024"):
        periodic_frf(periodic(0, periods=1), 1024)
    with pytest.raises(SignalError, match="1 whole periods of 1024 samples are left after 2"):
        periodic_frf(periodic(0, periods=3), 1024, skip=2)
    with pytest.raises(SignalError, match="excites no line between 200"):
        periodic_frf(periodic(0), band=(200.0, 250.0))
    other = TimeData("other", 2 * DT, periodic(1).values, periodic(1).channels)
    with pytest.raises(SignalError, match="'other' has 3 channels at 256 Hz"):
        periodic_frf([periodic(0), other])


def test_two_forces_take_two_experiments() -> None:
    def experiment(seed: int, sign: float) -> TimeData:
        u = np.vstack([np.tile(multisine(seed), 12), sign * np.tile(multisine(seed + 50), 12)])
        return measured(u, DT, noise=0.01, seed=2 * seed + (sign > 0))

    found = periodic_frf([experiment(i, s) for i in range(3) for s in (1.0, -1.0)], 1024)
    true = accelerance(found.frf.freq, DT, 2)
    assert found.frf.H.shape == true.shape
    assert np.abs(found.frf.H - true).max() < 0.01 * np.abs(true).max()
    with pytest.raises(SignalError, match="3 records are no multiple of 2 forces"):
        periodic_frf([experiment(0, 1.0), experiment(0, -1.0), experiment(1, 1.0)], 1024)
    with pytest.raises(SignalError, match="not independent"):
        periodic_frf([experiment(0, 1.0), experiment(0, 1.0)], 1024)


def test_both_ways_agree_on_a_periodic_record() -> None:
    data = periodic(0, noise=0.0, periods=24)
    found = periodic_frf(data, 1024, skip=8)
    settled = TimeData("r", DT, data.values[:, 8192:], data.channels)
    plain = estimate_frf(settled, resolution=0.5, window="none", overlap=0)
    lines = np.searchsorted(plain.frf.freq, found.frf.freq)
    assert np.abs(plain.frf.H[lines] - found.frf.H).max() < 1e-4 * np.abs(found.frf.H).max()
