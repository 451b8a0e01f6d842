"""What a law leaves of motion that can be followed to the end has another reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.diagnose.deciding import parting as module
from femend.diagnose.deciding import verdict
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.parting import Parting, parting
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
    assert parting(of_beginnings(dashpot_and_cubic.diagnosis, 0.0)) == Parting(accounts=True)


def test_what_comes_later_and_is_followed_is_something_else(dashpot_and_cubic: StudyRun) -> None:
    found = of_beginnings(dashpot_and_cubic.diagnosis, 0.6)
    told = parting(found)
    assert not told.accounts
    assert repr(found.problem.records[0].name) in told.otherwise
    assert "can be followed" in told.otherwise


def test_a_mode_beyond_the_band_is_nobodys_to_explain(dashpot_and_cubic: StudyRun) -> None:
    """Impacts drive modes of which no line is compared: what they leave is no other physics."""
    found = of_beginnings(dashpot_and_cubic.diagnosis, 0.0)

    def ringing(record: FitRecord) -> FitRecord:
        f = 0.5 * (found.problem.band[1] + 0.5 / record.dt)
        tone = np.sin(2 * np.pi * round(f * record.n * record.dt) / record.n * np.arange(record.n))
        return replace(record, y=record.y + 0.6 * record.y.std(axis=1, keepdims=True) * tone)

    rings = replace(found, problem=found.problem.on([ringing(r) for r in found.problem.records]))
    assert parting(rings) == Parting(accounts=True)


def test_motion_that_parts_as_far_may_be_of_the_law_alone(
    dashpot_and_cubic: StudyRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "spread", lambda models, found, record, band: Spread(0.3, 1.0))
    assert parting(of_beginnings(dashpot_and_cubic.diagnosis, 0.6)) == Parting(accounts=True)
    without = replace(dashpot_and_cubic.diagnosis, best=None, further=None)
    assert parting(without) == Parting()


@pytest.mark.parametrize(
    ("rest", "times", "told"),
    [
        (Parting(), 2.0, "missing-physics"),
        (Parting(), 9.0, "located-not-named"),
        (Parting(accounts=True), 9.0, "missing-physics"),
        (Parting(otherwise="something else"), 2.0, "located-not-named"),
    ],
)
def test_a_law_of_a_beginning_is_sure_near_the_noise_or_where_models_part_as_far(
    dashpot_and_cubic: StudyRun, monkeypatch: pytest.MonkeyPatch, rest: Parting, times: float, told: str
) -> None:
    monkeypatch.setattr(verdict, "parting", lambda found: rest)
    monkeypatch.setattr(verdict, "most_of_noise", lambda found: times)
    monkeypatch.setattr(verdict, "further_off", lambda *given, **also: "")
    both = dashpot_and_cubic.diagnosis
    assert both.further is not None
    cubic = next(term.candidate for term in both.further.terms.terms if term.candidate.nonlinear)
    of_the_law = replace(both, verdict="missing-physics", sigma=4.0, best=cubic, advice="as it was")
    found = verdict._of_a_beginning(of_the_law, of_the_law)
    assert found.verdict == told
    if rest.accounts:
        assert "part from each other" in found.advice
    else:
        assert found.advice == (rest.otherwise or "as it was")
