"""Forces that are neither noise nor multisine: blows that come late, sweeps that pass through the band in turn."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.diagnose.deciding.power import untold
from femend.diagnose.updating.update import modelled, update_model
from femend.estimate import FitRecord, Hypothesis, at_work, in_turn, noise_of, pressed, used_band
from femend.estimate.noise import noise_in_silence
from femend.model import Model, read_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

Array = NDArray[np.float64]
DT = 1 / small_study.RATE
N, LATE = 2048, 400
BAND = small_study.BAND
# the modulus of the truth: the fifth mode is ten half-power bandwidths off
TRUE = (5.6e10, 7.7e10)


@pytest.fixture
def model(tmp_path: Path) -> Model:
    (tmp_path / "model.bdf").write_text(small_study.deck())
    return read_model(tmp_path / "model.bdf", parameters=small_study.PARAMETERS)


def blow(late: int = 0, n: int = N) -> Array:
    """A blow of some 12 ms with its force at the samples (n,), which begins `late` samples later than it could; smooth
    enough to hold nothing beyond half the sampling rate."""
    return np.asarray(20 * np.exp(-0.5 * ((np.arange(n) - late - 34) * DT / 0.0025) ** 2))


def sweep(n: int = N) -> Array:
    """A logarithmic sine sweep through the band in n samples, from rest."""
    t, low, high = np.arange(n) * DT, BAND[0], BAND[1]
    unit = n * DT / np.log(high / low)
    return np.asarray(5 * np.sin(2 * np.pi * low * unit * (np.exp(t / unit) - 1)) * np.minimum(1, np.arange(n) / 20))


def record(model: Model, u: Array, y: Array, sd: float = 0.01, name: str = "r") -> FitRecord:
    """A record of the force at the shaker with noise on the sensors."""
    rows = np.array([6 * model.index(node) + 2 for node in small_study.SENSORS])
    rng = np.random.default_rng(len(name))
    y = y + sd * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
    return FitRecord(name, u[None], y, DT, rows[-1:], rows, np.ones(1), np.ones(len(rows)), noise_of(u[None], y, 0))


def test_a_record_without_its_rest(model: Model, tmp_path: Path) -> None:
    """From the blow to where motion is lost in the noise; forces that are there all the time keep their records."""
    u = blow(LATE, 6 * N)
    late = record(model, u, small_study.respond(tmp_path, small_study.Truth(), u))
    kept = at_work(late)
    begin = next(i for i in range(late.n) if np.array_equal(kept.u, late.u[:, i : i + kept.n]))
    assert begin == pytest.approx(LATE + 30 - 8, abs=2)
    lost = np.sqrt((late.y[:, begin + kept.n :] ** 2).mean(axis=1)) / late.noise
    np.testing.assert_allclose(lost, 1.0, atol=0.1)
    assert N < kept.n < 5 * N
    hum = 0.02 * late.y.std() * np.sin(300.0 * DT * np.arange(late.n))
    assert at_work(replace(late, y=late.y + hum)).n == late.n
    for u in (small_study.force(1.0, 3, N), sweep()):
        r = record(model, u, np.ones((4, N)) * np.sin(np.arange(N)))
        assert at_work(r) is r
    assert [r.n for r in modelled(model, [late], 0.01)[2].records] == [kept.n]


def test_a_window_opens_with_the_blow(model: Model, tmp_path: Path) -> None:
    """A blow that comes late gives damped lines of the answer to it, not noise from before it: an update from far off
    gets through."""
    records = []
    for name, level, late in (("low", 0.3, 200), ("high", 1.0, LATE)):
        u = level * blow(late, 2 * N)
        records.append(record(model, u, small_study.respond(tmp_path, small_study.Truth(E=TRUE), u), name=name))
    start = update_model(model, records, 0.01)
    assert start.null.score < 1.5
    np.testing.assert_allclose(np.exp(start.null.p[:2]), np.array(TRUE) / 7e10, rtol=0.02)


def test_the_band_of_a_blow_begins_near_what_responds(model: Model, tmp_path: Path) -> None:
    """A blow has power at 0 Hz, where the cantilever hardly accelerates; strongly damped lines follow from the band's
    low end."""
    y = small_study.respond(tmp_path, small_study.Truth(), blow(LATE))
    r = record(model, blow(LATE), y)
    (lowest, *_) = modelled(model, [r], 0.01)[1].freq
    assert 0.1 * lowest < used_band([r])[0] < lowest
    u = small_study.force(1.0, 3, N)
    noisy = record(model, u, small_study.respond(tmp_path, small_study.Truth(), u))
    freq = np.fft.rfftfreq(N, DT)
    share = np.cumsum(np.abs(np.fft.rfft(u)) ** 2)
    assert used_band([noisy])[0] == pytest.approx(0.8 * freq[np.searchsorted(share / share[-1], 0.005)])


def test_which_forces_come_to_the_band_in_turn(model: Model) -> None:
    y = np.ones((4, N)) * np.sin(np.arange(N))
    burst = small_study.force(1.0, 5, N) * (np.arange(N) < 0.6 * N)
    periodic = np.tile(small_study.force(1.0, 7, N // 4), 4)
    for u in (small_study.force(1.0, 3, N), burst, periodic, blow(LATE), blow() + blow(1000)):
        r = record(model, u, y)
        assert not in_turn(r, BAND)
        assert pressed(r, BAND) is r
    assert in_turn(record(model, sweep(), y), BAND)


def test_a_pressed_sweep_is_a_pulse_that_the_same_model_explains(model: Model, tmp_path: Path) -> None:
    """Windowed lines of a pressed sweep have power in the whole band, and the truth leaves hardly more than noise."""
    u = sweep()
    y = small_study.respond(tmp_path, small_study.Truth(), u)
    model, reduced, problem = modelled(model, [record(model, u, y)], small_study.ZETA)
    sigma = 8 * problem.scale()
    power = []
    for made in (problem, problem.pressed()):
        (line,) = made.lines(reduced, sigma)
        high = np.abs(line.U[line.freq > 0.5 * problem.band[1]])
        power.append(float(np.median(high) / np.abs(line.U).max()))
        (fit,) = made.fit([Hypothesis(reduced, np.zeros((0, reduced.r)))], sigma=sigma, iterations=0)
        assert fit is not None
    assert power[0] < 0.01 < 0.1 < power[1]
    assert fit.score < 3.0
    peak = int(np.argmax(np.abs(problem.pressed().records[0].u[0])))
    assert 0 < peak * DT < 1.5 / problem.band[0]


def test_a_sweep_updates_a_model_that_is_far_off(model: Model, tmp_path: Path) -> None:
    records = []
    for name, level in (("low", 0.3), ("high", 1.0)):
        u = level * sweep()
        records.append(record(model, u, small_study.respond(tmp_path, small_study.Truth(E=TRUE), u), name=name))
    start = update_model(model, records, 0.01)
    assert start.null.score < 1.5
    np.testing.assert_allclose(np.exp(start.null.p[:2]), np.array(TRUE) / 7e10, rtol=0.02)


def test_the_noise_of_a_rest_is_noise_whatever_the_force_left_in_the_spectrum(model: Model) -> None:
    """Distortion (here a part of the response that follows no force) stands in the whole spectrum, but not in a rest;
    nor is what was filled in before a trigger a rest."""
    rng = np.random.default_rng(11)
    moving = (np.arange(N) > 60) & (np.arange(N) < N // 2)
    u = small_study.force(1.0, 3, N) * moving
    distorted = small_study.force(1.0, 4, N) * moving
    y = np.vstack([u + 0.3 * distorted, np.roll(u, 5) + 0.3 * distorted]) + 0.02 * rng.standard_normal((2, N))
    np.testing.assert_allclose(noise_of(u[None], y, 0), 0.02, rtol=0.08)
    y[:, : N // 4], u[: N // 4] = 0.0, 0.0
    np.testing.assert_allclose(noise_of(u[None], y, 0), 0.02, rtol=0.08)
    everywhere = small_study.force(1.0, 3, N)
    assert noise_in_silence(everywhere[None], y) is None


def test_what_a_rest_tells_is_not_said_to_be_untold(model: Model) -> None:
    rng = np.random.default_rng(12)
    y = rng.standard_normal((4, N))
    for u, told in ((blow(LATE), True), (small_study.force(1.0, 3, N), False)):
        records = [record(model, level * u, y, name=f"at {level}") for level in (1.0, 3.0)]
        assert (not untold(records)) == told
