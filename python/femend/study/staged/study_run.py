"""A finished run of a study in stages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from femend.data import Test
from femend.diagnose.staged import Flow, Setup, StagedData
from femend.model import Model, Pairing
from femend.study.file.study import Study
from femend.study.result.predictions import Prediction

__all__ = ["StagedRun"]


@dataclass(frozen=True, eq=False)
class StagedRun:
    """A finished staged run: study, free model, recordings, the flow with terms and the one without, and results."""

    study: Study
    model: Model
    test: Test
    pairing: Pairing
    setup: Setup
    data: StagedData
    final: Flow
    plain: Flow
    predictions: list[Prediction]
    result: dict[str, Any]
