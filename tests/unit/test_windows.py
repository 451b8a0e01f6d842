"""In which window laws are compared whose motion cannot be followed over whole records."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose import name
from femend.diagnose.settings import Settings


@dataclass(frozen=True)
class Law:
    """A stop whose motion was followed in a window of `sigma`, with what it leaves there and of whole records."""

    chosen: float
    sigma: float = 6.8
    whole: float = 25.0


@dataclass(frozen=True)
class Judge:
    """Judges in a window; a refined law leaves less there, and whole records as they were."""

    sigma: float

    def ranked(self, tried: Any) -> Any:
        left = tried.candidate.chosen if self.sigma > 0 else tried.candidate.whole
        return SimpleNamespace(candidate=tried.candidate, located=tried.found, recovered=None, score=left)

    def refined(self, ranked: list[Any]) -> list[Any]:
        better = [replace(r.candidate, chosen=0.4 * r.candidate.chosen) for r in ranked]
        return [SimpleNamespace(**{**vars(r), "candidate": c}) for r, c in zip(ranked, better, strict=True)]

    def in_order(self, ranked: list[Any]) -> list[Any]:
        return sorted(ranked, key=lambda r: r.score)


@pytest.mark.parametrize(("before", "sigma", "score"), [(2.0, 6.8, 0.8), (1.0, 6.8, 1.0), (9.0, 0.0, 25.0)])
def test_a_law_may_be_adequate_in_its_window_once_it_is_refined(
    monkeypatch: pytest.MonkeyPatch, before: float, sigma: float, score: float
) -> None:
    at = SimpleNamespace(found=None, recovered=None)

    def widest(split: Any, reduced: Any, tried: Any, settings: Settings, updated: Any) -> Judge:
        return Judge(max((t.candidate.sigma for t in tried if t.candidate.chosen < settings.adequate), default=0.0))

    made = {
        "_linear_at": lambda *a: ([], at),
        "_worth_trying": lambda found: [],
        "_soft_clamps": lambda *a: [],
        "_linear_suffices": lambda *a: False,
        "_likeliest": lambda *a: [at],
        "_nonlinear_laws": lambda *a: [Law(before)],
        "_widest": widest,
    }
    for attribute, value in made.items():
        monkeypatch.setattr(name, attribute, value)
    located = [cast(Any, SimpleNamespace(place=SimpleNamespace(kind="ground")))]
    given = cast(Any, None)
    ranked, window = name.name_physics(given, given, located, [], Settings(), np.zeros(1))
    assert window == sigma
    assert ranked[0].score == pytest.approx(score)
