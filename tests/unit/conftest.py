"""Diagnoses that several files look at, made once."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, diagnosed


@pytest.fixture(scope="session")
def dashpot_and_cubic(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    """A dashpot of 20 N s/m at node 7 and a cubic spring of 2e9 N/m^3 at node 13."""
    laws = [(7, "viscous_damper", {"c": 20.0}), (13, "cubic_stiffness", {"k3": 2.0e9})]
    return diagnosed(tmp_path_factory.mktemp("two"), Truth((7.3e10, 6.8e10), laws=laws))
