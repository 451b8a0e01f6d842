"""What a law leaves of motion that can be followed to the end has another reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.diagnose.deciding import parting
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.parting import left_by_something_else
from femend.diagnose.deciding.spread import Spread
from femend.estimate import FitRecord
from femend.study.result.study_run import StudyRun


def later(record: FitRecord, share: float) -> FitRecord:
    """A record whose second half holds a share of itself upside down and the other way round."""
    y = np.array(record.y)
    half: NDArray[np.float64] = y[:, record.n // 2 :]
    half -= share * half[:, ::-1].copy()
    return replace(record, y=y)


def of_beginnings(found: Diagnosis, share: float) -> Diagnosis:
    """A diagnosis in a window, whose recordings hold something else in their second halves."""
    return replace(found, problem=found.problem.on([later(r, share) for r in found.problem.records]), sigma=4.0)


def test_laws_that_explain_the_whole_leave_nothing_to_say(dashpot_and_cubic: StudyRun) -> None:
    assert left_by_something_else(of_beginnings(dashpot_and_cubic.diagnosis, 0.0)) == ""


def test_what_comes_later_and_is_followed_is_something_else(dashpot_and_cubic: StudyRun) -> None:
    found = of_beginnings(dashpot_and_cubic.diagnosis, 0.6)
    told = left_by_something_else(found)
    assert repr(found.problem.records[0].name) in told
    assert "can be followed" in told


def test_motion_that_parts_as_far_may_be_of_the_law_alone(
    dashpot_and_cubic: StudyRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parting, "spread", lambda models, found, record: Spread(0.3, 1.0))
    assert left_by_something_else(of_beginnings(dashpot_and_cubic.diagnosis, 0.6)) == ""
    without = replace(dashpot_and_cubic.diagnosis, best=None, further=None)
    assert left_by_something_else(without) == ""
