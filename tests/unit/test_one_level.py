"""A linear law that explains a level between those it is fitted to, and none of these, is not what is missing."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.deciding.accepted import adequate
from femend.diagnose.naming import name
from femend.diagnose.naming.ranked import at_one_level
from femend.diagnose.settings import Settings


@dataclass(frozen=True)
class Law:
    """A law by what it leaves of the records it is fitted to and of those it has not seen."""

    fitted: float
    chosen: float
    nonlinear: bool = False
    sigma: float = 0.0
    reference: float = 1.0
    n_law: int = 1
    prior: float = 0.0


SPRING, LOOP = Law(7.8, 1.2), Law(1.1, 1.1, nonlinear=True)


def opened(free: float) -> Any:
    """A place at which a free force leaves so much of the records that locate."""
    return SimpleNamespace(recovered=SimpleNamespace(fit=SimpleNamespace(score=free)))


def tried(*laws: Law) -> list[Any]:
    return [SimpleNamespace(candidate=law) for law in laws]


def test_a_law_of_one_level_leaves_far_more_of_the_others_than_a_free_force() -> None:
    told = {free: at_one_level(cast(Any, SPRING), free, Settings()) for free in (0.9, 2.0, 2.5)}
    assert told == {0.9: True, 2.0: True, 2.5: False}
    assert not at_one_level(cast(Any, Law(2.0, 1.2)), 0.9, Settings())
    assert not at_one_level(cast(Any, Law(7.8, 1.2, nonlinear=True)), 0.9, Settings())  # it may be lost on its way


@pytest.mark.parametrize(
    ("other", "left"),
    [
        (LOOP, [LOOP]),
        (Law(1.1, 2.0, nonlinear=True), [SPRING, Law(1.1, 2.0, nonlinear=True)]),  # unseen ones it does not explain
        (Law(1.1, 1.1, nonlinear=True, sigma=2.0), [SPRING, Law(1.1, 1.1, nonlinear=True, sigma=2.0)]),  # a beginning
    ],
)
def test_it_is_left_out_where_a_nonlinear_law_explains_all_levels(other: Law, left: list[Law]) -> None:
    kept = name._at_all_levels(cast(Any, tried(SPRING, other)), [opened(0.95)], Settings())
    assert [t.candidate for t in kept] == left


def test_nonlinear_laws_are_tried_where_the_best_linear_one_is_of_one_level(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(name, "free_reference", lambda split, recovered: 1.15)
    given = cast(Any, SimpleNamespace(split=None, settings=Settings(), n_values=lambda: 300.0))
    suffices = {
        law: name._linear_suffices(given, cast(Any, tried(law)), [opened(0.95)], np.inf)
        for law in (SPRING, Law(1.3, 1.2))
    }
    assert suffices == {SPRING: False, Law(1.3, 1.2): True}


def test_it_is_not_adequate() -> None:
    found = cast(Any, SimpleNamespace(settings=Settings()))
    at = opened(0.95).recovered
    told = [adequate(found, cast(Any, SimpleNamespace(candidate=law, recovered=at))) for law in (SPRING, LOOP)]
    assert told == [False, True]
    # of a mass, which is fitted without a force at its place, nothing is known of that
    assert adequate(found, cast(Any, SimpleNamespace(candidate=SPRING, recovered=None)))
