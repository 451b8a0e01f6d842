"""Places in directions that were not tried."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.diagnose.locating.directions import KEPT, in_other_directions
from femend.diagnose.locating.locate import Located, locate
from femend.diagnose.updating.update import UpdatedModel
from femend.model import Place
from femend.model.places.places import find_places

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> UpdatedModel:
    truth = small_study.Truth((7.3e10, 6.8e10), ("CELAS2,900,3.+4,7,3",))
    return small_study.updated(tmp_path_factory.mktemp("spring"), truth)


@pytest.fixture(scope="module")
def places(start: UpdatedModel) -> list[Place]:
    return find_places(start.reduced.model)


@pytest.fixture(scope="module")
def located(start: UpdatedModel, places: list[Place]) -> list[Located]:
    return locate(start.problem, start.reduced, places, start.null)


def test_the_best_of_a_direction_is_found_where_others_were_tried(
    start: UpdatedModel, places: list[Place], located: list[Located]
) -> None:
    tried = [p for p in places if p.n_w == 1 and p.direction != "Z"]
    found = in_other_directions(start.problem, start.reduced, places, start.null, located, tried)
    assert {one.place.direction for one in found} == {"Z"}
    assert all(one.place.kind != "base" for one in found)
    ground = [one.place.nodes for one in found if one.place.kind == "ground"]
    assert ground[0] == (7,)
    assert len(ground) <= KEPT
    assert [one.cost for one in found] == sorted(one.cost for one in found)
    # as good as where all places were sorted out together
    assert found[0].cost < 1.02 * min(one.cost for one in located if one.place.n_w == 1)


def test_nothing_is_left_where_every_direction_was_tried(
    start: UpdatedModel, places: list[Place], located: list[Located]
) -> None:
    assert in_other_directions(start.problem, start.reduced, places, start.null, located, places) == []
    assert in_other_directions(start.problem, start.reduced, places, start.null, [], []) == []


def test_directions_that_leave_clearly_more_are_left_out(
    start: UpdatedModel, places: list[Place], located: list[Located]
) -> None:
    """The spring acts in Z; turning forces elsewhere than there leave much of it."""
    tried = [p for p in places if p.direction == "Z"]
    found = in_other_directions(start.problem, start.reduced, places, start.null, located, tried)
    best = min(one.cost for one in located if one.place.n_w == 1)
    assert all(one.cost < 1.3 * best for one in found)
    # against a model that lacks little no direction is worth it
    assert in_other_directions(start.problem, start.reduced, places, located[0].fit, located, tried) == []
