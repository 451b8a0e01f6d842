"""A sensor that shows what the structure does not, beside others that are right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.bent_beam import BAND, RATE, N, answers, bent_beam, burst, grounds, record, row

from femend.diagnose.locating.locate import Located, locate
from femend.diagnose.updating.loud_sensor import loud_sensor
from femend.diagnose.updating.update import UpdatedModel, _updated, modelled
from femend.estimate import FitRecord
from femend.model import ReducedModel

Array = NDArray[np.float64]
SENSORS = [row(n, 1) for n in (7, 6, 5, 4, 3)]
LOUD = SENSORS[3]


@pytest.fixture(scope="module")
def reduced(tmp_path_factory: pytest.TempPathFactory) -> ReducedModel:
    """A cantilever that bends in Y."""
    return bent_beam(tmp_path_factory.mktemp("beam"), (1,), BAND[1])


def recorded(reduced: ReducedModel, seed: int, beside: Array, spring: float = 0.0) -> FitRecord:
    """Accelerations under a burst at node 5 with noise of 1 % and a spring at node 3; the loud sensor shows so many of
    its own standard deviations `beside` (N,) them."""
    at, rows, into = reduced.rows(np.array([row(3, 1)])), np.array(SENSORS), np.array([row(5, 1)])
    U = burst(seed)
    y = answers(reduced, U, reduced.rows(into)[0], reduced.rows(rows), spring * at.T @ at)
    made = record(seed, np.fft.irfft(U)[:N], y, row(5, 1), rows)
    made.y[SENSORS.index(LOUD)] += beside * y[SENSORS.index(LOUD)].std()
    return made


def started(reduced: ReducedModel, beside: Array, spring: float = 0.0) -> tuple[UpdatedModel, list[Located]]:
    start = _updated(*modelled(reduced.model, [recorded(reduced, s, beside, spring) for s in (0, 1)], 0.01))
    places = grounds()
    return start, locate(start.problem, start.reduced, places, start.null)


T = np.arange(N) / RATE
HUM = 0.3 * np.sin(2 * np.pi * 50.0 * T)
NOISE = 0.3 * np.random.default_rng(5).standard_normal(N)


@pytest.mark.parametrize(("beside", "hum"), [(HUM, 50.0), (NOISE, np.nan)])
def test_what_one_sensor_shows_alone_counts_as_its_noise(reduced: ReducedModel, beside: Array, hum: float) -> None:
    start, located = started(reduced, beside)
    records = loud_sensor(start.problem, start.null, located)
    assert records is not None
    for before, after in zip(start.problem.records, records, strict=True):
        ((row_, factor, at),) = after.loud
        assert row_ == LOUD
        assert at == pytest.approx(hum, abs=0.6, nan_ok=True)
        assert 8.0 < factor < 60.0
        np.testing.assert_allclose(after.noise / before.noise, np.where(before.out_rows == LOUD, factor, 1.0))
        np.testing.assert_array_equal(after.y, before.y)
    again = _updated(start.reduced.model, start.reduced, start.problem.on(records))
    assert again.null.score < 1.2 < start.null.score
    assert loud_sensor(again.problem, again.null) is None


def test_what_is_missing_is_not_the_fault_of_a_sensor(reduced: ReducedModel) -> None:
    """Of a spring that all sensors show, and where a force explains what one sensor shows; with few sensors none can be
    told from what is missing."""
    start, located = started(reduced, 0 * T, 2e4)
    assert start.null.score > 1.2
    assert loud_sensor(start.problem, start.null) is None
    assert loud_sensor(start.problem, start.null, located) is None
    loud, _ = started(reduced, HUM)
    explained = [replace(located[0], fit=replace(located[0].fit, misfit=np.ones(2)))]
    assert loud_sensor(loud.problem, loud.null, explained) is None
    half = [replace(located[0], fit=replace(located[0].fit, misfit=0.5 * loud.null.misfit))]
    assert loud_sensor(loud.problem, loud.null, half) is None
    three = [
        replace(r, y=r.y[:3], out_rows=r.out_rows[:3], out_signs=r.out_signs[:3], noise=r.noise[:3])
        for r in loud.problem.records
    ]
    assert loud_sensor(loud.problem.on(three), loud.null) is None
