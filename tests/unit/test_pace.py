"""Laws that are given up in time: far behind one that explains whole records, or not falling any more."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.fitting import nonlinear
from femend.diagnose.fitting.nonlinear import fit_nonlinear
from femend.diagnose.fitting.pace import Pace
from femend.diagnose.naming import judge
from femend.diagnose.naming.judge import Judge
from femend.diagnose.settings import Settings


def test_laws_far_behind_one_that_explained_whole_records_elsewhere_are_given_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    followed: list[tuple[str, float]] = []

    def run(name: str, cost: float, path: Any = ()) -> Any:
        loop = SimpleNamespace(sigma=path[-1][0] if path else 10.0, size=lambda: 100)
        reached = SimpleNamespace(cost=cost, e=np.array([cost**0.5]))
        start = SimpleNamespace(left=np.nan)
        return nonlinear.Run(name, cast(Any, start), cast(Any, SimpleNamespace(loop=loop)), reached, path)

    def widened(before: Any, sigma: float) -> Any:
        followed.append((before.name, sigma))
        cost = {"right": 100.0, "near": 350.0, "far": 450.0, "hopeless": 100.0}[before.name]
        return run(before.name, cost, (*before.path, (sigma, cost)))

    def begun(problem: Any, joint: Any, recovered: Any, name: str, start: Any, sigma: float, pace: Pace) -> Any:
        cost = 17000.0 if name == "hopeless" else 1000.0
        return run(name, cost, ((sigma, cost),))

    def fitted(*names: str) -> list[str]:
        followed.clear()
        made = {
            "windows": lambda problem: [10.0, 3.0, 0.0],
            "_begun": begun,
            "_best_of_each": lambda runs: runs,
            "_with_model_free": lambda runs, recovered: runs,
            "from_shorter": lambda runs, recovered: runs,
            "_widened": widened,
            "candidate_of": lambda loop, start, name, reached, covariance: SimpleNamespace(
                name=name, sigma=loop.sigma, fitted=reached.cost
            ),
            "judge_nonlinear": lambda choosing, candidate: candidate,
        }
        for attribute, value in made.items():
            monkeypatch.setattr(nonlinear, attribute, value)
        given, recovered = cast(Any, None), cast(Any, SimpleNamespace(fit=SimpleNamespace(score=9.0)))
        return [c.name for c in fit_nonlinear(given, given, given, recovered, [(n, given) for n in names], pace)]

    pace = Pace()
    # before a law explains whole records nothing is given up for it
    assert fitted("far") == ["far"]
    assert fitted("hopeless") == ["hopeless"]
    pace = Pace()
    assert fitted("right") == ["right"]
    assert fitted("hopeless") == []
    assert fitted("near", "far") == ["near"]
    assert followed == [("near", 3.0), ("far", 3.0), ("near", 0.0)]


@pytest.mark.parametrize(("cost", "steps"), [(1500.0, [2, 4]), (17000.0, [2]), (17000.0, [6])])
def test_starts_outdone_by_a_law_elsewhere_are_given_up_soon(
    monkeypatch: pytest.MonkeyPatch, cost: float, steps: list[int]
) -> None:
    """Those that are not, and all before a law explains whole records, go on."""
    taken: list[int] = []

    def run(z: Any, iterations: int) -> Any:
        taken.append(iterations)
        return SimpleNamespace(z=z, cost=cost)

    pace = Pace()
    pace.keep([(10.0, 1000.0)] if 2 in steps else [])
    monkeypatch.setattr(nonlinear, "loop_of", lambda *a: (nonlinear.Pace(), np.zeros(1)))
    monkeypatch.setattr(nonlinear.Descent, "around", lambda *a: SimpleNamespace(run=run))
    monkeypatch.setattr(nonlinear, "replace", lambda loop, **changes: loop)
    recovered = cast(Any, SimpleNamespace(fit=SimpleNamespace(p=np.zeros(2))))
    given = cast(Any, None)
    begun = nonlinear._begun(given, given, recovered, "clearance", given, 10.0, pace)
    assert taken == steps
    assert (begun is None) == (steps == [2])


@pytest.mark.parametrize(("fell", "share", "runs"), [(0.0, 0.5, 0), (0.01, 0.9, 1), (0.01, 0.5, 6)])
def test_a_law_far_from_the_noise_is_followed_as_long_as_it_falls(fell: float, share: float, runs: int) -> None:
    made: list[float] = []

    def again(cost: Any, steps: int) -> Any:
        made.append(cost)
        return SimpleNamespace(z=share * cost, e=np.array([100.0]), cost=share * cost, fell=fell)

    descent = SimpleNamespace(loop=SimpleNamespace(size=lambda: 1), run=again)
    start = SimpleNamespace(z=1e4, e=np.array([100.0]), cost=1e4, fell=fell)
    nonlinear._on_its_way(nonlinear.Run("cubic_stiffness", cast(Any, None), cast(Any, descent), cast(Any, start)))
    assert len(made) == runs


@pytest.mark.parametrize(
    ("first", "chosen", "free", "fitted_again"),
    [
        (1.0, 3.9, -100.0, True),
        (1.0, 4.1, -100.0, False),  # far behind a law that explains the records
        (2.0, 9.0, -100.0, True),  # which this one does not
        (1.0, 3.9, 141.0, False),  # a free force there has more than a law elsewhere
    ],
)
def test_only_laws_that_can_still_win_are_fitted_once_more(
    monkeypatch: pytest.MonkeyPatch, first: float, chosen: float, free: float, fitted_again: bool
) -> None:
    again: list[Any] = []

    def law(name: str, chosen: float) -> Any:
        candidate = SimpleNamespace(name=name, chosen=chosen, sigma=0.0, nonlinear=True, reference=1.0)
        return SimpleNamespace(candidate=candidate, score=100.0, recovered=name)

    def refit(problem: Any, candidate: Any) -> Any:
        again.append(candidate.name)
        return candidate

    made = {
        "refit_nonlinear": refit,
        "as_recorded": lambda problem, candidate, gain, enough: candidate,
        "on_other_sides": lambda problem, candidate, recovered, enough: candidate,
        "replace": lambda candidate, **changes: candidate,
        "free_score": lambda split, recovered, reference, n: free,
        "simple_first": lambda ranked, settings: ranked,
    }
    for attribute, value in made.items():
        monkeypatch.setattr(judge, attribute, value)
    monkeypatch.setattr(Judge, "judged", lambda self, candidate, tried: tried)
    split = SimpleNamespace(fitting=SimpleNamespace(recorder=SimpleNamespace(filters=True)))
    laws = [law("bouc_wen", first), law("coulomb_friction", chosen)]
    found = Judge(cast(Any, split), Settings(), 1000.0, 0.0).refined(laws)
    assert again == ["bouc_wen", *(["coulomb_friction"] if fitted_again else [])]
    assert len(found) == 2


@pytest.mark.parametrize(
    ("chosen", "prior", "free", "beaten"),
    [
        (1.0, 5.0, 900.0, True),
        (1.0, 5.0, 130.0, False),  # not clearly
        (1.6, 5.0, 900.0, False),  # something else may act there beside a law that does not explain
        (1.0, 41.0, 900.0, False),  # or that bends the model
    ],
)
def test_a_place_is_beaten_where_a_law_elsewhere_has_a_score_that_none_can_have_there(
    monkeypatch: pytest.MonkeyPatch, chosen: float, prior: float, free: float, beaten: bool
) -> None:
    monkeypatch.setattr(judge, "score", lambda law, settings, n: law.score)
    monkeypatch.setattr(judge, "free_reference", lambda split, recovered: 1.0)
    monkeypatch.setattr(judge, "free_score", lambda split, recovered, reference, n: free)
    # one that was followed in a beginning alone has less, of other records
    laws = ((chosen, 100.0, 0.0), (1.0, -900.0, 6.8))
    tried = [
        SimpleNamespace(candidate=SimpleNamespace(chosen=c, prior=prior, score=value, sigma=sigma))
        for c, value, sigma in laws
    ]
    given = SimpleNamespace(split=None, settings=Settings(), n_values=lambda: 1000.0)
    assert judge.beaten(cast(Any, given), cast(Any, tried), cast(Any, None)) is beaten
    assert not judge.beaten(cast(Any, given), [], cast(Any, None))
