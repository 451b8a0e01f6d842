"""A deck's damping ratio that is off by one factor for all modes is no evidence that anything is missing."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from small_study import ZETA, Truth

SAME = Truth((7.3e10, 6.8e10))


def of_ratio(folder: Path, ratio: float, truth: Truth = SAME) -> StudyRun:
    """The small study of a truth whose deck has another damping ratio, diagnosed."""
    path = small_study.write_study(folder, truth)
    path.write_text(path.read_text().replace("ratio = 0.01", f"ratio = {ratio}"))
    run = diagnose(path)
    assert isinstance(run, StudyRun)
    return run


@pytest.mark.parametrize("ratio", [ZETA / 6, 6 * ZETA])
def test_damping_that_is_off_by_a_factor_costs_no_mode_its_prior(tmp_path: Path, ratio: float) -> None:
    run = of_ratio(tmp_path, ratio)
    found = run.diagnosis
    assert run.result["verdict"] == "parameters-only"
    assert found.problem.zeta == pytest.approx(ZETA, rel=0.1)
    assert found.problem.drawn_zeta == ratio
    n = len(found.reduced.names) + found.problem.n_tuned
    mean, sd = found.problem.prior(found.reduced)
    strains = (found.null.p[n:] - mean[n:]) / sd[n:]
    assert np.abs(strains).max() < 0.5
    # neither law nor place is looked for
    assert found.ranked == []
    # the deck as it is keeps its ratio
    np.testing.assert_array_equal(found.nominal[1][n:], np.log(ratio))


def test_damping_that_is_nearly_right_stays_what_modes_are_expected_around(tmp_path: Path) -> None:
    assert of_ratio(tmp_path, 1.3 * ZETA).diagnosis.problem.zeta == 1.3 * ZETA


def test_a_dashpot_beside_a_damping_that_is_off_is_named(tmp_path: Path) -> None:
    truth = Truth(SAME.E, laws=[(7, "viscous_damper", {"c": 25.0})])
    run = of_ratio(tmp_path, ZETA / 6, truth)
    (finding,) = run.result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("viscous_damper", [7])
    assert finding["parameters"]["c"]["value"] == pytest.approx(25.0, rel=0.15)
