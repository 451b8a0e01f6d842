"""How far predictions are told: models that explain the recordings as well are simulated too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femend.diagnose.closed_loop import Loop
from femend.diagnose.outcome import Diagnosis
from femend.diagnose.spread import Spread, spread
from femend.errors import ModelError
from femend.study.study_run import StudyRun


def with_covariance(found: Diagnosis, factor: float) -> Diagnosis:
    """A diagnosis whose unknowns are known worse by a factor."""
    assert found.further is not None
    terms = found.further.terms
    assert terms.covariance is not None
    less = replace(terms, covariance=factor**2 * terms.covariance)
    return replace(found, further=replace(found.further, terms=less))


def test_laws_that_are_known_well_predict_well(dashpot_and_cubic: StudyRun) -> None:
    found = dashpot_and_cubic.diagnosis
    record = found.problem.records[0]
    apart = spread(found, record)
    assert apart is not None
    assert 0.0 < apart.share < 0.1
    assert apart.text("low") == ""
    # unknowns that move so little move the response in proportion
    half = spread(with_covariance(found, 0.5), record)
    assert half is not None
    assert half.share == pytest.approx(0.5 * apart.share, rel=0.1)


def test_laws_that_are_not_known_predict_nothing(dashpot_and_cubic: StudyRun) -> None:
    found = dashpot_and_cubic.diagnosis
    apart = spread(with_covariance(found, 100.0), found.problem.records[0])
    assert apart is not None
    assert apart.share > 0.3
    assert "recording 'low' hangs on little" in apart.text("low")


def test_models_that_are_no_structures_part_without_bounds(
    dashpot_and_cubic: StudyRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of unknowns that the recordings tell too little of, drawn ones may have a mass or stiffness below nothing."""

    def histories(loop: Loop, points: object) -> None:
        raise ModelError("matrix is not positive definite")

    monkeypatch.setattr(Loop, "histories", histories)
    assert spread(dashpot_and_cubic.diagnosis, dashpot_and_cubic.records[0]) == Spread(float("inf"), 0.0)


def test_what_is_linear_follows_its_parameters(dashpot_and_cubic: StudyRun) -> None:
    found = dashpot_and_cubic.diagnosis
    assert found.further is not None
    nothing = replace(found, best=None, further=None)
    assert spread(nothing, found.problem.records[0]) is None
    unknown = replace(found.further, terms=replace(found.further.terms, covariance=None))
    assert spread(replace(found, further=unknown), found.problem.records[0]) is None


def test_motion_without_bounds_is_said_to_be() -> None:
    told = Spread(float("inf"), 0.0).text("sweep")
    assert "without bounds" in told
    assert "inf" not in told
    assert Spread(0.1, 2.0).text("sweep") == ""
    assert np.isfinite(Spread(0.65, 2.6).share)
    assert "65 % of the response, from about 2.6 s on" in Spread(0.65, 2.6).text("sweep")
