"""At which places nonlinear laws are tried: the likeliest, and the equally likely as long as nothing is explained."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.naming import name
from femend.diagnose.settings import Settings


def place(kind: str, direction: str, cost: float) -> Any:
    """A place of an opened joint; its free force leaves `cost`."""
    at = SimpleNamespace(kind=kind, direction=direction, scaled=False)
    return SimpleNamespace(found=SimpleNamespace(place=at, cost=cost), recovered=None, joint=None)


# three that come first, and four that are located as well as these but for the last
FIRST = [place("clamp", "RY", 100.0), place("clamp", "RY", 100.5), place("ground", "Z", 101.0)]
REST = [place("ground", "Z", 102.0), place("clamp", "X", 103.0), place("ground", "X", 104.0), place("end", "RY", 160.0)]


def law(at: Any, chosen: float, sigma: float = 0.0) -> Any:
    return SimpleNamespace(found=at.found, candidate=SimpleNamespace(chosen=chosen, sigma=sigma))


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Places are in the order of their cost, and a free force leaves 0.9 of the choosing records."""
    monkeypatch.setattr(name, "order", lambda found: found.cost)
    monkeypatch.setattr(name, "free_reference", lambda split, recovered: 0.9)


def test_further_places_are_those_located_as_well_each_direction_once_before_any_comes_again() -> None:
    tried = [law(at, 5.0 + n) for n, at in enumerate([*FIRST, *REST])]
    first, further = name._likeliest([*REST, *FIRST], tried, Settings())
    assert first == FIRST
    # the ground in Z comes last, since it is among the first; what is located worse does not come
    assert further == [REST[1], REST[2], REST[0]]


def test_a_support_of_many_nodes_which_has_no_nonlinear_law_takes_no_place() -> None:
    supports = [place("support", "Y", 90.0), place("support", "RZ", 91.0)]
    opened = [*supports, *FIRST]
    first, further = name._likeliest(opened, [law(at, 5.0) for at in opened], Settings())
    assert [*first, *further] == FIRST


def test_where_no_nonlinear_law_is_asked_for_no_place_comes() -> None:
    settings = Settings(nonlinear_places=0)
    assert name._likeliest([*FIRST, *REST], [law(at, 5.0) for at in [*FIRST, *REST]], settings) == ([], [])


@pytest.mark.parametrize(
    ("chosen", "sigma", "calls"), [(3.9, 0.0, 6), (1.3, 0.0, 3), (1.3, 6.8, 6), (np.inf, 0.0, 6), (1.6, 0.0, 6)]
)
def test_further_places_are_tried_until_a_law_explains_whole_records(
    monkeypatch: pytest.MonkeyPatch, chosen: float, sigma: float, calls: int
) -> None:
    opened = iter([*FIRST, *REST])
    tried_at: list[Any] = []

    def nonlinear_at(split: Any, at: Any, pace: Any) -> list[Any]:
        tried_at.append(at)
        return [law(at, chosen, sigma)]

    made: dict[str, Any] = {
        "linear_at": lambda *a: ([], next(opened)),
        "masses_from_afar": lambda *a: [],
        "each_once": lambda located: [(found, False, False) for found in located],
        "on_springs": lambda *a: [],
        "judge_in": lambda *a: SimpleNamespace(at_once=lambda new: []),
        "inside": lambda *a: [],
        "_linear_suffices": lambda *a: False,
        "_at_all_levels": lambda tried, *a: tried,
        "beaten": lambda *a: False,
        "nonlinear_at": nonlinear_at,
        "widest": lambda *a: SimpleNamespace(
            sigma=1.0, ranked=lambda t: SimpleNamespace(score=np.inf), refined=lambda ranked: ranked
        ),
        "followed_on": lambda given, ranked, sigma: (ranked, sigma),
    }
    for attribute, value in made.items():
        monkeypatch.setattr(name, attribute, value)
    given = cast(Any, SimpleNamespace(split=None, settings=Settings()))
    name.name_physics(given, [at.found for at in [*FIRST, *REST]])
    assert len(tried_at) == calls
