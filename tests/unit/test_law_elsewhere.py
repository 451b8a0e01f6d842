"""Nodes at which the best law explains more than where it was tried."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from femend.diagnose.dressed import hypothesis_of
from femend.diagnose.judge import Given, to_beat
from femend.diagnose.law_elsewhere import where_it_explains_more
from femend.diagnose.locate import LINES, Located, squares_of
from femend.diagnose.name import name_physics
from femend.diagnose.ranked import Ranked
from femend.diagnose.settings import Settings
from femend.diagnose.split import split_records
from femend.diagnose.update import UpdatedModel
from femend.model import Place
from femend.model.places import find_places

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> UpdatedModel:
    truth = small_study.Truth((7.3e10, 6.8e10), ("CELAS2,900,3.+4,7,3",))
    return small_study.updated(tmp_path_factory.mktemp("spring"), truth)


@pytest.fixture(scope="module")
def grounds(start: UpdatedModel) -> list[Place]:
    return [p for p in find_places(start.reduced.model) if p.kind == "ground"]


@pytest.fixture(scope="module")
def given(start: UpdatedModel) -> Given:
    split = split_records(start.problem, start.null, [])
    return Given(split, start.reduced, start.g_rows, start.null.p, Settings())


@pytest.fixture(scope="module")
def at_node_6(start: UpdatedModel, grounds: list[Place], given: Given) -> list[Ranked]:
    """Laws at the node beside that of the spring, as if it alone had been located."""
    beside = next(p for p in grounds if p.nodes == (6,) and p.direction == "Z")
    few = start.problem.sparing(LINES)
    (fit,) = few.fit([hypothesis_of(beside, start.reduced)], [(start.null.p, start.null.x)])
    assert fit is not None
    return name_physics(given, [Located(beside, fit, squares_of(few, fit, 0.0))])[0]


def test_the_node_of_a_law_is_found_from_the_one_beside(
    start: UpdatedModel, grounds: list[Place], given: Given, at_node_6: list[Ranked]
) -> None:
    alone = to_beat(given, start.null)
    found = where_it_explains_more(given, grounds, at_node_6, alone.score)
    assert found[0].place.nodes == (7,)
    assert found[0].fit.score < 1.2
    # nothing is looked for where the law gains nothing, nor from a law that acts elsewhere than against the ground
    assert where_it_explains_more(given, grounds, at_node_6, at_node_6[0].score) == []
    assert where_it_explains_more(given, grounds, [], alone.score) == []
    bent = [replace(at_node_6[0], candidate=replace(at_node_6[0].candidate, joint=None))]
    assert where_it_explains_more(given, grounds, bent, alone.score) == []
