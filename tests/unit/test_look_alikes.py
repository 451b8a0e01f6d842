"""Places whose laws are fitted: the first ones, and those that explain as much."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from femend.diagnose.locating.alike import with_look_alikes
from femend.diagnose.locating.locate import Located, locate, shortlist
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel
from femend.model import Place
from femend.model.places.places import find_places

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

Found = tuple[UpdatedModel, list[Place], list[Located]]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    """Places of a frame whose node 7 stands on a spring, those far from an explanation among them."""
    truth = small_study.Truth((7.3e10, 6.8e10), ("CELAS2,900,3.+4,7,3",))
    start = small_study.updated(tmp_path_factory.mktemp("spring"), truth)
    places = [p for p in find_places(start.reduced.model) if p.n_w == 1 and p.kind != "base"]
    return start, places, shortlist(locate(start.problem, start.reduced, places, start.null))


def tried(found: Found, located: list[Located]) -> list[Located]:
    start, places, _ = found
    return with_look_alikes(start.problem, start.reduced, located, places, Settings())


def test_where_one_force_explains_no_place_is_tried_whose_force_does_not(found: Found) -> None:
    located, settings = found[2], Settings()
    assert located[0].fit.score < settings.consistent
    reach = (1 + settings.further) * located[0].cost + settings.reach
    (at_7,) = (one for one in located if one.place.nodes == (7,) and one.place.direction == "Z")
    far = [replace(one, squares=one.squares + 2 * reach) for one in located if one is not at_7]
    assert len(far) > settings.places
    assert [one.place for one in tried(found, [at_7, *far])] == [at_7.place]
    # beside a force that does not explain them, or bends the model, the next places are tried too
    unexplained = replace(at_7.fit, misfit=10 * at_7.fit.misfit)
    for fit in (unexplained, replace(at_7.fit, prior=3 * settings.gain_cost)):
        assert len(tried(found, [replace(at_7, fit=fit), *far])) == settings.places
