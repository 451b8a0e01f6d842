"""In which window laws are compared whose motion cannot be followed over whole records."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose import name
from femend.diagnose.advice import only_beginning
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


@dataclass(frozen=True)
class Stop:
    """A stop that explains what it has not seen in windows down to sigma = `told`."""

    told: float
    sigma: float = 6.8
    nonlinear: bool = True
    reference: float = 1.0

    @property
    def chosen(self) -> float:
        return 1.2 if self.sigma >= self.told else 30.0


@pytest.mark.parametrize(("told", "reached"), [(0.0, 0.0), (0.5, 0.8), (2.0, 2.4), (5.0, 6.8)])
def test_a_law_is_followed_as_far_as_it_explains(monkeypatch: pytest.MonkeyPatch, told: float, reached: float) -> None:
    def judged(*args: Any) -> Any:
        return SimpleNamespace(ranked=lambda t: SimpleNamespace(candidate=t.candidate, located=None, recovered=None))

    made = {
        "windows": lambda problem: [24.0, 8.0, 2.4, 0.8, 0.0],
        "refit_nonlinear": lambda problem, candidate: candidate,
        "effective_values": lambda *a: 100.0,
        "_Judge": judged,
        "compared_in": lambda s, r, ranked, sigma, settings: ranked,
    }
    for attribute, value in made.items():
        monkeypatch.setattr(name, attribute, value)
    given = cast(Any, SimpleNamespace(fitting=None, choosing=None))
    first = cast(Any, SimpleNamespace(candidate=Stop(told), located=None, recovered=None))
    ranked, sigma = name._followed_on(given, cast(Any, None), [first], 6.8, Settings())
    assert sigma == reached
    assert ranked[0].candidate.sigma == reached


@pytest.mark.parametrize(("before", "sigma", "score"), [(2.0, 6.8, 0.8), (1.0, 6.8, 1.0), (9.0, 0.0, 25.0)])
def test_a_law_may_be_adequate_in_its_window_once_it_is_refined(
    monkeypatch: pytest.MonkeyPatch, before: float, sigma: float, score: float
) -> None:
    at = SimpleNamespace(found=None, recovered=None)

    def widest(split: Any, reduced: Any, tried: Any, settings: Settings, updated: Any) -> Judge:
        return Judge(max((t.candidate.sigma for t in tried if t.candidate.chosen < settings.adequate), default=0.0))

    def tried(ranked: Any) -> Any:
        return SimpleNamespace(candidate=ranked.candidate, found=None)

    made = {
        "_linear_at": lambda *a: ([], at),
        "_worth_trying": lambda found: [],
        "_soft_clamps": lambda *a: [],
        "_linear_suffices": lambda *a: False,
        "_likeliest": lambda *a: [at],
        "_nonlinear_laws": lambda *a: [Law(before)],
        "_widest": widest,
        "compared_in": lambda s, r, ranked, sigma, settings: [Judge(sigma).ranked(tried(r)) for r in ranked],
        "_followed_on": lambda s, r, ranked, sigma, settings: (ranked, sigma),
        # what is noted place by place, for a run that may be interrupted
        "effective_values": lambda *a: 1.0,
        "_Judge": lambda *a: SimpleNamespace(at_once=lambda new: []),
    }
    for attribute, value in made.items():
        monkeypatch.setattr(name, attribute, value)
    located = [cast(Any, SimpleNamespace(place=SimpleNamespace(kind="ground")))]
    given = cast(Any, SimpleNamespace(choosing=None))
    ranked, window = name.name_physics(given, given, located, [], Settings(), np.zeros(1))
    assert window == sigma
    assert ranked[0].score == pytest.approx(score)


@dataclass(frozen=True)
class Left:
    """What a candidate and a free force at its place leave of unseen whole records, and of their beginning."""

    sigma: float
    whole: tuple[float, float]
    beginning: tuple[float, float]
    prior: float = 5.0
    nonlinear: bool = True


SPRING = Left(0.0, (288.0, 200.0), (14.0, 12.0), nonlinear=False)


@pytest.mark.parametrize(
    ("stop", "spring", "alone", "sigma"),
    [
        # a spring where a free force explains nothing is no reason to compare whole records
        (Left(6.8, (25.0, 0.7), (0.9, 0.8)), SPRING, 14.7, 6.8),
        # nor is that the stop was followed through them
        (Left(0.0, (25.0, 0.7), (0.9, 0.8)), SPRING, 14.7, 6.8),
        # one that does as well as a free force where that explains all is
        (Left(6.8, (25.0, 0.7), (0.9, 0.8)), Left(0.0, (1.2, 200.0), (1.1, 12.0), nonlinear=False), 14.7, 0.0),
        # what explains a beginning by bending the rest of the model is none
        (Left(6.8, (25.0, 0.7), (0.9, 0.8), prior=300.0), SPRING, 14.7, 0.0),
        # and so is a beginning that the updated model explains by itself
        (Left(6.8, (25.0, 0.7), (0.9, 0.8)), SPRING, 1.3, 0.0),
    ],
)
def test_laws_are_compared_in_the_widest_window_that_one_explains(
    monkeypatch: pytest.MonkeyPatch, stop: Left, spring: Left, alone: float, sigma: float
) -> None:
    @dataclass(frozen=True)
    class Reads:
        split: Any
        settings: Settings
        n_values: float
        sigma: float

        def ranked(self, tried: Any) -> Any:
            left: Left = tried.candidate
            chosen, reference = left.beginning if self.sigma > 0 else left.whole
            return SimpleNamespace(candidate=SimpleNamespace(chosen=chosen, reference=reference, prior=left.prior))

    def fit(hypotheses: Any, starts: Any, sigma: float, iterations: int) -> list[Any]:
        return [SimpleNamespace(score=alone)]

    monkeypatch.setattr(name, "_Judge", Reads)
    monkeypatch.setattr(name, "effective_values", lambda *a: 1.0)
    monkeypatch.setattr(name, "windows", lambda problem: [6.8, 0.0])
    split = cast(Any, SimpleNamespace(choosing=SimpleNamespace(fit=fit), fitting=None))
    tried = [SimpleNamespace(candidate=left) for left in (spring, stop)]
    reduced = cast(Any, SimpleNamespace(r=3))
    assert name._widest(split, reduced, cast(Any, tried), Settings(), np.zeros(1)).sigma == sigma


def test_a_law_of_the_beginning_alone_says_so() -> None:
    assert only_beginning(0.0) == ""
    assert "the first 0.44 s" in only_beginning(6.8)
    assert "impacts" in only_beginning(6.8)
    # with linear laws motion does not part from its path
    assert "impacts" not in only_beginning(6.8, nonlinear=False)
    assert "beside the law is missing" in only_beginning(6.8, nonlinear=False)
