"""Places at which laws are tried: each once, with the look-alikes at which they are tried too."""

from __future__ import annotations

from typing import Any

import numpy as np

from femend.diagnose.locating.locate import Located
from femend.diagnose.naming.laws_at import each_once
from femend.model import Place


def at(kind: str, *nodes: int) -> Place:
    return Place(kind, nodes, "Y", "", (np.zeros(1, dtype=np.int64),), (np.ones(1),))


def ground(node: int) -> Place:
    return at("ground", node)


def located(place: Place, *alike: Place) -> Located:
    fit: Any = None
    return Located(place, fit, 0.0, alike)


def tried(*found: Located) -> list[tuple[Place, bool, bool]]:
    return [(one.place, is_kin, masses) for one, is_kin, masses in each_once(found)]


def test_a_place_is_tried_with_its_look_alikes_to_the_ground() -> None:
    one, two = ground(1), ground(2)
    assert tried(located(one, two)) == [(one, False, False), (two, True, False)]


def test_a_look_alike_of_two_places_is_tried_once() -> None:
    one, two, three = ground(1), ground(2), ground(3)
    assert tried(located(one, three), located(two, three)) == [
        (one, False, False),
        (three, True, False),
        (two, False, False),
    ]


def test_a_look_alike_that_is_a_place_of_its_own_is_tried_as_that() -> None:
    one, two = ground(1), ground(2)
    assert tried(located(one, two), located(two, one)) == [(one, False, False), (two, False, False)]


def test_the_ground_beside_a_brace_carries_masses_and_later_all_laws() -> None:
    brace, one, two = at("pair", 4, 5), ground(1), ground(2)
    assert tried(located(brace, two), located(one, two)) == [
        (brace, False, False),
        (two, True, True),
        (one, False, False),
        (two, True, False),
    ]
    # the other way round what masses do is known already
    assert tried(located(one, two), located(brace, two)) == [
        (one, False, False),
        (two, True, False),
        (brace, False, False),
    ]
