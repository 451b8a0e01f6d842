"""Modes that were put far off beside a finding are told, and parameters are told less certain for it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.deciding.deck_with_law import deck_with_law, strain_of_modes
from femend.model import Parameter
from femend.study.result.result import OFF_MODEL
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import LEVELS, NOISE, PARAMETERS, Truth, study_text, write_study

SPRING = "CELAS2,900,2.+4,7,3"


def diagnosed(folder: Path, parameters: tuple[Parameter, ...]) -> StudyRun:
    """The run of a study of a structure with a spring, one half of which is 6 % stiffer than the deck has it."""
    path = write_study(folder, Truth((7.0e10, 7.42e10), more=(SPRING,)))
    path.write_text(study_text({name: role for name, (role, _) in LEVELS.items()}, parameters))
    run = diagnose(path)
    assert isinstance(run, StudyRun)
    assert [one["physics"] for one in run.result["findings"]] == ["support_stiffness"]
    return run


@pytest.fixture(scope="module")
def named(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    return diagnosed(tmp_path_factory.mktemp("named"), PARAMETERS)


@pytest.fixture(scope="module")
def without(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    return diagnosed(tmp_path_factory.mktemp("without"), PARAMETERS[:1])


def test_a_stiffness_that_is_no_parameter_is_told_by_the_modes_it_moves(without: StudyRun) -> None:
    told = deck_with_law(without.diagnosis)
    assert told is not None
    assert told.fitted == pytest.approx(NOISE, rel=0.3)
    assert told.alone > 10 * told.fitted
    assert told.modes[0].number == 2
    assert told.modes[0].shift == pytest.approx(0.025, abs=0.01)
    assert told.text in without.result["warnings"]
    assert "name parameters that move these modes" in told.text
    assert "explains nothing of" in replace(told, alone=np.inf).text


def test_a_parameter_that_took_a_part_of_it_is_told_as_uncertain(without: StudyRun) -> None:
    """It comes out some two of the deviations that the fit alone tells below its value."""
    found = without.result["parameters"]["E_root"]
    assert strain_of_modes(without.diagnosis) > 2
    assert abs(found["factor"] - 1) < found["sd"]
    assert 2 * OFF_MODEL < found["sd"] <= PARAMETERS[0].prior_sd


def test_nothing_is_told_where_parameters_do_it(named: StudyRun) -> None:
    assert deck_with_law(named.diagnosis) is None
    assert strain_of_modes(named.diagnosis) == 1
    assert not [text for text in named.result["warnings"] if "frequencies of their own" in text]
    assert named.result["parameters"]["E_tip"]["factor"] == pytest.approx(1.06, abs=0.02)
    assert all(one["sd"] < 0.02 for one in named.result["parameters"].values())


def test_modes_within_their_prior_widen_nothing(without: StudyRun) -> None:
    found = without.diagnosis
    assert found.best is not None
    assert found.best.joint is not None
    first, p = len(found.best.joint.reduced.names), found.best.p.copy()
    p[first : first + found.problem.n_tuned] *= 0.5
    nearer = replace(found, best=replace(found.best, p=p))
    assert strain_of_modes(nearer) == 1
    assert deck_with_law(nearer) is None
