"""Noise that is none: what a single force explains at all sensors at once was taken for noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femend.diagnose.locate import Located
from femend.estimate import FitRecord, Problem

__all__ = ["quieter_records"]

# misfit of one free force below which the noise was overrated: an honest estimate leaves about one
OVERRATED = 0.2
# the noise that is left is at least this share of a sensor's motion
FLOOR = 1e-3


def quieter_records(problem: Problem, located: Sequence[Located]) -> list[FitRecord] | None:
    """The records with the noise that a free force at the best place leaves; None where the noise was no less.

    The noise of a recording is what does not repeat or does not follow the recorded force. A force that nobody recorded
    does neither; but it moves all sensors together, as noise does not, so that one free force takes it away.
    """
    single = [f for f in located if f.place.n_w == 1]
    if not single or min(r.y.shape[0] for r in problem.records) < 3 or single[0].fit.score > OVERRATED:
        return None
    records = []
    for record, misfit in zip(problem.records, single[0].fit.misfit, strict=True):
        left = record.noise * np.sqrt(misfit)
        records.append(replace(record, noise=np.maximum(left, FLOOR * record.y.std(axis=1))))
    return records
