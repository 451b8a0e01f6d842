"""The places that a finding says are possible too."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from femend.model.places import Topology
from femend.study import findings


def place(kind: str, nodes: tuple[int, ...], direction: str) -> Any:
    to = str(nodes[1]) if kind == "pair" else "ground"
    return SimpleNamespace(
        kind=kind, nodes=nodes, direction=direction, to=to, unlikely=False, bed=(), elements=(), bed_nodes=()
    )


def possible(monkeypatch: pytest.MonkeyPatch, found: Any, alike: list[Any]) -> list[list[int]]:
    monkeypatch.setattr(findings, "topology", lambda model: Topology())
    monkeypatch.setattr(findings, "_next_sensor", lambda *_: None)
    diagnosis = SimpleNamespace(
        reduced=SimpleNamespace(model=None), located=[], further=None, ranked=[], settings=SimpleNamespace(margin=10.0)
    )
    located = SimpleNamespace(place=found, alike=tuple(alike), cost=0.0)
    return cast(list[list[int]], findings._location(cast(Any, diagnosis), cast(Any, located))["also_possible"])


def test_a_law_between_two_nodes_along_an_axis_may_act_on_one_of_them_from_the_ground(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alike = [place("ground", (12,), "X"), place("pair", (7, 12), "X"), place("ground", (12,), "Y")]
    assert possible(monkeypatch, place("pair", (6, 12), "X"), alike) == [[12], [7, 12]]


def test_another_direction_of_its_own_node_is_no_other_place(monkeypatch: pytest.MonkeyPatch) -> None:
    assert possible(monkeypatch, place("ground", (12,), "X"), [place("ground", (12,), "Y")]) == []
    assert possible(monkeypatch, place("pair", (6, 12), "X"), [place("ground", (12,), "Y")]) == []
