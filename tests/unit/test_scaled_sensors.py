"""Sensors of a modal test that are dead or a factor off in all shapes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.correlate import scaled_sensors
from femend.errors import CorrelationError

N, MODES = 14, 6
FREQ = np.array([10.0, 24.0, 31.0, 55.0, 71.0, 90.0])
NAMES = [f"{i}:+Z" for i in range(N)]


def measured(seed: int, off: float = 0.1) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Shapes of a test and of a model that is off by a share of its motion, each with its own scale."""
    rng = np.random.default_rng(seed)
    phi = rng.standard_normal((N, MODES))
    test = (phi + off * rng.standard_normal(phi.shape)) * rng.uniform(0.1, 10.0, MODES)
    return test, phi


def found(test: NDArray[np.float64], phi: NDArray[np.float64]) -> list[tuple[int, float]]:
    told = scaled_sensors(test, phi, NAMES, 0.97 * FREQ, FREQ)
    return [(one.row, one.factor) for one in told]


@pytest.mark.parametrize("factor", [9.81, 1 / 9.81, -20.0])
def test_a_sensor_in_another_unit_is_told_with_its_factor(factor: float) -> None:
    test, phi = measured(1)
    test[5] *= factor
    ((row, size),) = found(test, phi)
    assert row == 5
    assert size == pytest.approx(factor, rel=0.2)
    (one,) = scaled_sensors(test, phi, NAMES, FREQ, FREQ)
    assert "5:+Z shows" in one.text
    assert ("upside down" in one.text) is (factor < 0)
    assert one.n_modes == MODES


def test_a_dead_sensor_is_told() -> None:
    test, phi = measured(2)
    test[3] = 0.01 * np.random.default_rng(0).standard_normal(MODES) * np.abs(test).max(axis=0)
    assert found(test, phi) == [(3, 0.0)]
    (one,) = scaled_sensors(test, phi, NAMES, FREQ, FREQ)
    assert "hardly moves in any mode" in one.text


def test_g_read_as_m_per_s2_is_no_dead_sensor() -> None:
    """With the model's error they lie to either side of a tenth."""
    told = []
    for seed in range(40):
        test, phi = measured(seed)
        test[5] *= 1 / 9.81
        told += found(test, phi)
    right = [row == 5 and factor == pytest.approx(0.1, rel=0.4) for row, factor in told]
    # what hardly moves in any mode is not told apart from one that is dead
    assert sum(right) >= 38


def test_sound_sensors_are_not_told() -> None:
    assert [found(*measured(seed)) for seed in range(200)] == [[]] * 200
    # nor where the model is off by as much as it moves, or does not move itself
    for off in (0.5, 1.0):
        assert [found(*measured(seed, off)) for seed in range(200)] == [[]] * 200
    test, phi = measured(3)
    phi[4] *= 1e-3
    assert found(test, phi) == []


def test_few_sensors_and_modes_tell_nothing() -> None:
    test, phi = measured(1)
    test[0] *= 10.0
    assert scaled_sensors(test[:3], phi[:3], NAMES[:3], FREQ, FREQ) == ()
    assert scaled_sensors(test[:, :2], phi[:, :2], NAMES, FREQ[:2], FREQ[:2]) == ()
    with pytest.raises(CorrelationError):
        scaled_sensors(test, phi[1:], NAMES, FREQ, FREQ)
