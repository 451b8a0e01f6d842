"""A run's samples count from its first one: what time a recorder gives that is nothing to its fit."""

from __future__ import annotations

import numpy as np
import pytest

from femend import Channel, Dof, TimeData
from femend.data import Recording, Rotating
from femend.diagnose.staged.prepare import run_data, tacho_warnings

RATE, SECONDS = 256.0, 20.0


def recording(t0: float, pulses: int = 1) -> Recording:
    """A shaft from 5 to 20 rev/s whose order 1 a sensor shows, on a clock that begins at `t0` s; there is one pulse to
    a turn, and `pulses` are stated."""
    t = np.arange(int(RATE * SECONDS)) / RATE
    turns = 5.0 * t + 0.5 * 15.0 / SECONDS * t**2
    values = [np.where(turns % 1 < 0.2, 5.0, 0.0), np.cos(2 * np.pi * turns)]
    channels = [Channel(None, "tacho", "V", "tacho"), Channel(Dof(1, 2), "acceleration", "m/s^2", "a")]
    data = TimeData("run", 1 / RATE, values, channels, t0)
    return Recording("run", data, excitation="rotating", rotating=Rotating("tacho", (7,), "X", pulses))


@pytest.mark.parametrize("t0", [-0.5, 100.0])
def test_the_clock_of_a_recorder_moves_nothing(t0: float) -> None:
    """A pre-trigger of half a second put the shaft half a second off its responses; of a record cut out of a longer one
    the speed was that of its first pulse throughout."""
    plain, late = run_data(recording(0.0)), run_data(recording(t0))
    assert late.rev_per_s == pytest.approx(plain.rev_per_s, rel=1e-6)
    assert np.abs(late.run.F - plain.run.F).max() < 1e-4 * np.abs(plain.run.F).max()
    assert late.speed.start == pytest.approx(plain.speed.start, abs=1e-6)


def test_warnings_tell_the_same_of_a_late_clock() -> None:
    plain, late = (recording(t0, pulses=2) for t0 in (0.0, 100.0))
    (said,) = tacho_warnings(plain, run_data(plain).speed)
    assert "is pulses_per_revolution = 1 instead of 2?" in said
    assert tacho_warnings(late, run_data(late).speed) == (said,)
