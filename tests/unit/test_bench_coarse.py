"""Modes of FRFs whose lines are too far apart for them are told; those of a record that is long enough are not."""

from __future__ import annotations

import numpy as np
import pytest

from femend import Channel, Dof, TimeData
from femend.bench.coarse import too_coarse
from femend.modal import identify_modes
from femend.signal import estimate_frf

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
