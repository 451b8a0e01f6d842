"""Pairs of nodes of different members, where no place listed explains the recordings."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from femend.diagnose.locating.locate import locate
from femend.diagnose.naming.between_members import with_pairs_between
from femend.model import read_model
from femend.model.places.member_pairs import pairs_between_members
from femend.model.places.places import find_places, topology

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


def test_nodes_of_different_members_are_pairs(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(small_study.deck())
    model = read_model(path)
    listed = find_places(model)
    pairs = pairs_between_members(model, topology(model), listed)
    had = {(frozenset(p.nodes), p.direction) for p in listed}
    own = [(frozenset(p.nodes), p.direction) for p in pairs]
    # members end at the nodes 1, 7, 9 and 13; all of them lie on one line along X
    assert (frozenset((5, 11)), "Z") in own
    assert (frozenset((5, 11)), "") in own
    assert (frozenset((3, 5)), "Z") not in own
    assert not had.intersection(own)
    assert len(set(own)) == len(own)
    assert all(p.unlikely for p in pairs)
    # a held node is only joined along the line: across it that is the ground
    assert {p.direction for p in pairs if 1 in p.nodes} <= {""}
    away = [round(float(np.ptp(model.xyz[[model.index(n) for n in p.nodes], 0])), 9) for p in pairs]
    assert away == sorted(away)


def test_a_tie_inside_two_members_is_found(tmp_path: Path) -> None:
    start = small_study.updated(tmp_path, small_study.Truth((7.3e10, 6.8e10), ("CELAS2,900,2.+4,5,3,11,3",)))
    places = find_places(start.reduced.model)
    located = locate(start.problem, start.reduced, places, start.null)
    found, among = with_pairs_between(start, located, places)
    assert set(found[0].place.nodes) == {5, 11}
    assert found[0].place.direction == "Z"
    assert found[0].fit.score < 1.2
    assert any(p is found[0].place for p in among)
    # where a force there explains the recordings, no other pairs are asked
    assert with_pairs_between(start, found, among) == (found, among)


def test_nothing_is_added_where_a_listed_place_explains(tmp_path: Path) -> None:
    start = small_study.updated(tmp_path, small_study.Truth((7.3e10, 6.8e10), ("CELAS2,900,3.+4,7,3",)))
    places = find_places(start.reduced.model)
    located = locate(start.problem, start.reduced, places, start.null)
    assert with_pairs_between(start, located, places) == (located, places)
