"""Noise that is none, and what no force explains: levels of noise that belong to what a free force leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from femend.diagnose.locating.locate import Located, refitted, shortlist
from femend.diagnose.updating.update import UpdatedModel
from femend.estimate import FitRecord, Problem

__all__ = ["Louder", "louder", "quieter_records"]

# misfit of one free force below which the noise was overrated: an honest estimate leaves about one
OVERRATED = 0.2
# the noise that is left is at least this share of a sensor's motion
FLOOR = 1e-3
# misfit of one free force from which what it leaves counts as noise: the model itself is that far off
UNDERRATED = 1.3


def quieter_records(
    problem: Problem, located: Sequence[Located], overrated: float = OVERRATED
) -> list[FitRecord] | None:
    """The records with the noise that a free force at the best place leaves; None where the noise was no less.

    The noise of a recording is what does not repeat or does not follow the recorded force. A force that nobody recorded
    does neither; but it moves all sensors together, as noise does not, so that one free force takes it away.
    `overrated` is the misfit of that force below which the noise was less.
    """
    single = [f for f in located if f.place.n_w == 1]
    if not single or min(r.y.shape[0] for r in problem.records) < 3 or single[0].fit.score > overrated:
        return None
    records = []
    for record, misfit in zip(problem.records, single[0].fit.misfit, strict=True):
        left = record.noise * np.sqrt(misfit)
        records.append(replace(record, noise=np.maximum(left, FLOOR * record.y.std(axis=1))))
    return records


@dataclass(frozen=True, eq=False)
class Louder:
    """A start and its places with what no single force explains counted as noise; `factor` by which the squares of each
    record's noise rose."""

    start: UpdatedModel
    located: list[Located]
    factor: dict[str, float]


def louder(start: UpdatedModel, located: Sequence[Located]) -> Louder | None:
    """The start with as much noise as a free force at the best place leaves; None where that is hardly more.

    What is wrong with the model everywhere (its mesh, its idealisation, scatter of its properties) is noise to a law at
    one place. Were it held to be less, the model's unknowns would be driven away from what is known of them to follow
    it, and the relief that any law brings to them would count as evidence for that law.
    """
    first = min((f.fit.score for f in located), default=0.0)
    if first <= UNDERRATED:
        return None
    best = shortlist(located)[0].fit
    factor = {r.name: max(float(m), 1.0) for r, m in zip(start.problem.records, best.misfit, strict=True)}
    problem = start.problem.on([replace(r, noise=r.noise * np.sqrt(factor[r.name])) for r in start.problem.records])
    (null,) = problem.fit([start.null.hypothesis], [(start.null.p, start.null.x)])
    if null is None:
        return None
    return Louder(replace(start, problem=problem, null=null), refitted(problem, located), factor)
