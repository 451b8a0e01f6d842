"""Hum of the mains on channels whose force does not hold it."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import Channel, Recording, TimeData
from femend.dof import Dof
from femend.signal.mains import mains_hum
from femend.study.file.channels_sound import with_warnings

RATE, N = 1024.0, 8192
CHANNELS = (
    Channel(Dof(1, 1), "force", "N"),
    Channel(Dof(2, 1), "acceleration", "m/s^2"),
    Channel(Dof(3, 1), "acceleration", "m/s^2"),
)
T = np.arange(N) / RATE


def data(hum: float = 0.0, freq: float = 50.03, in_force: float = 0.0, resonance: float = 50.0) -> TimeData:
    """A random force, and two responses of one mode of 1 % damping, the second of which hums."""
    rng = np.random.default_rng(3)
    u = rng.standard_normal(N) + in_force * np.sin(2 * np.pi * freq * T)
    f = np.fft.rfftfreq(N, 1 / RATE)
    H = -(f**2) / (resonance**2 - f**2 + 0.02j * resonance * f)
    y = np.fft.irfft(np.fft.rfft(u) * H, N)
    beside = hum * np.sqrt(2) * np.sin(2 * np.pi * freq * T + 0.4)
    return TimeData("r", 1 / RATE, np.array([u, y, 0.5 * y + beside]), CHANNELS)


@pytest.mark.parametrize("freq", [50.03, 60.0, 149.95])
def test_a_line_of_the_mains_is_found_with_its_level(freq: float) -> None:
    (found,) = mains_hum(data(0.5, freq, resonance=80.0))
    assert found.row == 2
    assert found.freq == pytest.approx(freq, abs=RATE / N)
    assert found.level == pytest.approx(0.5, rel=0.1)


def test_a_resonance_at_its_frequency_and_a_force_that_holds_it_are_no_hum() -> None:
    assert mains_hum(data()) == []
    assert mains_hum(data(in_force=0.5)) == []
    assert mains_hum(data(0.5, 47.0)) == []


def test_the_channel_is_told_with_what_to_do() -> None:
    recording = Recording("low", data(0.5, resonance=80.0))
    (said,) = with_warnings(recording).warnings
    assert "recording 'low': channel acceleration 3:+X holds a line of 50" in said
    assert "which the force does not hold: hum of the mains" in said
    assert with_warnings(Recording("low", data(0.005, resonance=80.0))).warnings == ()
