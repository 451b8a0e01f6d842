"""Lines of a record whose force is there to the end: what the end cuts off of modes far above the band."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import _core
from femend.estimate.cut_off import cut_off, static_part

Array = NDArray[np.float64]
RATE, N, PERIOD = 1024.0, 3072, 1024
HIGH = 2 * np.pi * np.array([30.0, 900.0, 4000.0])
ZETA = np.full(3, 0.01)
# one input and two sensors in a basis of three modes that is their own
INTO, OUT = np.array([[1.0, 2.0, 3.0]]), np.array([[1.0, 2.0, 3.0], [0.5, -1.0, 2.0]])


def force(t: Array, order: int = 0) -> Array:
    """Odd lines of 1 Hz up to 375 Hz with fixed phases, swelling from rest in the first period, or a derivative; at the
    end it stands at some value."""
    rng = np.random.default_rng(4)
    freq = np.arange(11, 376, 2)
    phase = rng.uniform(0, 2 * np.pi, len(freq))
    omega = 2 * np.pi * freq

    def lines(k: int) -> Array:
        return np.asarray(
            (omega[:, None] ** k * np.cos(omega[:, None] * t + phase[:, None] + k * np.pi / 2)).sum(axis=0)
        )

    x = np.clip(t, 0, 1)
    swell = [np.sin(np.pi * x / 2) ** 4, np.gradient(np.sin(np.pi * x / 2) ** 4, t)]
    swell.append(np.gradient(swell[1], t))
    if order == 0:
        return np.asarray(swell[0] * lines(0))
    return np.asarray(swell[2] * lines(0) + 2 * swell[1] * lines(1) + swell[0] * lines(2))


@pytest.mark.parametrize(("period", "left"), [(PERIOD, 1e-3), (0, 0.1)])
def test_the_second_derivative_is_that_of_a_force_that_goes_on(period: int, left: float) -> None:
    t = np.arange(N) / RATE
    second = static_part(force(t)[None], period, 1 / RATE)[0]
    true = force(t, 2)
    inside = slice(0, N - 3)
    assert np.linalg.norm(second[inside] - true[inside]) < left * np.linalg.norm(true[inside])


@pytest.mark.parametrize("sigma", [0.0, 0.4])
def test_modes_far_above_the_band_show_what_they_did_up_to_the_end(sigma: float) -> None:
    t = np.arange(N) / RATE
    window = np.exp(-sigma * t)
    u = force(t)
    freq = np.fft.rfftfreq(N, 1 / RATE)
    at = np.flatnonzero((freq > 10) & (freq < 380))
    s = sigma + 2j * np.pi * freq[at]
    U = np.fft.rfft(u * window)[at][:, None]
    second = np.fft.rfft(static_part(u[None], PERIOD, 1 / RATE) * window)[0, at][:, None]
    found = cut_off(s, second / s[:, None] ** 2 - U, (HIGH, ZETA, np.eye(3)), (OUT, INTO), 1)
    # modes that follow the force statically: the second derivative of the force times their compliance
    first = _core.n_decaying(HIGH, float(s.imag.max()), 1)
    assert first == 2
    compliance = OUT[:, first:] @ (INTO[0, first:] / HIGH[first:] ** 2)
    lines = s[:, None] ** 2 * U * compliance
    record = np.fft.rfft(force(t, 2) * compliance[:, None] * window)[:, at].T
    assert np.linalg.norm(record - lines - found) < 0.15 * np.linalg.norm(record - lines)
