"""What is not linear moves the model's unknowns with the level of the recordings; what is linear does not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from tests.small_study import Truth
from tests.unit.test_dashpots import driven_of
from tests.unit.test_unrecorded import STIFFER

from femend.diagnose import responses_alone
from femend.diagnose.driven.unrecorded import Driven
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel
from femend.diagnose.updating.with_level import drift, drifted, moves_with_level, told_of_drift
from femend.estimate.lines import TEMPERING


@dataclass
class OneFit:
    """As much of a fit as its drift needs."""

    p: np.ndarray
    hessian: np.ndarray


def fits_of(rng: np.random.Generator, levels: list[float], slope: float) -> list[OneFit]:
    """Fits of six unknowns that scatter as the curvature of their cost has it, around a line over the ln level."""
    made = []
    for level in levels:
        a = rng.standard_normal((6, 9))
        h = a @ a.T
        scatter = np.linalg.solve(np.linalg.cholesky(h).T, rng.standard_normal(6)) * np.sqrt(TEMPERING / 2)
        law = np.zeros((8, 8))
        law[:6, :6] = h
        made.append(OneFit(slope * np.log(level) + scatter, law))
    return made


def test_fits_that_scatter_as_noise_has_it_are_chi_squared() -> None:
    rng, levels = np.random.default_rng(1), [1.0, 3.0, 8.0]
    found = np.array([drift(fits_of(rng, levels, 0.0), levels) for _ in range(400)])  # type: ignore[arg-type]
    assert found.mean() == pytest.approx(6, abs=0.6)
    assert found.var() == pytest.approx(12, rel=0.3)
    assert not any(drifted(fits_of(rng, levels, 0.0), levels, 1.0) for _ in range(100))  # type: ignore[arg-type]


def test_a_slope_over_the_level_is_told_unless_the_model_leaves_as_much_beyond_the_noise() -> None:
    rng, levels = np.random.default_rng(2), [1.0, 3.0, 8.0]
    fits = fits_of(rng, levels, 1.0)
    assert drifted(fits, levels, 1.0)  # type: ignore[arg-type]
    assert not drifted(fits, levels, 6.0)  # type: ignore[arg-type]
    assert not drifted(fits_of(rng, levels, 0.0), levels, 1.0)  # type: ignore[arg-type]


def in_noise(start: UpdatedModel, factor: float) -> UpdatedModel:
    """The updated model of recordings that are told to hold so many times the noise."""
    problem = start.problem.on([replace(r, noise=factor * r.noise) for r in start.problem.records])
    (null,) = problem.fit([start.null.hypothesis], [(start.null.p, start.null.x)])
    assert null is not None
    return replace(start, problem=problem, null=null)


@pytest.fixture(scope="module")
def hardening(tmp_path_factory: pytest.TempPathFactory) -> Driven:
    laws = [(7, "cubic_stiffness", {"k3": 1e9})]
    return driven_of(tmp_path_factory.mktemp("hardening"), Truth(STIFFER, laws=laws))


def test_a_hardening_spring_moves_the_model_with_the_level_and_a_linear_one_does_not(
    hardening: Driven, tmp_path: Path
) -> None:
    start = in_noise(hardening.start, 5.0)
    assert start.null.score < Settings().consistent
    fits = moves_with_level(start)
    assert fits is not None
    said = told_of_drift(start, fits, shown=False)
    assert "something that is not linear is missing" in said
    assert " Hz in low and " in said
    assert "a guess" in said
    assert "a guess" not in told_of_drift(start, fits, shown=True)
    sprung = driven_of(tmp_path, Truth(STIFFER, laws=[(7, "support_stiffness", {"k": 2e4})])).start
    assert sprung.null.score > Settings().consistent
    assert moves_with_level(sprung) is None
    assert moves_with_level(in_noise(sprung, 5.0)) is None


def test_recordings_of_one_level_cannot_be_compared(hardening: Driven) -> None:
    start = in_noise(hardening.start, 5.0)
    one = replace(start, problem=start.problem.on(start.problem.records[:1]))
    assert moves_with_level(one) is None
    alike = replace(
        start, problem=start.problem.on([replace(start.problem.records[0], name="again"), start.problem.records[0]])
    )
    assert moves_with_level(alike) is None


def test_what_only_moves_with_the_level_is_located_and_said(hardening: Driven, monkeypatch: pytest.MonkeyPatch) -> None:
    quiet = replace(hardening, start=in_noise(hardening.start, 5.0))
    monkeypatch.setattr(responses_alone, "locate_drive", lambda *_: quiet)
    monkeypatch.setattr(responses_alone, "one_more_force", lambda *_: False)
    monkeypatch.setattr(responses_alone, "_simulated", lambda driven, plain, *_: plain)
    start = quiet.start
    found = responses_alone.diagnose_responses(start.reduced.model, start.problem.records, 0.01)
    assert found is not None
    assert found.verdict == "located-not-named"
    assert found.place is quiet.located[0]
    assert "something that is not linear is missing" in found.advice
