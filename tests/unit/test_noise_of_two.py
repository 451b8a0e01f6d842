"""What no two forces explain counts as noise to two laws."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.naming.judge import compared_in
from femend.diagnose.several.noise_of_two import beyond_two_forces
from femend.diagnose.several.pairs import Searched
from femend.diagnose.updating.noise import UNDERRATED
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import searched

QUIETER = 3.0


def beside(d: Diagnosis, quieter: float) -> tuple[Searched, Located]:
    """The search with the noise held to be `quieter` times less, and the second of the two true places in it with the
    fit of free forces at both."""
    first = searched(d)
    problem = d.problem.on([replace(r, noise=r.noise / quieter) for r in d.problem.records])
    at = [
        next(p for p in first.places if p.kind == "ground" and p.nodes == (n,) and p.direction == "Z") for n in (7, 13)
    ]
    (fit,) = problem.fit([hypothesis_of(at[0], d.reduced, at[1:])], [(d.located[0].fit.p, np.zeros(0))])
    assert fit is not None
    split, given = first.split.of(problem), replace(d.given, split=first.split.of(problem))
    ranked = compared_in(given, first.ranked, 0.0)
    there = replace(first, problem=problem, split=split, ranked=ranked, floor=0.0)
    return there, Located(at[0], fit, squares_of(problem, fit, 0.0))


def test_what_two_forces_leave_is_noise(dashpot_and_cubic: StudyRun) -> None:
    """Where the noise is held to be less than that, it comes out as that, and laws compare about as they do in it."""
    d = dashpot_and_cubic.diagnosis
    _, as_given = beside(d, 1.0)
    first, second = beside(d, QUIETER / np.sqrt(as_given.fit.score))
    assert second.fit.score > UNDERRATED
    louder = beyond_two_forces(first, second)
    for before, after, left in zip(first.problem.records, louder.problem.records, second.fit.misfit, strict=True):
        np.testing.assert_allclose(after.noise, before.noise * np.sqrt(left))
    # laws are judged anew in that noise, in which they leave less
    by_law = {(id(r.located), r.candidate.name): r.candidate for r in first.ranked}
    for r in louder.ranked:
        assert r.candidate.chosen < by_law[id(r.located), r.candidate.name].chosen
    assert louder.null_score > louder.ranked[0].score
    (same,) = {id(p.problem) for p in (louder, louder.at(5.0))}
    assert same == id(louder.problem)


def test_noise_as_it_is_stays(dashpot_and_cubic: StudyRun) -> None:
    first, second = beside(dashpot_and_cubic.diagnosis, 1.0)
    assert beyond_two_forces(first, second) is first
