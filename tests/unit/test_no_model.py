"""What an updated model explains by what its deck cannot hold, or not at all, is told."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.deciding import no_model as module
from femend.diagnose.deciding.deck_alone import deck_alone
from femend.diagnose.deciding.no_model import no_model
from femend.diagnose.deciding.verdict import decide, nothing_explains
from femend.diagnose.updating.noise import Louder
from femend.physics.catalogue import selected
from femend.report.headline import headline
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import LEVELS, NOISE, Truth, study_text, write_study

SOFT = Truth((7.42e10, 6.65e10))


def diagnosed(folder: Path, *, parameters: bool) -> StudyRun:
    """The run of a study of a structure whose halves are 6 % stiffer and 5 % softer, with or without their moduli as
    parameters."""
    path = write_study(folder, SOFT)
    if not parameters:
        path.write_text(study_text({name: role for name, (role, _) in LEVELS.items()}, ()))
    found = diagnose(path)
    assert isinstance(found, StudyRun)
    return found


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    return diagnosed(tmp_path_factory.mktemp("updated"), parameters=True)


@pytest.fixture(scope="module")
def without(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    return diagnosed(tmp_path_factory.mktemp("without"), parameters=False)


def test_a_deck_that_parameters_mend_is_told_so(run: StudyRun) -> None:
    assert run.result["verdict"] == "parameters-only"
    alone = deck_alone(run.diagnosis)
    assert alone is not None
    assert alone.fitted == pytest.approx(NOISE, rel=0.1)
    assert alone.alone < 0.1 * alone.given
    assert not alone.little
    assert no_model(run.diagnosis, None) == ""


def test_what_a_deck_cannot_hold_is_told(without: StudyRun) -> None:
    """The fit is as good, and the deck that is written the one that was given."""
    assert max(f["parameters"] for f in without.result["fit"] if f["role"] == "fit") < 5 * NOISE
    alone = deck_alone(without.diagnosis)
    assert alone is not None
    assert alone.little
    assert alone.alone == pytest.approx(alone.given, rel=0.2)
    assert alone.text in without.result["warnings"]
    # what meshes are off by anyway asks for no other parameters, however much of a light resonance it is
    within = replace(alone, deviations=0.4)
    assert within.told
    assert "widen prior_sd" not in within.text
    assert "once its parameters" not in headline(without.result)


def test_a_mode_far_from_the_frequency_of_the_model_is_not_explained(run: StudyRun) -> None:
    """As a preload softens the lowest mode and no other, which no modulus does."""
    found = run.diagnosis
    reduced, p = found.null.hypothesis.reduced, found.null.p.copy()
    first = len(reduced.names)
    p[first] = -12.0 * found.problem.prior(reduced)[1][first]
    softened = replace(found, null=replace(found.null, p=p), ranked=[])
    for place, verdict in ((found.located[0], "located-not-named"), (None, "undetermined")):
        told = decide(replace(softened, place=place))
        assert told.verdict == verdict
        assert told.place is place
        assert "12 standard deviations" in told.advice
    assert decide(replace(found, place=found.located[0], ranked=[])).verdict == "parameters-only"


@pytest.mark.parametrize(("laws", "told"), [(None, True), ("all", False)])
def test_where_nothing_explains_laws_that_were_not_tried_are_told(run: StudyRun, laws: str | None, told: bool) -> None:
    with selected(laws):
        said = nothing_explains(replace(run.diagnosis, ranked=[]))
    assert "no law that was tried explains it" in said
    assert ("others can be asked for" in said) is told


@pytest.mark.parametrize(("error", "raised", "told"), [(0.67, 18.0, True), (0.67, 2.0, False), (0.2, 18.0, False)])
def test_a_model_that_follows_hardly_anything_is_none(
    run: StudyRun, monkeypatch: pytest.MonkeyPatch, error: float, raised: float, told: bool
) -> None:
    """What it leaves counted as noise, so that nothing seemed to be missing."""
    monkeypatch.setattr(module, "whole_errors", lambda found: (error, error))
    loud = Louder(cast(Any, None), [], {"low": 1.0, "high": raised**2})
    text = no_model(run.diagnosis, loud)
    assert ("no model of what was tested" in text) is told
    if told:
        assert "67 %" in text
        assert "18 times" in text


def test_what_is_told_otherwise_stays(run: StudyRun) -> None:
    loud = Louder(cast(Any, None), [], {"low": np.inf})
    for verdict in ("missing-physics", "located-not-named", "undetermined"):
        assert no_model(replace(run.diagnosis, verdict=verdict), loud) == ""
