"""What is added to the model is told only where the model with it comes nearer to the recordings by itself."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend import functions_of, write_uff
from femend.diagnose.deciding import outside_band, verdict
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.parting import Parting
from femend.diagnose.deciding.plain_error import errors_in_band, further_off, left_in_band, plain_errors, silenced
from femend.diagnose.deciding.verdict import decide
from femend.diagnose.naming.advice import LATER
from femend.diagnose.settings import Settings
from femend.numerals import plain
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import NOISE, Truth, diagnosed, force, recording, respond, write_study

NODE, K = 9, 3.0e4


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    spring = (NODE, "support_stiffness", {"k": K})
    return diagnosed(tmp_path_factory.mktemp("spring"), Truth((7.2e10, 6.9e10), laws=[spring]))


def stiffer(found: Diagnosis, by: float) -> Diagnosis:
    """The diagnosis with its spring so many units of the logarithm stiffer."""
    assert found.best is not None
    return replace(found, best=replace(found.best, x=found.best.x + by))


def test_the_errors_are_those_of_the_result(run: StudyRun) -> None:
    errors = plain_errors(run.diagnosis)
    assert errors is not None
    fitted = [f for f in run.result["fit"] if f["role"] == "fit"]
    assert errors[1] == pytest.approx(NOISE, rel=0.2)
    for error, stage in zip(errors, ("parameters", "final"), strict=True):
        assert min(f[stage] for f in fitted) <= 1.001 * error
        assert max(f[stage] for f in fitted) >= 0.999 * error


def test_the_misfit_is_that_of_the_final_model(run: StudyRun) -> None:
    found = run.diagnosis
    assert found.best is not None
    assert found.misfit == found.best.fitted < 1.2
    assert replace(found, best=None).misfit == found.null.score > 2


def test_nothing_is_said_of_what_comes_nearer_or_of_nothing(run: StudyRun) -> None:
    assert run.result["verdict"] == "missing-physics"
    assert further_off(run.diagnosis, plain_errors(run.diagnosis)) == ""
    assert plain_errors(replace(run.diagnosis, best=None)) is None


def test_what_is_further_off_is_named_with_both_errors(run: StudyRun) -> None:
    far = stiffer(run.diagnosis, 3.0)
    before, after = plain_errors(far) or (0.0, 0.0)
    assert after > far.settings.worse * before
    text = further_off(far, (before, after))
    assert text.startswith(f"support stiffness at node {NODE} to ground, Z explains")
    assert f"{100 * after:.3g} % off with it and {100 * before:.3g} % without it" in text
    # no nearer in the band, it is not said to explain that
    assert text.startswith(f"support stiffness at node {NODE} to ground, Z explains the data that chose best, but as a")
    assert " Hz" not in text


def test_what_a_law_won_by_is_told_as_what_it_leaves_there(run: StudyRun) -> None:
    """Friction that was 97.7 % off was said to explain the recordings from 61.6 to 836 Hz, and then their beginning
    alone."""
    found = run.diagnosis
    before, after = errors_in_band(found)
    assert after < 2 * NOISE < before
    low, high = found.problem.band
    band = f"{plain(low, 3)} to {plain(high, 3)} Hz"
    left = f"leaves {plain(100 * after, 3)} % of the recordings from {band}, where {plain(100 * before, 3)} % is left"
    assert f"{left} without it, but as a whole the recordings are 97.7 % off with" in further_off(found, (0.15, 0.977))
    # of the beginning the law comes nearer, as a whole it does not
    far = stiffer(found, 3.0)
    told = further_off(far, (0.15, 0.977), LATER, beginning=replace(found, sigma=4.0))
    assert f" % of about the first 0.75 s of the recordings from {band}, where " in told
    assert told.endswith(f"15 % without it, so that it is not told. {LATER}")


def test_errors_in_the_band_are_those_of_its_lines(run: StudyRun) -> None:
    found = run.diagnosis
    record = found.problem.records[0]
    one = replace(found, problem=found.problem.on([record]))
    assert errors_in_band(one)[1] == pytest.approx(left_in_band(found, record))


def test_a_law_that_wins_but_is_further_off_is_not_told(run: StudyRun, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(verdict, "further_outside_alone", lambda _: False)
    undecided = replace(run.diagnosis, verdict="", best=None, advice="")
    assert decide(undecided).verdict == "missing-physics"
    strict = replace(undecided, settings=replace(undecided.settings, worse=0.0))
    found = decide(strict)
    assert found.verdict != "missing-physics"
    assert found.best is None
    assert "is not told" in found.advice


@pytest.mark.parametrize(
    ("inside", "outside", "recorded", "alone"),
    [(0.5, 0.8, 1.0, True), (1.0, 0.8, 1.0, False), (0.5, 1.2, 1.0, False), (0.5, 3.0, 4.0, False)],
    ids=["outside alone", "no nearer in the band", "what was not recorded", "much was recorded outside"],
)
def test_what_is_further_off_outside_the_band_alone_may_be_the_likeliest(
    run: StudyRun, monkeypatch: pytest.MonkeyPatch, inside: float, outside: float, recorded: float, alone: bool
) -> None:
    """A recording of a strong line in the band and a weak one outside, both models off by shares of these."""
    found = run.diagnosis
    record = found.problem.records[0]
    n, period = record.n, record.n * record.dt
    at = [np.round(f * period) / period for f in (0.5 * sum(found.problem.band), 1.2 * found.problem.band[1])]
    strong, weak = (np.tile(np.sin(2 * np.pi * f * record.dt * np.arange(n)), (len(record.y), 1)) for f in at)
    y = 10 * strong + recorded * weak
    problem = SimpleNamespace(records=[replace(record, y=y)], band=found.problem.band)
    one = cast(Diagnosis, SimpleNamespace(problem=problem, sigma=0.0, settings=found.settings))
    monkeypatch.setattr(outside_band, "updated", lambda *_: y + strong + 0.6 * weak)
    monkeypatch.setattr(outside_band, "final", lambda *_: y + inside * strong + outside * weak)
    assert outside_band.further_outside_alone(one) is alone
    # then the law is told, and not surely
    monkeypatch.setattr(verdict, "further_outside_alone", lambda _: alone)
    undecided = replace(found, verdict="", best=None, advice="", settings=replace(found.settings, worse=0.0))
    told = decide(undecided)
    assert (told.best is not None, "the likeliest, and no more" in told.advice) == (alone, alone)
    assert told.verdict != "missing-physics"


def test_a_law_of_a_beginning_that_is_further_off_as_a_whole_has_no_name(
    run: StudyRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[float] = []

    def further_off(found: Diagnosis, errors: object, what_to_do: str = "", beginning: Diagnosis | None = None) -> str:
        assert (found.sigma == 0) is (beginning is not None)
        asked.append(found.sigma)
        return f"it is further off. {what_to_do}" if found.sigma == 0 else ""

    monkeypatch.setattr(verdict, "further_off", further_off)
    found = decide(replace(run.diagnosis, verdict="", best=None, advice="", sigma=2.0))
    assert asked == [2.0, 0.0]
    assert found.verdict == "located-not-named"
    assert found.best is None
    assert found.place is not None
    assert found.advice == f"it is further off. {LATER}"


def test_the_advice_says_how_much_of_the_recordings_a_law_of_a_beginning_explains(run: StudyRun) -> None:
    found = decide(replace(run.diagnosis, verdict="", best=None, advice="", sigma=2.0))
    assert found.best is not None
    assert found.best.name == "support_stiffness"
    assert found.advice.startswith("the law explains about the first")
    # of whole recordings a law was held to its free force already
    assert decide(replace(run.diagnosis, verdict="", best=None, advice="")).verdict == "missing-physics"


def test_responses_that_do_not_follow_from_the_force_tell_nothing(tmp_path: Path) -> None:
    study = write_study(tmp_path, Truth())
    draw = np.random.default_rng(1)
    for name, level in (("low", 1.0), ("high", 3.0)):
        u = force(level, 5, 1024)
        y = respond(tmp_path, Truth(), u)
        noise = draw.standard_normal(y.shape) * y.std(axis=1, keepdims=True)
        write_uff(tmp_path / f"{name}.uff", functions_of(recording(name, u, noise)))
    run = diagnose(study)
    assert isinstance(run, StudyRun)
    assert run.result["verdict"] == "undetermined"
    assert run.result["findings"] == []
    assert "the responses hardly follow from the force" in run.result["advice"]
    assert not run.diagnosis.ranked


def test_a_law_that_explains_does_not_silence(run: StudyRun) -> None:
    errors = plain_errors(run.diagnosis)
    assert silenced(run.diagnosis, errors) == ""
    strict = replace(run.diagnosis, settings=replace(run.diagnosis.settings, silent=0.0))
    assert "support stiffness at node" in silenced(strict, errors)
    # motion that grows without end beside a model that follows the recordings is no silence
    assert silenced(run.diagnosis, (0.3, 5e45)) == ""
    assert "altogether off with it and 30 % without it" in further_off(run.diagnosis, (0.3, 5e45))
    assert "silencing the model" in silenced(run.diagnosis, (1.2, 5e45))


@pytest.mark.parametrize(
    ("physics", "errors", "off"),
    [
        ("load_misplaced", (0.53, 0.91), True),
        ("load_misplaced", (0.53, 0.02), False),
        # forces that nobody recorded are not among those of a prediction
        ("unmeasured_force", (0.53, 0.91), False),
    ],
)
def test_a_force_elsewhere_that_is_further_off_is_not_told(
    monkeypatch: pytest.MonkeyPatch, physics: str, errors: tuple[float, float], off: bool
) -> None:
    told = cast(Any, SimpleNamespace(load=SimpleNamespace(physics=physics), settings=Settings()))
    monkeypatch.setattr(verdict, "whole_errors", lambda found: errors)
    assert verdict._off_with_the_load(told) is off


def test_a_law_of_a_beginning_whose_motion_can_be_followed_is_not_all(
    run: StudyRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it leaves later, and models that explain as much do not part by, is of something else."""
    monkeypatch.setattr(verdict, "parting", lambda found: Parting(otherwise="something else is missing"))
    found = decide(replace(run.diagnosis, verdict="", best=None, advice="", sigma=2.0))
    assert found.verdict == "located-not-named"
    assert found.best is not None
    assert found.advice == "something else is missing"


def test_a_law_that_all_recordings_together_hardly_show_is_not_told(run: StudyRun) -> None:
    """A pipe's control was told a mass of 0.0005 +- 0.0022: of two blows the one predicted the other badly, but a model
    fitted to both left as little without the mass."""
    undecided = replace(run.diagnosis, verdict="", best=None, place=None, advice="")
    law = run.diagnosis.best
    assert law is not None
    null = undecided.null
    hardly = replace(null, misfit=np.full_like(null.misfit, 1.0001 * law.fitted), prior=law.prior)
    told = decide(replace(undecided, null=hardly))
    assert told.best is None
    assert told.verdict != "missing-physics"
    assert "support stiffness" in told.advice
    assert "less than what a law's parameters cost" in told.advice
    clearly = replace(null, misfit=np.full_like(null.misfit, 1.2 * law.fitted), prior=law.prior)
    assert decide(replace(undecided, null=clearly)).verdict == "missing-physics"
