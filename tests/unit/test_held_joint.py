"""The linear spring of a joint beside a nonlinear law is told where the law has no parameter for it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from femend.physics import physics
from femend.study.result.held_joint import held_joint

BOUC_WEN = {"k": 3e4, "alpha": 0.0, "n": 1.5, "beta": 1e4, "gamma": 5e3}


@pytest.mark.parametrize(
    ("law", "values", "release", "told"),
    [
        ("cubic_stiffness", {"k3": 2.5e8}, 4, True),
        # alpha tells it
        ("bouc_wen", BOUC_WEN, 4, False),
        # elsewhere the model's own stiffness is there
        ("cubic_stiffness", {"k3": 2.5e8}, None, False),
    ],
)
def test_the_spring_that_holds_a_joint_is_told(
    law: str, values: dict[str, float], release: int | None, told: bool
) -> None:
    place = SimpleNamespace(release=release, direction="RY")
    best = SimpleNamespace(
        physics=physics(law), values=values, k=608.0, nonlinear=True, joint=SimpleNamespace(place=place)
    )
    reduced = SimpleNamespace(model=SimpleNamespace(units="SI"))
    said = held_joint(cast(Any, SimpleNamespace(best=best, reduced=reduced)))
    assert ("linear spring of 608 N*m/rad beside the law" in said) is told


def test_nothing_is_said_where_no_law_was_found() -> None:
    assert held_joint(cast(Any, SimpleNamespace(best=None))) == ""
