"""How far the search for places goes on: until a law takes away what it has to."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from femend.diagnose.naming.shares import needed_share, unclear
from femend.diagnose.settings import Settings


@pytest.mark.parametrize(
    ("misfit", "share", "told"),
    [
        (5.0, 0.85, False),
        (5.0, 0.75, True),
        # near the noise many things take part of what is left, so that a name needs more
        (1.6, 0.85, True),
        (1.6, 0.90, False),
    ],
)
def test_further_places_are_tried_until_a_law_takes_what_it_has_to(misfit: float, share: float, told: bool) -> None:
    settings, null = Settings(), 900.0
    alone: Any = SimpleNamespace(score=null, n_values=1000.0, candidate=SimpleNamespace(chosen=misfit))
    # with a free force at the noise its score is nothing
    law: Any = SimpleNamespace(score=null * (1 - share), candidate=SimpleNamespace(chosen=1.1, reference=1.0))
    assert unclear(alone, [law], settings) is told
    assert needed_share(misfit, settings) <= 0.9


def test_what_is_hardly_wrong_needs_no_further_places() -> None:
    alone: Any = SimpleNamespace(score=60.0, n_values=1000.0, candidate=SimpleNamespace(chosen=1.1))
    assert not unclear(alone, [], Settings())
