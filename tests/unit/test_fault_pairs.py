"""Sensors reversed or exchanged are told where they make shapes look like those of other modes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.correlate import fault_pairs, pair_modes, sensor_faults
from femend.errors import CorrelationError

# frequency parameters of a clamped-free beam, and where its sensors are
BETA = np.array([1.87510407, 4.69409113, 7.85475744, 10.99554073, 14.13716839])
AT = np.array([0.3, 0.5, 0.7, 0.85, 1.0])


def cantilever(at: NDArray) -> NDArray:
    """Shapes (n_at, 5) of a clamped-free beam (Blevins 1979, table 8-1)."""
    s = (np.sinh(BETA) - np.sin(BETA)) / (np.cosh(BETA) + np.cos(BETA))
    x = np.outer(at, BETA)
    shapes: NDArray = np.cosh(x) - np.cos(x) - s * (np.sinh(x) - np.sin(x))
    return shapes


@pytest.mark.parametrize("row", range(5))
def test_a_reversed_sensor_of_five_is_told_where_shapes_alone_pair_other_modes(row: int) -> None:
    model, freq = cantilever(AT), BETA**2
    test = model * (1 + 0.02 * np.random.default_rng(3).standard_normal(model.shape))
    test[row] *= -1
    # the model is 5 % too soft
    found = fault_pairs(test, model, freq, 0.95 * freq)
    assert found is not None
    np.testing.assert_array_equal(found, [range(5), range(5)])
    (fault,) = sensor_faults(test[:, found[0]], model[:, found[1]], list("abcde"))[0]
    assert (fault.kind, fault.names) == ("reversed", ("abcde"[row],))


def test_pairs_of_shapes_as_they_are_accuse_another_sensor_than_the_tip_that_is_upside_down() -> None:
    model, freq = cantilever(AT), BETA**2
    test = model * [[1], [1], [1], [1], [-1]]
    pairs = pair_modes(test, model, freq, 0.95 * freq)
    assert list(pairs.b) != list(range(5))
    assert [f.rows for f in sensor_faults(test[:, pairs.a], model[:, pairs.b])[0]] != [(4,)]


def test_a_reversed_sensor_beside_two_exchanged_is_told() -> None:
    at = np.linspace(0.2, 1.0, 9)
    model, freq = cantilever(at), BETA**2
    test = model[[0, 1, 7, 3, 4, 5, 6, 2, 8]] * np.where(np.arange(9) == 5, -1, 1)[:, None]
    found = fault_pairs(test, model, freq, 1.1 * freq)
    assert found is not None
    faults = sensor_faults(test[:, found[0]], model[:, found[1]])[0]
    assert {(f.kind, f.rows) for f in faults} == {("reversed", (5,)), ("exchanged", (2, 7))}


def test_sound_sensors_shapes_of_chance_and_few_sensors_change_no_pairs() -> None:
    model, freq = cantilever(AT), BETA**2
    assert fault_pairs(model, model, freq, freq) is None
    rng = np.random.default_rng(1)
    for _ in range(50):
        assert fault_pairs(rng.standard_normal((6, 4)), rng.standard_normal((6, 5)), freq[:4], freq) is None
    assert fault_pairs(model[:3] * [[1], [1], [-1]], model[:3], freq, freq) is None
    # modes that are further off than that are another model's
    assert fault_pairs(model * [[1], [1], [1], [1], [-1]], model, 6.28 * freq, freq) is None


def test_frequencies_of_another_number_are_refused() -> None:
    with pytest.raises(CorrelationError, match="frequencies"):
        fault_pairs(cantilever(AT), cantilever(AT), BETA[:3], BETA)
