"""The places that a finding says are possible too."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.model.places.places import Topology
from femend.study.result import findings


def place(kind: str, nodes: tuple[int, ...], direction: str, slope: tuple[float, float, float] = (0, 0, 0)) -> Any:
    """A place with one force, along `slope` where it has no axis."""
    to = str(nodes[1]) if kind == "pair" else "ground"
    along = np.array(slope if not direction else [axis == direction for axis in "XYZ"], dtype=float)
    rows = np.concatenate([6 * node + np.arange(3) for node in nodes])
    values = along if len(nodes) == 1 else np.concatenate([-along, along])
    return SimpleNamespace(
        kind=kind, nodes=nodes, direction=direction, to=to, unlikely=False, bed=(), elements=(), bed_nodes=(),
        n_w=1, g_rows=(rows,), g_values=(values,),
    )  # fmt: skip


def possible(
    monkeypatch: pytest.MonkeyPatch, found: Any, alike: list[Any], as_near: tuple[Any, ...] = ()
) -> list[list[int]]:
    monkeypatch.setattr(findings, "topology", lambda model: Topology())
    monkeypatch.setattr(findings, "_next_sensor", lambda *_: None)
    diagnosis = SimpleNamespace(
        reduced=SimpleNamespace(model=None),
        located=[SimpleNamespace(place=p, cost=5.0) for p in as_near],
        further=None,
        ranked=[],
        settings=SimpleNamespace(margin=10.0),
    )
    located = SimpleNamespace(place=found, alike=tuple(alike), cost=0.0)
    others, _ = findings._not_told_apart(cast(Any, diagnosis), cast(Any, located))
    return others[: findings.ALSO]


def test_a_law_between_two_nodes_along_an_axis_may_act_on_one_of_them_from_the_ground(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alike = [place("ground", (12,), "X"), place("pair", (7, 12), "X"), place("ground", (12,), "Y")]
    assert possible(monkeypatch, place("pair", (6, 12), "X"), alike) == [[12], [7, 12]]


def test_a_brace_may_act_on_one_of_its_nodes_from_the_ground_where_that_has_a_part_along_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A brace has no direction by name, so that the support at its own node, where the stop was, was never told."""
    alike = [place("ground", (5,), "X"), place("ground", (10,), "Y"), place("ground", (10,), "X")]
    brace = place("pair", (1, 10), "", slope=(0.6, 0.0, 0.8))
    assert possible(monkeypatch, brace, alike) == [[5], [10]]
    # at right angles to it nothing of the force is left
    upright = place("pair", (1, 10), "", slope=(0.0, 0.0, 1.0))
    assert possible(monkeypatch, upright, alike) == [[5]]


def test_another_direction_of_its_own_node_is_no_other_place(monkeypatch: pytest.MonkeyPatch) -> None:
    assert possible(monkeypatch, place("ground", (12,), "X"), [place("ground", (12,), "Y")]) == []
    assert possible(monkeypatch, place("pair", (6, 12), "X"), [place("ground", (12,), "Y")]) == []


def test_a_place_that_fits_as_well_by_more_free_forces_is_no_other_place(monkeypatch: pytest.MonkeyPatch) -> None:
    feet = place("bushes", (101, 103, 107, 109), "Z")
    feet.n_w = 4
    shaft = place("ground", (12,), "Z")
    assert possible(monkeypatch, shaft, [], (feet, place("ground", (11,), "Z"))) == [[11]]
