"""Dashpots beside a force nobody recorded: found where one is missing, and none where nothing or something else is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from tests.small_study import Truth
from tests.unit.test_unrecorded import STIFFER, records_of, without_force

from femend.diagnose.driven.dashpots import best_dashpot, led_by, told
from femend.diagnose.driven.unrecorded import Driven, locate_drive
from femend.diagnose.settings import Settings
from femend.model import read_model

C = 30.0


def driven_of(folder: Path, truth: Truth) -> Driven:
    """The drive of a truth of which no force was recorded."""
    records = records_of(without_force(folder, truth))
    return locate_drive(read_model(folder / "model.bdf"), records, 0.01)


@pytest.fixture(scope="module")
def damped(tmp_path_factory: pytest.TempPathFactory) -> Driven:
    """A dashpot is missing at node 7."""
    return driven_of(tmp_path_factory.mktemp("damped"), Truth(STIFFER, laws=[(7, "viscous_damper", {"c": C})]))


def test_a_dashpot_is_found_with_its_size(damped: Driven) -> None:
    found = best_dashpot(damped, Settings())
    assert found is not None
    assert (found.place.nodes, found.place.direction.lstrip("+")) == ((7,), "Z")
    assert found.c == pytest.approx(C, rel=0.15)
    said = told(found, "SI")
    assert "a dashpot at node 7 to ground" in said
    assert "N*s/m, explains clearly more" in said


def test_its_place_comes_first_and_no_other_is_lost(damped: Driven) -> None:
    found = best_dashpot(damped, Settings())
    assert found is not None
    located = led_by(found, damped)
    assert located[0].place is found.place
    assert {id(one.place) for one in located} == {id(one.place) for one in damped.located} | {id(found.place)}
    without = replace(damped, located=[one for one in damped.located if one.place is not found.place])
    assert led_by(found, without)[0].place is found.place


def test_nothing_missing_is_no_dashpot_and_what_leaves_more_than_noise_is_none(damped: Driven, tmp_path: Path) -> None:
    assert best_dashpot(driven_of(tmp_path, Truth(STIFFER)), Settings()) is None
    assert best_dashpot(damped, Settings(consistent=0.1)) is None
