"""A force that was recorded late or early against the responses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.bent_beam import BAND, RATE, N, answers, bent_beam, burst, grounds, record, row

from femend.diagnose.locating import locate
from femend.diagnose.recordings.time_axis import ForceShift, force_shift
from femend.diagnose.updating.update import _updated, modelled
from femend.estimate import FitRecord
from femend.model import ReducedModel

Array = NDArray[np.float64]
NODES = range(1, 8)
SHAKER, SENSORS = (5, 1), [(7, 1), (5, 1), (4, 1), (3, 1)]


@pytest.fixture(scope="module")
def reduced(tmp_path_factory: pytest.TempPathFactory) -> ReducedModel:
    """A cantilever that bends in Y."""
    return bent_beam(tmp_path_factory.mktemp("beam"), (1,), BAND[1])


def recorded(
    reduced: ReducedModel,
    name: str,
    seed: int,
    late: float,
    spring: float = 0.0,
    shaker: tuple[int, int] = SHAKER,
) -> FitRecord:
    """Accelerations under a burst, beside a force channel that is `late` by so many samples, with noise of 1 %."""
    at, U, freq = reduced.rows(np.array([row(3, 1)])), burst(seed), np.fft.rfftfreq(2 * N, 1 / RATE)
    rows = np.array([row(*s) for s in SENSORS])
    y = answers(reduced, U, reduced.rows(np.array([row(*shaker)]))[0], reduced.rows(rows), spring * at.T @ at)
    shown = np.fft.irfft(U * np.exp(-2j * np.pi * freq * late / RATE))[:N]
    return replace(record(seed, shown, y, row(*shaker), rows), name=name)


def found(reduced: ReducedModel, records: list[FitRecord]) -> ForceShift | None:
    start = _updated(*modelled(reduced.model, records, 0.01))
    places = grounds()
    located = locate.locate(start.problem, start.reduced, places, start.null)
    out = force_shift(start, located, places, 0.01)
    if out is None:
        return None
    shift, again, there = out
    # what is left once the force is moved is noise, or what a free force explains
    assert min(again.null.score, there[0].fit.score) < 1.2 < 20 < start.null.score
    return shift


@pytest.mark.parametrize(("late", "spring"), [(5.0, 0.0), (-3.0, 0.0), (1.5, 0.0), (5.0, 1e3)])
def test_a_force_that_was_recorded_late_or_early_is_moved(reduced: ReducedModel, late: float, spring: float) -> None:
    """Also beside something that is missing, a spring at node 3."""
    shift = found(reduced, [recorded(reduced, name, seed, late, spring) for seed, name in enumerate("ab")])
    assert shift is not None
    assert shift.rows == (row(*SHAKER),)
    assert shift.seconds * RATE == pytest.approx(-late, abs=0.1)


@pytest.mark.parametrize("late", [0.5, -3.0])
def test_forces_at_several_places_are_moved_together(reduced: ReducedModel, late: float) -> None:
    """A roving hammer whose channel is filtered otherwise than the responses'."""
    shakers = {"a": SHAKER, "b": (3, 1), "c": (7, 1)}
    records = [recorded(reduced, name, i, late, shaker=at) for i, (name, at) in enumerate(shakers.items())]
    start = _updated(*modelled(reduced.model, records, 0.01))
    places = grounds()
    out = force_shift(start, locate.locate(start.problem, start.reduced, places, start.null), places, 0.01)
    assert out is not None
    shift, again, _ = out
    assert shift.rows == tuple(sorted(row(*at) for at in shakers.values()))
    assert shift.seconds * RATE == pytest.approx(-late, abs=0.05)
    assert again.null.score < 1.2
    assert "the forces at nodes 3, 5, 7 were recorded" in shift.text(["a"], NODES, 1 / RATE)
    still = [recorded(reduced, name, i, 0.0, 2e4, at) for i, (name, at) in enumerate(shakers.items())]
    start = _updated(*modelled(reduced.model, still, 0.01))
    assert start.null.score > 1.5
    assert force_shift(start, locate.locate(start.problem, start.reduced, places, start.null), places, 0.01) is None


def test_what_is_said_of_a_force_that_was_moved() -> None:
    said = ForceShift((row(*SHAKER),), -5 / RATE).text(["a", "b"], NODES, 1 / RATE)
    assert "node 5 was recorded 4.88 ms (5 samples) too late against the responses (recordings 'a', 'b')" in said
    assert "1.46 ms (1.5 samples) too early" in ForceShift((row(*SHAKER),), 1.5 / RATE).text(["a"], NODES, 1 / RATE)


def test_a_force_in_time_and_what_is_missing_at_or_beside_the_shaker_move_nothing(reduced: ReducedModel) -> None:
    assert found(reduced, [recorded(reduced, "a", 1, 0.0), recorded(reduced, "b", 2, 0.0)]) is None
    assert found(reduced, [recorded(reduced, "a", 1, 0.0, 2e4), recorded(reduced, "b", 2, 0.0, 2e4)]) is None


def test_what_the_moved_force_is_not_known_to_be_is_left_out_of_fits(reduced: ReducedModel) -> None:
    record = recorded(reduced, "a", 1, 0.0)
    for seconds, length, silent in ((-2.5 / RATE, N - 3, slice(N - 3, N)), (2.5 / RATE, N - 3, slice(0, 3))):
        shift = ForceShift((row(*SHAKER),), seconds)
        assert shift.on(record).u.shape[1] == shift.on(record).y.shape[1] == length
        # what moves across its sensors is left out with what they show
        beside = replace(record, across=np.stack([record.y, 2 * record.y, 3 * record.y]))
        np.testing.assert_array_equal(shift.on(beside).across, np.stack([k * shift.on(record).y for k in (1, 2, 3)]))
        kept = shift.driving(record)
        assert kept.u.shape == record.u.shape
        assert (kept.u[:, silent] == 0).all()
    # a periodic force is known for good
    shift, periodic = ForceShift((row(*SHAKER),), -4 / RATE), replace(record, period=N // 2)
    np.testing.assert_allclose(shift.on(periodic).u, np.roll(record.u, -4, axis=1), atol=1e-9)
    # and a force somewhere else, or none, is not moved
    assert ForceShift((row(7, 1),), 0.01).on(record) is record
    unknown = replace(record, u=record.u[:0], in_rows=record.in_rows[:0], in_signs=record.in_signs[:0])
    assert ForceShift((row(*SHAKER),), 0.01).driving(unknown) is unknown
