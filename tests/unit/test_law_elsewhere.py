"""Nodes at which the best law explains more than where it was tried."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femend.diagnose import diagnosis
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import LINES, Located, squares_of
from femend.diagnose.locating.oversized import oversized
from femend.diagnose.locating.split import split_records
from femend.diagnose.naming.judge import Given, judge_in, to_beat
from femend.diagnose.naming.laws_at import linear_at
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.settings import Settings
from femend.diagnose.several.law_elsewhere import in_turn, where_it_explains_more
from femend.diagnose.updating.update import UpdatedModel
from femend.model import Place
from femend.model.places.places import find_places
from femend.physics import physics

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


def updated(folder: Path, card: str) -> UpdatedModel:
    return small_study.updated(folder, small_study.Truth((7.3e10, 6.8e10), (card,)))


def given_of(start: UpdatedModel) -> Given:
    split = split_records(start.problem, start.null, [])
    return Given(split, start.reduced, start.g_rows, start.null.p, Settings())


def grounds_of(start: UpdatedModel) -> list[Place]:
    return [p for p in find_places(start.reduced.model) if p.kind == "ground"]


def laws_at(node: int, start: UpdatedModel, given: Given) -> list[Ranked]:
    """Laws at a node in Z, as if it alone had been located."""
    place = next(p for p in grounds_of(start) if p.nodes == (node,) and p.direction == "Z")
    few = start.problem.sparing(LINES)
    (fit,) = few.fit([hypothesis_of(place, start.reduced)], [(start.null.p, start.null.x)])
    assert fit is not None
    tried = linear_at(given, Located(place, fit, squares_of(few, fit, 0.0)), masses_alone=True)[0]
    return judge_in(given, 0.0).in_order([judge_in(given, 0.0).ranked(t) for t in tried])


def test_the_node_of_a_law_is_found_from_the_one_beside(tmp_path: Path) -> None:
    start = updated(tmp_path, "CELAS2,900,3.+4,7,3")
    given, grounds = given_of(start), grounds_of(start)
    alone, beside = to_beat(given, start.null).score, laws_at(6, start, given)
    found = where_it_explains_more(given, grounds, beside, alone)
    assert found[0].place.nodes == (7,)
    assert found[0].fit.score < 1.2
    # nothing is looked for where the law gains nothing, nor from a part of the model
    assert where_it_explains_more(given, grounds, beside, beside[0].score) == []
    assert where_it_explains_more(given, grounds, [], alone) == []
    part = [replace(beside[0], candidate=replace(beside[0].candidate, joint=None))]
    assert where_it_explains_more(given, grounds, part, alone) == []


def test_a_mass_is_looked_for_as_the_same_mass(tmp_path: Path) -> None:
    start = updated(tmp_path, "CONM2,900,7,,0.3")
    given = given_of(start)
    beside = [r for r in laws_at(5, start, given) if r.candidate.name == "added_mass"]
    assert beside[0].candidate.joint is not None
    assert beside[0].candidate.joint.place.kind == "mass"
    found = where_it_explains_more(given, grounds_of(start), beside, to_beat(given, start.null).score)
    assert found[0].place.nodes == (7,)


OSCILLATOR = ("GRID,901,,0.6,0.,0.", "SPC1,1,12456,901", "CELAS2,901,3.+3,11,3,901,3", "CONM2,902,901,,0.02")


def test_an_oscillator_as_heavy_as_the_structure_is_looked_for_in_all_directions(tmp_path: Path) -> None:
    """One that the structure could have is looked for in its own alone."""
    start = small_study.updated(tmp_path, small_study.Truth((7.3e10, 6.8e10), OSCILLATOR))
    given, grounds = given_of(start), grounds_of(start)
    alone = to_beat(given, start.null).score
    (found,) = [r for r in laws_at(10, start, given) if r.candidate.name == "tuned_absorber"]
    (along,) = [p for p in grounds if p.nodes == (10,) and p.direction == "X"]
    joint, values = found.candidate.joint, found.candidate.values
    assert joint is not None
    turned = {}
    for times in (1.0, 1.0e3):
        heavy = {name: times * value for name, value in values.items()}
        law = replace(found.candidate, joint=replace(joint, place=along), values=heavy, x=np.log(list(heavy.values())))
        there = [replace(found, candidate=law, located=replace(found.located, place=along))]
        turned[times] = {one.place.direction for one in where_it_explains_more(given, grounds, there, alone)}
    assert turned == {1.0: set(), 1.0e3: {"Z"}}


def test_a_mass_of_much_of_the_structure_costs_what_no_smaller_one_does(tmp_path: Path) -> None:
    model, _ = small_study.cantilever(tmp_path)
    (along,) = [p for p in find_places(model) if p.kind == "ground" and p.nodes == (10,) and p.direction == "Z"]
    total = model.fe.total_mass()
    oscillator, spring = physics("tuned_absorber"), physics("support_stiffness")
    light, heavy = ({"m": share * total, "k": 1.0e9, "c": 1.0e9} for share in (0.1, 0.1 * np.e))
    assert oversized(model, along, oscillator, light) == 0.0
    assert oversized(model, along, oscillator, heavy) == pytest.approx(1.0)
    assert oversized(model, along, spring, {"k": 1.0e9}) == 0.0
    assert oversized(model, replace(along, direction="RY"), oscillator, heavy) == 0.0


def test_the_nearest_joints_come_first(tmp_path: Path) -> None:
    start = updated(tmp_path, "CELAS2,900,3.+4,7,3")
    places = [p for p in grounds_of(start) if p.direction == "Z"]
    turns = [p.nodes[0] for p in in_turn(start.reduced.model, places[0], places) if not p.unlikely]
    xyz = start.reduced.model.xyz
    away = [float(np.linalg.norm(xyz[n - 1] - xyz[places[0].nodes[0] - 1])) for n in turns]
    assert away == sorted(away)


def test_laws_are_tried_where_the_best_one_explains_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before places of further kinds, after these and after those in other directions; members at the best places come
    last, and where the best law bends the model."""
    asked: list[list[str]] = []
    steps = iter([["more"], [], ["other"], ["own"]])
    prior = 0.0

    def naming(given: Any, found: list[Any], *rest: Any, **more: Any) -> tuple[list[Any], float]:
        asked.append([one.place for one in found])
        return [SimpleNamespace(score=float(-len(asked)), candidate=SimpleNamespace(chosen=2.0, prior=prior))], 0.0

    monkeypatch.setattr(diagnosis, "name_physics", naming)
    monkeypatch.setattr(diagnosis, "unclear", lambda *given: True)
    monkeypatch.setattr(diagnosis, "with_look_alikes", lambda problem, reduced, found, *rest: list(found))
    monkeypatch.setattr(diagnosis, "_untried", lambda located, tried: [SimpleNamespace(place="kind")])
    monkeypatch.setattr(diagnosis, "in_other_directions", lambda *given: [SimpleNamespace(place="direction")])
    monkeypatch.setattr(
        diagnosis, "where_it_explains_more", lambda *given: [SimpleNamespace(place=p) for p in next(steps, [])]
    )
    monkeypatch.setattr(diagnosis, "members_there", lambda *given: [SimpleNamespace(place="member")])
    monkeypatch.setattr(diagnosis, "_lost_on_the_way", lambda *given: False)
    monkeypatch.setattr(diagnosis, "replace", lambda one, **changes: one)
    start = SimpleNamespace(problem=None, reduced=None, null=None)
    tell = SimpleNamespace(advance=None, start=lambda *given: None)
    task: Any = SimpleNamespace(start=start, settings=Settings(), given=None, located=[], places=[], tell=tell,
                                so_far=SimpleNamespace(ranked=[]))  # fmt: skip
    alone: Any = SimpleNamespace(score=100.0, candidate=SimpleNamespace(chosen=100.0))
    diagnosis._named(task, [SimpleNamespace(place="first")], alone)  # type: ignore[list-item]
    assert asked == [["first"], ["more"], ["kind"], ["direction"], ["other"], ["member"]]
    # where enough is explained, it is asked all the same
    asked.clear()
    monkeypatch.setattr(diagnosis, "unclear", lambda *given: False)
    diagnosis._named(task, [SimpleNamespace(place="first")], alone)  # type: ignore[list-item]
    assert asked == [["first"], ["own"]]
    asked.clear()
    prior = 1000.0
    diagnosis._named(task, [SimpleNamespace(place="first")], alone)  # type: ignore[list-item]
    assert asked == [["first"], ["member"]]
