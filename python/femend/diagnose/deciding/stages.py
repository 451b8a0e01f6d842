"""Responses to measured forces at the three stages: the deck as it is, the updated model, and what was found added."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.fitting.predict import predict_candidate, predict_linear
from femend.diagnose.fitting.terms import simulate_terms
from femend.estimate import FitRecord

__all__ = ["STAGES", "final", "stages", "updated"]

# accelerations (n_out, n) of a time record, or accelerances (K, n_out) of a column of an FRF
Values = NDArray[Any]
STAGES = ("nominal", "parameters", "final")


def stages(found: Diagnosis, record: FitRecord, order: int = 2) -> dict[str, Values]:
    """Responses of every stage: (n_out, n) for time records, accelerations or another derivative of the displacements
    by its `order`; (K, n_out) for a column of an FRF. Forces act when and where
    they did, and sensors show it when they do."""
    given, record = record, record if found.off is None else found.off.driving(record)
    nominal = predict_linear(found.problem, *found.nominal, np.zeros(0), record, order)
    before = updated(found, record, order)
    made = {"nominal": nominal, "parameters": before, "final": final(found, record, before, order)}
    return made if found.off is None else {stage: found.off.heard(given, y) for stage, y in made.items()}


def updated(found: Diagnosis, record: FitRecord, order: int = 2) -> Values:
    """Responses of the updated model to which nothing is added, `order` as of `stages`."""
    return predict_linear(found.problem, found.null.hypothesis, found.null.p, np.zeros(0), record, order)


def final(found: Diagnosis, record: FitRecord, before: Values, order: int = 2) -> Values:
    """Responses of the final model, `order` as of `stages`; those of the updated one, `before`, where nothing is added
    or the final one has none (a nonlinear law has no FRF, and its simulation may end)."""
    after: Values | None = None
    if found.further is not None and record.frf is None:
        after = simulate_terms(found.problem, found.further.terms, record, order)
    elif found.best is not None:
        fallback = found.place.fit.hypothesis if found.place is not None else found.null.hypothesis
        after = predict_candidate(found.problem, found.best, fallback, record, order)
    elif found.load is not None and found.by_load:
        load = found.load
        return predict_linear(load.problem, load.fit.hypothesis, load.fit.p, np.zeros(0), load.record(record), order)
    return after if after is not None and np.isfinite(after).all() else before
