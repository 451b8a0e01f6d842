"""A machine that runs when the record begins: the steady state of two DOFs in closed form, from both ends."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import Speed, TimeData
from femend.signal import run_up_shapes

from .signal_models import acceleration

# a disc of 10 kg on bearings of other stiffness in both directions; 4 % of damping
MASS, RESONANCES, ZETA, UNBALANCE = 10.0, (25.0, 38.0), 0.04, 2e-3
DT, SPAN, BEFORE = 1 / 512, 120.0, 20.0


def per_force(s: np.ndarray, resonance: float) -> np.ndarray:
    w = 2 * np.pi * resonance
    return s**2 / (MASS * (s**2 + 2 * ZETA * w * s + w**2))


def recorded(first: float, last: float) -> tuple[TimeData, Speed]:
    """A run from one speed to another in 1/s, which had stood at the first for a while before the record."""
    t = DT * np.arange(-round(BEFORE / DT), round(SPAN / DT))
    going = np.maximum(t, 0.0)
    rev = first + (last - first) * going / SPAN
    angle = 2 * np.pi * (first * t + (last - first) * going**2 / (2 * SPAN))
    size = 2 * t.size
    s = 2j * np.pi * np.fft.rfftfreq(size, DT)
    rows = []
    for resonance, lag in zip(RESONANCES, (0.0, np.pi / 2), strict=True):
        force = UNBALANCE * (2 * np.pi * rev) ** 2 * np.cos(angle - lag)
        rows.append(np.fft.irfft(np.fft.rfft(force, size) * per_force(s, resonance), size)[: t.size][t >= 0])
    run = TimeData("run", DT, np.array(rows), [acceleration(1), acceleration(2)])
    inside = t >= 0
    return run, Speed(t[inside], rev[inside], angle[inside], "known")


@pytest.mark.parametrize(("first", "last"), [(60.0, 5.0), (5.0, 60.0)], ids=["down", "up"])
def test_the_whole_band_is_the_steady_state(first: float, last: float) -> None:
    run, speed = recorded(first, last)
    shapes = run_up_shapes(run, speed)
    omega = 2 * np.pi * shapes.freq
    for row, (resonance, turn) in enumerate(zip(RESONANCES, (1, -1j), strict=True)):
        steady = per_force(1j * omega, resonance) * UNBALANCE * omega**2 * turn
        # lines are 1/memory = 0.07 Hz wide, the sharper mode 2 Hz
        assert np.abs(shapes.shapes[row] / steady - 1).max() < 0.03
