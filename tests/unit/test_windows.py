"""In which window laws are compared whose motion cannot be followed over whole records."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.fitting import nonlinear
from femend.diagnose.fitting.candidates import Start
from femend.diagnose.fitting.nonlinear import fit_nonlinear, refit_nonlinear
from femend.diagnose.fitting.runs import wider_windows
from femend.diagnose.locating.joint import Joint, open_joint
from femend.diagnose.locating.recovered import Recovered, recover
from femend.diagnose.naming import name, window
from femend.diagnose.naming.advice import only_beginning
from femend.diagnose.naming.judge import Given, Tried
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel
from femend.model import find_places
from femend.physics import physics

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


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
    """A stop that explains what it has not seen in windows down to sigma = `told`, and what it is fitted to down to
    `kept`."""

    told: float
    kept: float = 0.0
    sigma: float = 6.8
    nonlinear: bool = True
    reference: float = 1.0

    @property
    def chosen(self) -> float:
        return 1.2 if self.sigma >= self.told else 30.0

    @property
    def fitted(self) -> float:
        return 1.1 if self.sigma >= self.kept else 9.0


@pytest.mark.parametrize(
    ("told", "kept", "reached"),
    [(0.0, 0.0, 0.0), (0.5, 0.0, 0.8), (2.0, 0.0, 2.4), (5.0, 0.0, 6.8), (0.5, 2.0, 2.4)],
)
def test_a_law_is_followed_as_far_as_it_explains(
    monkeypatch: pytest.MonkeyPatch, told: float, kept: float, reached: float
) -> None:
    def judged(*args: Any) -> Any:
        def ranked(tried: Any, afresh: bool = False) -> Any:
            # not judged afresh, a law has the misfit of the window before
            seen = tried.candidate if afresh else SimpleNamespace(**{**vars(tried.candidate), "chosen": 1.0})
            return SimpleNamespace(candidate=seen, located=None, recovered=None)

        return SimpleNamespace(ranked=ranked)

    made = {
        "wider_windows": lambda problem, sigma: [w for w in (24.0, 8.0, 2.4, 0.8, 0.0) if w < sigma],
        "refit_nonlinear": lambda problem, candidate: candidate,
        "judge_in": judged,
        "compared_in": lambda given, ranked, sigma: ranked,
    }
    for attribute, value in made.items():
        monkeypatch.setattr(window, attribute, value)
    given = cast(Any, SimpleNamespace(split=SimpleNamespace(fitting=None), settings=Settings()))
    first = cast(Any, SimpleNamespace(candidate=Stop(told, kept), located=None, recovered=None))
    ranked, sigma = window.followed_on(given, [first], 6.8)
    assert sigma == reached
    assert ranked[0].candidate.sigma == reached


@pytest.mark.parametrize(("before", "sigma", "score"), [(2.0, 6.8, 0.8), (1.0, 6.8, 1.0), (9.0, 0.0, 25.0)])
def test_a_law_may_be_adequate_in_its_window_once_it_is_refined(
    monkeypatch: pytest.MonkeyPatch, before: float, sigma: float, score: float
) -> None:
    at = SimpleNamespace(found=None, recovered=None)

    def widest(given: Any, tried: Any) -> Judge:
        adequate = (t.candidate.sigma for t in tried if t.candidate.chosen < given.settings.adequate)
        return Judge(max(adequate, default=0.0))

    def tried(ranked: Any) -> Any:
        return SimpleNamespace(candidate=ranked.candidate, found=None)

    made = {
        "linear_at": lambda *a: ([], at),
        "masses_from_afar": lambda *a: [],
        "each_once": lambda located: [(found, False, False) for found in located],
        "on_springs": lambda *a: [],
        "_linear_suffices": lambda *a: False,
        "_at_all_levels": lambda tried, *a: tried,
        "beaten": lambda *a: False,
        "_likeliest": lambda *a: ([at], []),
        "nonlinear_at": lambda *a: [Tried(cast(Any, Law(before)), cast(Any, None), None)],
        "widest": widest,
        "compared_in": lambda given, ranked, sigma: [Judge(sigma).ranked(tried(r)) for r in ranked],
        "followed_on": lambda given, ranked, sigma: (ranked, sigma),
        # what is noted place by place, for a run that may be interrupted
        "judge_in": lambda *a: SimpleNamespace(at_once=lambda new: []),
    }
    for attribute, value in made.items():
        monkeypatch.setattr(name, attribute, value)
    located = [cast(Any, SimpleNamespace(place=SimpleNamespace(kind="ground", scaled=False)))]
    given = cast(Any, SimpleNamespace(split=None, settings=Settings()))
    ranked, reached = name.name_physics(given, located)
    assert reached == sigma
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
        # a stop is compared in the window that it was followed to, between those that laws go through
        (Left(2.4, (25.0, 0.7), (0.9, 0.8)), SPRING, 14.7, 2.4),
        # one that does as well as a free force where that explains all is
        (Left(6.8, (25.0, 0.7), (0.9, 0.8)), Left(0.0, (1.2, 200.0), (1.1, 12.0), nonlinear=False), 14.7, 0.0),
        # what explains a beginning by bending the rest of the model is none
        (Left(6.8, (25.0, 0.7), (0.9, 0.8), prior=300.0), SPRING, 14.7, 0.0),
        # and so is a beginning that the updated model explains by itself
        (Left(6.8, (25.0, 0.7), (0.9, 0.8)), SPRING, 1.3, 0.0),
        # or explains as well as the laws do that do nothing there yet: a stop that is reached later
        (Left(6.8, (75.0, 0.8), (1.9, 1.3)), Left(0.0, (97.0, 0.8), (1.9, 1.3), nonlinear=False), 1.85, 0.0),
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

    monkeypatch.setattr(window, "judge_in", lambda given, sigma: Reads(given.split, given.settings, 1.0, sigma))
    monkeypatch.setattr(window, "windows", lambda problem: [6.8, 0.0])
    split = cast(Any, SimpleNamespace(choosing=SimpleNamespace(fit=fit), fitting=None))
    tried = [SimpleNamespace(candidate=left) for left in (spring, stop)]
    reduced = cast(Any, SimpleNamespace(r=3))
    assert window.widest(Given(split, reduced, [], np.zeros(1), Settings()), cast(Any, tried)).sigma == sigma


def test_windows_widen_a_little_at_a_time() -> None:
    problem = cast(Any, SimpleNamespace(scale=lambda: 2.0))
    sigma = wider_windows(problem, 20.0)
    assert sigma[-1] == 0.0
    ratios = np.array(sigma[:-1]) / np.array([20.0, *sigma[:-2]])
    np.testing.assert_allclose(ratios, 0.7)
    assert 0.1 * 2.0 <= sigma[-2] < 0.2 * 2.0
    assert wider_windows(problem, 0.15) == [0.0]


def opened_at(folder: Path, truth: small_study.Truth, node: int) -> tuple[UpdatedModel, Joint, Recovered]:
    """The updated study of a `truth`, with its `node` opened to ground in Z, and the force read off there."""
    start = small_study.updated(folder, truth)
    places = find_places(start.reduced.model)
    place = next(p for p in places if p.kind == "ground" and p.nodes == (node,) and p.direction == "Z")
    joint = open_joint(place, start.reduced, start.problem.band[1], start.g_rows)
    recovered = recover(start.problem, joint, start.null.p)
    assert recovered is not None
    return start, joint, recovered


def test_a_softening_law_that_is_read_too_strong_begins_weaker(tmp_path: Path) -> None:
    truth = small_study.Truth(laws=[(13, "cubic_stiffness", {"k3": -1.5e6})])
    start, joint, recovered = opened_at(tmp_path, truth, 13)
    # with ten times the force the beam would run away from its clamp
    strong = Start(physics("cubic_stiffness"), {"k3": -1.5e7}, -100.0, 0.0, 0.5)
    found = fit_nonlinear(start.problem, start.problem, joint, recovered, [("cubic_stiffness", strong)])
    candidate = refit_nonlinear(start.problem, min(found, key=lambda c: c.sigma))
    assert candidate.values["k3"] == pytest.approx(-1.5e6, rel=0.05)
    assert candidate.sigma == 0.0


def test_a_stop_that_is_lost_in_the_first_window_is_begun_in_shorter_ones(tmp_path: Path) -> None:
    truth = small_study.Truth(laws=[(10, "clearance", {"k": 1e5, "gap": 1e-4, "sides": 2.0})])
    start, joint, recovered = opened_at(tmp_path, truth, 10)
    # as stops are read off lines in a band: too wide and too soft, with a spring beside them
    wide = Start(physics("clearance"), {"k": 6e4, "gap": 2.5e-4, "sides": 2.0}, 4e4, 0.0, 0.3)
    (found,) = fit_nonlinear(start.problem, start.problem, joint, recovered, [("clearance", wide)])
    assert found.values["k"] == pytest.approx(1e5, rel=0.05)
    assert found.values["gap"] == pytest.approx(1e-4, rel=0.05)


def test_a_law_whose_motion_jumps_is_followed_in_small_steps(tmp_path: Path) -> None:
    truth = small_study.Truth(laws=[(10, "cubic_stiffness", {"k3": 1e9})])
    start, joint, recovered = opened_at(tmp_path, truth, 10)
    strong = Start(physics("cubic_stiffness"), {"k3": 1.7e9}, 0.0, 0.0, 0.3)
    (found,) = fit_nonlinear(start.problem, start.problem, joint, recovered, [("cubic_stiffness", strong)])
    assert found.sigma == 0.0
    assert found.fitted < 1.0
    assert found.values["k3"] == pytest.approx(1e9, rel=0.02)


def test_a_law_that_explains_less_in_a_wider_window_is_kept_in_both(monkeypatch: pytest.MonkeyPatch) -> None:
    left = {10.0: 0.9, 3.0: 1.1, 1.0: 3.0, 0.0: 20.0}

    def run(sigma: float) -> Any:
        loop = SimpleNamespace(sigma=sigma, size=lambda: 1)
        reached = SimpleNamespace(cost=left[sigma], e=np.array([left[sigma] ** 0.5]))
        start = cast(Any, SimpleNamespace(left=np.nan))
        return nonlinear.Run("cubic_stiffness", start, cast(Any, SimpleNamespace(loop=loop)), reached)

    def candidate(loop: Any, *given: Any) -> Any:
        return SimpleNamespace(sigma=loop.sigma, fitted=left[loop.sigma])

    def widened(before: Any, sigma: float) -> Any:
        return run(sigma) if left[sigma] <= nonlinear.LOST * max(before.misfit, 1.0) else None

    made = {
        "windows": lambda problem: [10.0, 3.0, 1.0, 0.0],
        "_begun": lambda *a: run(10.0),
        "_best_of_each": lambda runs: runs,
        "_with_model_free": lambda runs, recovered: runs,
        "from_shorter": lambda runs, recovered: runs,
        "_widened": widened,
        "candidate_of": candidate,
        "judge_nonlinear": lambda choosing, candidate: candidate,
    }
    for attribute, value in made.items():
        monkeypatch.setattr(nonlinear, attribute, value)
    given, recovered = cast(Any, None), cast(Any, SimpleNamespace(fit=SimpleNamespace(score=2.0)))
    kept = fit_nonlinear(given, given, given, recovered, [("cubic_stiffness", given)])
    assert sorted(c.sigma for c in kept) == [1.0, 3.0]


def test_a_law_of_the_beginning_alone_says_so() -> None:
    assert only_beginning(0.0) == ""
    assert "the first 0.44 s" in only_beginning(6.8)
    # of records that end before the window has closed no more than half
    assert "the first 3 s" in only_beginning(0.3, shortest=6.0)
    assert "impacts" in only_beginning(6.8)
    assert "as well part from each other" in only_beginning(6.8, parts=True)
    assert "impacts" not in only_beginning(6.8, parts=True)
    # with linear laws motion does not part from its path
    assert "impacts" not in only_beginning(6.8, nonlinear=False)
    assert "beside the law is missing" in only_beginning(6.8, nonlinear=False)


@pytest.mark.parametrize("gets_on", [True, False])
def test_laws_go_on_in_their_first_window_with_the_model_free(gets_on: bool) -> None:
    freed: list[bool] = []
    further = SimpleNamespace(cost=0.4, z=np.ones(1), e=np.array([0.6])) if gets_on else None

    def on(loop: Any, everything: bool) -> Any:
        freed.append(everything)
        return SimpleNamespace(loop=loop, run=lambda z, steps: further)

    descent = cast(Any, SimpleNamespace(loop=SimpleNamespace(size=lambda: 1), on=on))
    held = cast(Any, SimpleNamespace(cost=0.9, z=np.zeros(1), e=np.array([1.0])))
    begun = nonlinear.Run("clearance", cast(Any, None), descent, held, ((10.0, 0.9),))

    def after(left: float) -> nonlinear.Run:
        (run,) = nonlinear._with_model_free([begun], cast(Any, SimpleNamespace(fit=SimpleNamespace(score=left))))
        return run

    assert after(0.9) is begun  # a free force leaves no less
    assert freed == []
    went_on = after(0.5)
    assert freed == [True]
    assert went_on.reached.cost == (0.4 if gets_on else 0.9)
    assert went_on.path == ((10.0, 0.9),)  # others begin there with the law alone, too
