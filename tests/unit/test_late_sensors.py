"""Sensors that recorded late or early, each by a time of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.bent_beam import BAND, RATE, N, answers, bent_beam, burst, grounds, record, row

from femend.diagnose.locating import locate
from femend.diagnose.recordings.late_sensors import SensorTimes, late_sensors
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import _updated, modelled
from femend.estimate import FitRecord
from femend.model import ReducedModel

Array = NDArray[np.float64]
SENSORS = [row(n, 1) for n in (7, 6, 5, 4, 3)]


@pytest.fixture(scope="module")
def reduced(tmp_path_factory: pytest.TempPathFactory) -> ReducedModel:
    """A cantilever that bends in Y."""
    return bent_beam(tmp_path_factory.mktemp("beam"), (1,), BAND[1])


def recorded(reduced: ReducedModel, seed: int, late: dict[int, float], spring: float = 0.0) -> FitRecord:
    """Accelerations under a burst at node 5 of sensors that are `late` by so many samples, with noise of 1 %."""
    at, into = reduced.rows(np.array([row(3, 1), row(5, 1)]))[:, None]
    rows, into = np.array(SENSORS), into[0]
    U, freq = burst(seed), np.fft.rfftfreq(2 * N, 1 / RATE)
    later = [np.exp(-2j * np.pi * freq * late.get(r, 0.0) / RATE) for r in SENSORS]
    out, stiffness = reduced.rows(rows), spring * at.T @ at
    y = [answers(reduced, U * turn, into, out[i : i + 1], stiffness)[0] for i, turn in enumerate(later)]
    return record(seed, np.fft.irfft(U)[:N], np.array(y), row(5, 1), rows)


def found(reduced: ReducedModel, late: dict[int, float], spring: float = 0.0) -> SensorTimes | None:
    start = _updated(*modelled(reduced.model, [recorded(reduced, s, late, spring) for s in (0, 1)], 0.01))
    places = grounds()
    located = locate.locate(start.problem, start.reduced, places, start.null)
    out = late_sensors(start, located, places, 0.01, Settings())
    if out is None:
        return None
    times, again, there = out
    # what is left once they are moved is noise, or what a free force explains
    assert min(again.null.score, there[0].fit.score) < 1.2 < 5 < start.null.score
    return times


@pytest.mark.parametrize("spring", [0.0, 1e3])
@pytest.mark.parametrize("late", [{SENSORS[0]: 1.0, SENSORS[3]: 1.0}, {SENSORS[2]: -2.6}, {SENSORS[1]: 12.0}])
def test_sensors_that_are_late_or_early_are_moved(reduced: ReducedModel, late: dict[int, float], spring: float) -> None:
    """Also beside something that is missing, a spring at node 3."""
    times = found(reduced, late, spring)
    assert times is not None
    assert dict(zip(times.rows, np.array(times.seconds) * RATE, strict=True)) == pytest.approx(late, abs=0.1)


def test_sensors_in_time_beside_what_is_missing_are_not_moved(reduced: ReducedModel) -> None:
    assert found(reduced, {}) is None
    assert found(reduced, {}, 2e4) is None
    assert found(reduced, {}, 1e6) is None


def test_what_is_said_of_sensors_that_were_moved() -> None:
    said = SensorTimes((SENSORS[0], SENSORS[2]), (1 / RATE, -2.6 / RATE)).text(["a", "b"], range(1, 8), 1 / RATE)
    assert "2.54 ms (2.6 samples) early node 5 Y; 0.977 ms (1 sample) late node 7 Y (recordings 'a'" in said


def test_what_a_sensor_did_not_record_is_left_out_of_fits_and_heard_when_it_would_be(reduced: ReducedModel) -> None:
    late = {SENSORS[0]: 3.0, SENSORS[4]: -2.0}
    times = SensorTimes(tuple(late), tuple(s / RATE for s in late.values()))
    shown, true = recorded(reduced, 0, late), recorded(reduced, 0, {})
    moved = times.on(shown)
    assert moved.n == moved.y.shape[1] == N - 5
    np.testing.assert_array_equal(moved.u, true.u[:, 2 : N - 3])
    np.testing.assert_allclose(moved.y[:, 50:-50], true.y[:, 52:-53], atol=8 * true.noise.max())
    np.testing.assert_allclose(times.heard(true, true.y)[0, 3:], true.y[0, :-3], atol=1e-2 * true.y.std())
    # what repeats itself is known for good
    periodic = replace(shown, period=N // 2)
    np.testing.assert_allclose(times.on(periodic).y[0], np.roll(shown.y[0], -3), atol=1e-9 * shown.y.std())
    # sensors that are in time stay as they are
    others = replace(true, out_rows=true.out_rows[1:4], y=true.y[1:4])
    assert times.on(others) is others
    assert times.heard(others, others.y) is others.y
