"""A finished run of a study."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from femend.data import Test
from femend.diagnose import Diagnosis
from femend.estimate import FitRecord
from femend.model import Model, Pairing
from femend.study.file.study import Study
from femend.study.result.predictions import Prediction

__all__ = ["StudyRun"]


@dataclass(frozen=True, eq=False)
class StudyRun:
    """A finished run: the study, model, recordings and pairing, the diagnosis, its predictions and its result."""

    study: Study
    model: Model
    test: Test
    pairing: Pairing
    records: list[FitRecord]
    diagnosis: Diagnosis
    predictions: list[Prediction]
    result: dict[str, Any]
