"""Modes of FRFs whose lines are too far apart for them are told; those of a record that is long enough are not."""

from __future__ import annotations

import numpy as np
import pytest

from femend import Channel, Dof, Recording, TimeData
from femend.bench.reading.coarse import longer_pieces, still_rings, too_coarse
from femend.bench.reading.measured import _finer
from femend.modal import identify_modes
from femend.numerals import plain
from femend.signal import estimate_frf
from femend.signal.suited import blows, suited_frf

RATE, FREQ, ZETA = 256.0, 30.0, 0.008


def shaken(seconds: float) -> TimeData:
    """A mass on a spring under a random force, from rest, with its acceleration."""
    n = int(seconds * RATE)
    u = np.random.default_rng(3).standard_normal(n)
    w, W = 2 * np.pi * np.fft.rfftfreq(4 * n, 1 / RATE), 2 * np.pi * FREQ
    a = np.fft.irfft(np.fft.rfft(u, 4 * n) * -(w**2) / (W**2 - w**2 + 2j * ZETA * W * w), 4 * n)[:n]
    channels = (Channel(Dof(1, 3), "force", "N"), Channel(Dof(1, 3), "acceleration", "m/s^2"))
    return TimeData("shaken", 1 / RATE, np.array([u, a]), channels)


def test_a_short_record_is_told_with_the_length_it_needs() -> None:
    data = shaken(4.0)
    frf = estimate_frf(data).frf
    modes = identify_modes(frf, (10.0, 60.0)).modes
    # what is told of is true: the damping, and nothing in its deviation says so
    assert modes.zeta[0] > 1.3 * ZETA
    (told,) = too_coarse(modes, data, frf)
    assert told.startswith("mode")
    assert "pieces of 0.5 s are 2 Hz apart" in told


def test_a_record_that_is_long_enough_is_not() -> None:
    data = shaken(120.0)
    frf = estimate_frf(data).frf
    modes = identify_modes(frf, (10.0, 60.0)).modes
    assert modes.zeta[0] == pytest.approx(ZETA, rel=0.05)
    assert too_coarse(modes, data, frf) == []


def finer(data: TimeData) -> tuple[float, float]:
    """Damping from pieces of an eighth, and as it is told."""
    frf = estimate_frf(data).frf
    test = identify_modes(frf, (10.0, 60.0))
    _, again = _finer(Recording("shaken", data), frf, test, (10.0, 60.0), 0.01)
    return float(test.modes.zeta[0]), float(again.modes.zeta[0])


def test_pieces_are_longer_where_eighths_are_too_short_for_the_modes() -> None:
    before, after = finer(shaken(12.0))
    assert abs(after - ZETA) < 0.5 * abs(before - ZETA)
    # a mode that looks wide may be a narrow one between lines too far apart: the study's damping tells
    data = shaken(12.0)
    frf = estimate_frf(data).frf
    modes = identify_modes(frf, (10.0, 60.0)).modes
    assert longer_pieces(modes, data, frf, 0.005) == pytest.approx(3 / 12.0)
    long = shaken(120.0)
    assert longer_pieces(modes, long, estimate_frf(long).frf, 0.01) is None


def test_a_force_that_repeats_itself_is_taken_period_by_period() -> None:
    n = int(3.0 * RATE)
    phases = np.exp(2j * np.pi * np.random.default_rng(2).random(n // 2 + 1))
    u = np.tile(np.fft.irfft(np.where(np.arange(n // 2 + 1) < 180, phases, 0), n), 8)
    w, W = 2 * np.pi * np.fft.rfftfreq(4 * u.size, 1 / RATE), 2 * np.pi * FREQ
    a = np.fft.irfft(np.fft.rfft(u, 4 * u.size) * -(w**2) / (W**2 - w**2 + 2j * ZETA * W * w), 4 * u.size)[: u.size]
    data = shaken(24.0)
    data = TimeData("shaken", 1 / RATE, np.array([u, a]), data.channels)
    frf = estimate_frf(data, resolution=1.0).frf
    test = identify_modes(frf, (10.0, 55.0))
    found, again = _finer(Recording("shaken", data), frf, test, (10.0, 55.0), 0.01)
    assert found.freq[1] - found.freq[0] == pytest.approx(1 / 3.0)
    assert again.modes.zeta[0] == pytest.approx(ZETA, rel=0.02)


def struck(apart: float, noise: float = 1e-3) -> TimeData:
    """Eight blows some seconds apart, each at a time of its own, with the acceleration."""
    rng = np.random.default_rng(0)
    n = int((8 * apart + 0.5) * RATE)
    t = np.arange(n) / RATE
    at = 0.5 + apart * np.arange(8) + 0.05 * apart * rng.random(8)
    u = sum(np.exp(-(((t - x) / 0.003) ** 2)) for x in at)
    w, W = 2 * np.pi * np.fft.rfftfreq(4 * n, 1 / RATE), 2 * np.pi * FREQ
    a = np.fft.irfft(np.fft.rfft(u, 4 * n) * -(w**2) / (W**2 - w**2 + 2j * ZETA * W * w), 4 * n)[:n]
    channels = (Channel(Dof(1, 3), "force", "N"), Channel(Dof(1, 3), "acceleration", "m/s^2"))
    return TimeData("struck", 1 / RATE, np.array([u, a + noise * a.std() * rng.standard_normal(n)]), channels)


def test_blows_whose_answers_die_away_within_their_pieces_are_whole() -> None:
    """Their lines are as wide as the resonance, the damping is right, and it was said to come out too high."""
    data = struck(3.0)
    frf, _ = suited_frf(data)
    modes = identify_modes(frf, (10.0, 60.0)).modes
    assert 3 * (frf.freq[1] - frf.freq[0]) > 2 * ZETA * FREQ
    assert modes.zeta[0] == pytest.approx(ZETA, rel=0.01)
    assert too_coarse(modes, data, frf) == []


def test_blows_that_come_before_the_last_one_has_died_away_are_told_with_the_damping_of_the_decay() -> None:
    data = struck(0.6)
    frf, _ = suited_frf(data)
    modes = identify_modes(frf, (10.0, 60.0)).modes
    assert modes.zeta[0] > 1.05 * ZETA
    (told,) = too_coarse(modes, data, frf)
    piece = 1 / (frf.freq[1] - frf.freq[0])
    left = np.exp(-2 * np.pi * FREQ * ZETA * piece)
    assert f"of each blow: with that cut off {plain(100 * modes.zeta[0], 2)} % of damping was found" in told
    assert "is that of 0.8 %" in told
    assert still_rings(data, blows(data), piece, FREQ) == pytest.approx(left, rel=0.05)


def test_noise_after_a_decay_does_not_ring() -> None:
    data = struck(3.0, noise=0.3)
    assert still_rings(data, blows(data), 2.7, FREQ) < 0.05
