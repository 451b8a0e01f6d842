"""FRFs of a record are estimated as its force asks for: blow by blow, or over pieces."""

from __future__ import annotations

import numpy as np
import pytest

from femend import Channel, Dof, TimeData
from femend.cli.group import _numerics
from femend.correlate.doubts import level_doubts
from femend.errors import ModelError
from femend.modal import identify_modes
from femend.signal import estimate_frf
from femend.signal.hammer import blow_force
from femend.signal.suited import blows, suited_frf

RATE, FREQ, ZETA = 512.0, 30.0, 0.008


def answered(u: np.ndarray) -> TimeData:
    """A mass on a spring under the force `u`, from rest, with its acceleration and a thousandth of noise."""
    w, W = 2 * np.pi * np.fft.rfftfreq(4 * u.size, 1 / RATE), 2 * np.pi * FREQ
    a = np.fft.irfft(np.fft.rfft(u, 4 * u.size) * -(w**2) / (W**2 - w**2 + 2j * ZETA * W * w), 4 * u.size)[: u.size]
    a = a + 1e-3 * a.std() * np.random.default_rng(1).standard_normal(a.size)
    channels = (Channel(Dof(1, 3), "force", "N"), Channel(Dof(1, 3), "acceleration", "m/s^2"))
    return TimeData("hit", 1 / RATE, np.array([u, a]), channels)


def hammer(times: tuple[float, ...], seconds: float) -> TimeData:
    t = np.arange(int(seconds * RATE)) / RATE
    return answered(sum((100 * np.exp(-(((t - at) / 0.002) ** 2)) for at in times), np.zeros(t.size)))


@pytest.mark.parametrize("times", [(0.2,), (0.0, 4.0), (0.5, 5.0, 9.0)])
def test_a_hammer_test_gives_the_damping_that_is_there(times: tuple[float, ...]) -> None:
    data = hammer(times, 13.0)
    assert blows(data) == pytest.approx(times, abs=0.006)
    frf, told = suited_frf(data)
    found = identify_modes(frf, (10.0, 60.0)).modes
    assert found.zeta[0] == pytest.approx(ZETA, rel=0.02)
    assert found.freq[0] == pytest.approx(FREQ, rel=1e-3)
    assert (frf.coherence is None) == (len(times) < 3)
    assert any("strike 3 times or more" in text for text in told) == (len(times) < 3)


def test_double_hits_are_taken_whole_and_told() -> None:
    data = hammer((0.2, 0.28, 6.0, 6.08), 12.0)
    assert blows(data) == pytest.approx((0.2, 6.0), abs=0.006)
    frf, told = suited_frf(data)
    assert told[0].startswith("recording 'hit': no hit is single; those at ")
    assert told[0].endswith(" s are taken with all of their force")
    # between the frequencies at which two blows 0.08 s apart cancel each other
    found = identify_modes(frf, (20.0, 42.0)).modes
    assert found.zeta[0] == pytest.approx(ZETA, rel=0.05)
    assert found.freq[0] == pytest.approx(FREQ, rel=1e-3)


@pytest.mark.parametrize(
    ("times", "seconds"),
    [(tuple(range(1, 11)), 30.0), ((0.5, 2.5, 4.5, 25.0, 27.0, 29.0), 32.0), ((0.3, 0.5), 0.9)],
)
def test_a_pause_or_a_quiet_end_makes_no_blow_a_rebound(times: tuple[float, ...], seconds: float) -> None:
    assert blows(hammer(times, seconds)) == pytest.approx(times, abs=0.006)


def test_blows_that_cannot_be_used_are_told() -> None:
    data = hammer((0.2, 6.0), 12.0)
    values = np.clip(data.values, -0.4 * np.abs(data.values).max(axis=1)[:, None], None)
    values[1] = np.clip(data.values[1], *(0.2 * np.array([data.values[1].min(), data.values[1].max()])))
    frf, told = suited_frf(TimeData("hit", data.dt, values, data.channels))
    assert "overloaded" in told[0]
    assert told[0].endswith("its FRFs are averaged over pieces, which tear blows apart")
    assert frf.freq.size > 10


def test_other_forces_are_averaged_over_pieces() -> None:
    data = answered(np.random.default_rng(2).standard_normal(int(20 * RATE)))
    frf, told = suited_frf(data)
    assert told == ()
    np.testing.assert_array_equal(frf.H, estimate_frf(data).frf.H)


def test_a_direction_that_is_held_is_no_unit() -> None:
    H = np.ones((40, 3, 1), dtype=complex)
    (told,) = level_doubts(H, 1e-12 * H, ["4:+Z", "5:+Z", "6:+Z"])
    assert "a model that hardly moves there" in told.text


def test_algebra_that_ended_says_what_to_look_at() -> None:
    (said,) = _numerics(ModelError("matrix is not positive definite"))
    assert "`femend modes`" in said
    assert _numerics(ModelError("parameter 'E' is unknown")) == []


def test_a_hammer_in_the_air_exerts_no_force() -> None:
    data = hammer((1.0, 6.0), 12.0)
    noisy = np.array(data.values)
    noisy[0] += 0.5 + 0.05 * np.random.default_rng(3).standard_normal(noisy.shape[1])
    force = TimeData("hit", data.dt, noisy[:1], data.channels[:1])
    u = blow_force(force)[0]
    assert not u[: int(0.9 * RATE)].any()
    assert not u[int(2 * RATE) : int(5.5 * RATE)].any()
    at = slice(int(0.98 * RATE), int(1.02 * RATE))
    assert np.abs(u[at] - data.values[0, at]).max() < 0.3
    left = np.linalg.norm(u - data.values[0]) / np.linalg.norm(data.values[0])
    assert left < 0.3 * np.linalg.norm(noisy[0] - 0.5 - data.values[0]) / np.linalg.norm(data.values[0])


def test_another_force_stays_as_it_was_recorded() -> None:
    data = answered(np.random.default_rng(2).standard_normal(4096))
    force = TimeData("shaken", data.dt, data.values[:1], data.channels[:1])
    np.testing.assert_array_equal(blow_force(force), data.values[:1])
