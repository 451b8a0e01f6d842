"""An update that stopped far from the truth is begun again from where free forces put the model."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.locating.locate import Located, locate
from femend.diagnose.settings import Settings
from femend.diagnose.updating.nearer import nearer
from femend.diagnose.updating.update import UpdatedModel
from femend.model.places.places import find_places

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> UpdatedModel:
    return small_study.updated(tmp_path_factory.mktemp("far"), small_study.Truth((7.3e10, 6.8e10)))


@pytest.fixture(scope="module")
def located(start: UpdatedModel) -> list[Located]:
    return locate(start.problem, start.reduced, find_places(start.reduced.model), start.null)


def test_an_update_that_stopped_far_away_comes_to_the_noise(start: UpdatedModel, located: list[Located]) -> None:
    far = start.null.p.copy()
    far[:2] += 0.4
    (stopped,) = start.problem.fit([start.null.hypothesis], [(far, np.zeros(0))], iterations=0)
    assert stopped is not None
    assert stopped.score > 100
    again = nearer(replace(start, null=stopped), located, Settings())
    assert again.null.cost == pytest.approx(start.null.cost, rel=1e-2)
    np.testing.assert_allclose(again.null.p[:2], start.null.p[:2], atol=0.01)


def test_one_at_the_noise_stays_as_it_is(start: UpdatedModel, located: list[Located]) -> None:
    assert nearer(start, located, Settings()) is start


def test_without_places_it_stays_as_it_is(start: UpdatedModel) -> None:
    (stopped,) = start.problem.fit([start.null.hypothesis], [(start.null.p + 0.3, np.zeros(0))], iterations=0)
    assert stopped is not None
    far = replace(start, null=stopped)
    assert nearer(far, [], Settings()) is far
