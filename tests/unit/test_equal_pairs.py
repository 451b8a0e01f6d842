"""Of pairs of places whose forces explain as much, the one whose forces follow their own places' motion is taken."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import LINES, Located, cost_of
from femend.diagnose.several.equal_pairs import _left, likeliest_equal
from femend.diagnose.several.pairs import Searched, plain
from femend.model import Place
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import searched


@pytest.fixture
def first(dashpot_and_cubic: StudyRun) -> Searched:
    return searched(dashpot_and_cubic.diagnosis)


def ground(first: Searched, node: int) -> Place:
    return next(
        p for p in first.places if p.kind == "ground" and p.nodes == (node,) and p.n_w == 1 and p.direction == "Z"
    )


def located(first: Searched, at: Place, second: Place) -> Located:
    few = first.problem.sparing(LINES)
    p = plain(first, first.located[0].fit.p)
    (fit,) = few.fit([hypothesis_of(second, first.reduced, (at,))], [(p, np.zeros(0))], iterations=30)
    assert fit is not None
    return Located(second, fit, cost_of(few, fit, 0.0))


def test_forces_at_the_right_places_follow_their_own_motion_best(first: Searched) -> None:
    right = located(first, ground(first, 7), ground(first, 13))
    wrong = located(first, ground(first, 9), ground(first, 4))
    assert _left(first.problem, right.fit) < _left(first.problem, wrong.fit)


def test_the_right_pair_is_kept_and_found_from_one_beside_it(first: Searched) -> None:
    for nodes in ((7, 13), (8, 13)):
        at, second = (ground(first, n) for n in nodes)
        found, other = likeliest_equal(first.problem, first.reduced, first.places, located(first, at, second), at)
        assert found.fit.score < first.settings.adequate
        told = sorted(n for place in (other, found.place) for n in place.nodes)
        assert len(told) == 2
        assert abs(told[0] - 7) <= 1
        assert told[1] == 13


def test_a_pair_with_a_part_of_the_model_is_left_as_it_is(first: Searched) -> None:
    member = next(p for p in first.places if p.part)
    one = first.located[0]
    assert likeliest_equal(first.problem, first.reduced, first.places, one, member) == (one, member)
