"""Sensors that do not follow slow motion: a high-pass filter of the first order in all of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.bent_beam import BAND, RATE, N, answers, bent_beam, burst, grounds, record, row

from femend.diagnose.locating.locate import locate
from femend.diagnose.recordings import mended
from femend.diagnose.recordings.low_cut import LowCut, low_cut
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel, _updated, modelled, update_model
from femend.estimate import FitRecord
from femend.model import ReducedModel

Array = NDArray[np.float64]
SENSORS = np.array([row(n, 1) for n in (7, 6, 5, 3)])


@pytest.fixture(scope="module")
def reduced(tmp_path_factory: pytest.TempPathFactory) -> ReducedModel:
    """A cantilever that bends in Y."""
    return bent_beam(tmp_path_factory.mktemp("beam"), (1,), BAND[1])


def recorded(reduced: ReducedModel, seed: int, cut: float, spring: float = 0.0) -> FitRecord:
    """Accelerations under a burst at node 5 of sensors cut off below `cut` (Hz), with noise of 1 %."""
    at, into = reduced.rows(np.array([row(3, 1)])), np.array([row(5, 1)])
    f = np.fft.rfftfreq(2 * N, 1 / RATE)
    U, passed = burst(seed), 1j * f / np.where(f > 0, 1j * f + cut, 1.0)
    y = answers(reduced, U * passed, reduced.rows(into)[0], reduced.rows(SENSORS), spring * at.T @ at)
    return record(seed, np.fft.irfft(U)[:N], y, row(5, 1), SENSORS)


def found(reduced: ReducedModel, cut: float, spring: float = 0.0, *, beside_forces: bool = False) -> LowCut | None:
    """What is found; a free force does what a cut-off does in a beam of three modes, so that it has no say unless
    asked."""
    start = _updated(*modelled(reduced.model, [recorded(reduced, s, cut, spring) for s in (0, 1)], 0.01))
    places = grounds()
    located = locate(start.problem, start.reduced, places, start.null) if beside_forces else []
    out = low_cut(start, located, places, 0.01, Settings())
    if out is None:
        return None
    off, again, there = out
    assert min(again.null.score, there[0].fit.score) < 1.2 < 3.6 < start.null.score
    return off


@pytest.mark.parametrize(("cut", "spring"), [(4.0, 0.0), (8.0, 0.0), (8.0, 1e3)])
def test_the_cut_off_of_all_sensors_is_found(reduced: ReducedModel, cut: float, spring: float) -> None:
    """Also beside something that is missing, a spring at node 3."""
    off = found(reduced, cut, spring)
    assert off is not None
    assert off.frequency == pytest.approx(cut, rel=0.1)
    assert found(reduced, cut, spring, beside_forces=True) is None


def test_what_is_missing_is_no_cut_off(reduced: ReducedModel) -> None:
    assert found(reduced, 0.0) is None
    assert found(reduced, 0.0, 2e4) is None
    assert found(reduced, 0.0, 1e6) is None


def test_updates_are_for_a_cut_off_that_takes_much_away(reduced: ReducedModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """What something that is missing makes believe takes little away on few lines, and is not followed further."""
    made: list[float] = []

    def counted(*args: Any, **more: Any) -> UpdatedModel:
        made.append(0.0)
        return update_model(*args, **more)

    monkeypatch.setattr(mended, "update_model", counted)
    assert found(reduced, 0.0, 1e6) is None
    assert not made
    assert found(reduced, 8.0, 1e3) is not None
    assert made


@pytest.mark.parametrize("period", [0, N // 2])
def test_what_sensors_show_and_what_moved_are_turned_into_each_other(reduced: ReducedModel, period: int) -> None:
    off, record = LowCut(3.0), recorded(reduced, 0, 0.0)
    tone = np.sin(2 * np.pi * 16 * np.arange(N) * 2 / N)[None] if period else record.y
    record = replace(record, period=period, y=tone)
    shown = replace(record, y=off.heard(record, record.y))
    assert np.abs(shown.y - record.y).max() > 0.01 * np.abs(record.y).max()
    np.testing.assert_allclose(off.on(shown).y, record.y, atol=0.01 * np.abs(record.y).max())


def test_what_is_said_of_a_cut_off() -> None:
    said = LowCut(2.371).text(["a", "b"], range(1, 8), 1 / RATE)
    assert "cut off below 2.37 Hz (first order; recordings 'a', 'b')" in said
