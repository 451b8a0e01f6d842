"""How far predictions are told: models that explain the recordings as well are simulated too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.spread import AS_WELL, Spread, as_good, spread
from femend.diagnose.fitting.closed_loop import Loop
from femend.errors import ModelError
from femend.study.result.study_run import StudyRun


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
    models, nearer = as_good(found), as_good(with_covariance(found, 0.5))
    assert models is not None
    assert nearer is not None
    apart, half = spread(models, found, record), spread(nearer, found, record)
    assert 0.0 < apart.share < 0.1
    assert apart.text("low") == ""
    # unknowns that move so little move the response in proportion
    assert half.share == pytest.approx(0.5 * apart.share, rel=0.1)


@pytest.mark.parametrize(("factor", "kept"), [(1.0, 2), (6.0, 2), (1e4, 0)])
def test_models_that_are_drawn_explain_the_recordings(dashpot_and_cubic: StudyRun, factor: float, kept: int) -> None:
    """Where they leave more they are taken nearer to the final one, and where they do even so, nothing is known."""
    found = dashpot_and_cubic.diagnosis
    models = as_good(with_covariance(found, factor))
    if models is None:
        assert kept == 0
        return
    assert len(models.points) == 1 + kept
    final, *drawn = (float(e @ e) / models.loop.size() for e in models.loop.residuals(models.points)[0])
    assert max(drawn) <= AS_WELL * max(final, 1.0)
    assert all(np.abs(p - models.points[0][0]).max() > 0 for p, _ in models.points[1:])


def test_models_that_are_no_structures_part_without_bounds(
    dashpot_and_cubic: StudyRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A force that is not among the fitted ones may take a motion to where a drawn law has none."""
    found = dashpot_and_cubic.diagnosis
    models = as_good(found)
    assert models is not None

    def histories(loop: Loop, points: object) -> None:
        raise ModelError("matrix is not positive definite")

    monkeypatch.setattr(Loop, "histories", histories)
    assert spread(models, found, dashpot_and_cubic.records[0]) == Spread(float("inf"), 0.0)


def test_what_is_linear_follows_its_parameters(dashpot_and_cubic: StudyRun) -> None:
    found = dashpot_and_cubic.diagnosis
    assert found.further is not None
    assert as_good(replace(found, best=None, further=None)) is None
    unknown = replace(found.further, terms=replace(found.further.terms, covariance=None))
    assert as_good(replace(found, further=unknown)) is None


def test_motion_without_bounds_is_said_to_be() -> None:
    told = Spread(float("inf"), 0.0).text("sweep")
    assert "without bounds" in told
    assert "inf" not in told
    assert Spread(0.1, 2.0).text("sweep") == ""
    assert np.isfinite(Spread(0.65, 2.6).share)
    assert "65 % of the response, from about 2.6 s on" in Spread(0.65, 2.6).text("sweep")
