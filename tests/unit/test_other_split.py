"""Recordings choose in which it shows what the best law leaves, where that is in none of those that chose it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.several import other_split
from femend.diagnose.several.other_split import chosen_where_it_shows
from femend.diagnose.several.pairs import Searched
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import searched


@pytest.fixture
def first(dashpot_and_cubic: StudyRun) -> Searched:
    return searched(dashpot_and_cubic.diagnosis)


def others_of(first: Searched) -> tuple[str, str]:
    """The recording that chooses and the one that does not."""
    (chose,) = (r.name for r in first.split.choosing.records)
    (other,) = (r.name for r in first.split.whole.records if r.name != chose)
    return chose, other


def with_left(monkeypatch: pytest.MonkeyPatch, **left: float) -> None:
    monkeypatch.setattr(other_split, "_left_in_each", lambda _: left)


def one_force_leaves(first: Searched, misfit: float) -> Searched:
    """The search with a free force at any place leaving so much."""
    left = [cast(Any, SimpleNamespace(misfit=np.array([misfit]), prior=0.0, p=one.fit.p)) for one in first.located]
    return replace(first, located=[replace(one, fit=fit) for one, fit in zip(first.located, left, strict=True)])


def test_what_is_left_elsewhere_has_that_recording_choose(first: Searched, monkeypatch: pytest.MonkeyPatch) -> None:
    chose, other = others_of(first)
    with_left(monkeypatch, **{chose: 1.0, other: 50.0})
    found = chosen_where_it_shows(one_force_leaves(first, 10.0))
    assert found is not None
    assert other in [r.name for r in found.split.choosing.records]
    assert [r.score for r in found.ranked] == sorted(r.score for r in found.ranked)
    # all of it is of the new split, in other windows too
    assert found.sigma == 0.0
    narrow = found.at(1.0)
    assert narrow.split is found.split
    assert narrow.sigma == 1.0
    assert narrow.null_score != found.null_score


@pytest.mark.parametrize(("seen", "elsewhere", "one_force"), [(5.0, 50.0, 10.0), (1.0, 2.0, 10.0), (1.0, 50.0, 1.0)])
def test_recordings_stay_where_it_shows_already_or_hardly_or_one_force_explains(
    seen: float, elsewhere: float, one_force: float, first: Searched, monkeypatch: pytest.MonkeyPatch
) -> None:
    chose, other = others_of(first)
    with_left(monkeypatch, **{chose: seen, other: elsewhere})
    assert chosen_where_it_shows(one_force_leaves(first, one_force)) is None


def test_what_a_law_leaves_in_each_recording_is_that_of_its_own_simulation(first: Searched) -> None:
    left = other_split._left_in_each(first)
    chose, other = others_of(first)
    assert set(left) == {chose, other}
    assert left[chose] == pytest.approx(first.ranked[0].candidate.chosen, rel=0.02)
