"""A deck's damping ratio that is off by one factor for all modes is no evidence that anything is missing."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.model import read_model
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_plate import CORNERS, plate, write_study
from small_study import ZETA

# m: a dozen modes in the band
THIN = 0.0006


def of_ratio(folder: Path, ratio: float) -> StudyRun:
    """A plate on its corners whose deck has another damping ratio, diagnosed."""
    plate(folder, CORNERS, thickness=THIN)
    real = folder / "truth.bdf"
    real.write_text((folder / "plate.bdf").read_text().replace("7.+10", "6.7+10"))
    run = diagnose(write_study(folder, read_model(real), ratio, THIN))
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
    assert np.abs((found.null.p[n:] - mean[n:]) / sd[n:]).max() < 0.5
    # no law is looked for
    assert found.ranked == []
    # the deck as it is keeps its ratio
    np.testing.assert_array_equal(found.nominal[1][n:], np.log(ratio))


def test_damping_that_is_nearly_right_stays_what_modes_are_expected_around(tmp_path: Path) -> None:
    assert of_ratio(tmp_path, 1.3 * ZETA).diagnosis.problem.zeta == 1.3 * ZETA
