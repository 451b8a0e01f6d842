"""Laws that cannot be followed to a strong motion: weaker ones, and weaker recordings, are tried before all else."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose import diagnosis
from femend.diagnose.fitting.candidates import Start
from femend.diagnose.fitting.nonlinear import _weaker_too
from femend.diagnose.fitting.runs import Run
from femend.diagnose.settings import Settings
from femend.physics import physics


def run(name: str, left: float, cost: float, misfit: float, **values: float) -> Run:
    """A start that left so much of the recovered force, and so much of the records in its first window."""
    loop = SimpleNamespace(size=lambda: 1.0)
    reached = SimpleNamespace(cost=cost, e=np.array([np.sqrt(misfit)]))
    start = Start(physics(name), values, 10.0, 1.0, left)
    return Run(name, start, cast(Any, SimpleNamespace(loop=loop)), cast(Any, reached))


def test_a_law_that_follows_the_force_and_not_the_motion_is_tried_weaker() -> None:
    stop = run("clearance", 0.36, 700.0, 1.8, k=7e3, gap=1e-4, sides=2.0)
    cubic = run("cubic_stiffness", 0.37, 8500.0, 22.0, k3=1e11)
    again = _weaker_too([stop, cubic])
    assert [(name, start.values["k3"], start.k) for name, start in again] == [
        ("cubic_stiffness", pytest.approx(3e10), pytest.approx(3.0)),
        ("cubic_stiffness", pytest.approx(1e10), pytest.approx(1.0)),
    ]


@pytest.mark.parametrize(
    ("left", "cost", "misfit"),
    [
        (0.6, 8500.0, 22.0),  # it does not follow the force either
        (0.37, 1300.0, 3.0),  # nor does it leave far more than the other
        (0.37, 8500.0, 1.5),  # nor more than noise
        (np.nan, 8500.0, 22.0),  # friction that sticks, found without a regression
    ],
)
def test_other_laws_are_not(left: float, cost: float, misfit: float) -> None:
    stop = run("clearance", 0.36, 700.0, 1.8, k=7e3, gap=1e-4, sides=2.0)
    assert _weaker_too([stop, run("cubic_stiffness", left, cost, misfit, k3=1e11)]) == []
    assert _weaker_too([]) == []


@pytest.mark.parametrize(
    ("free", "chosen", "score", "sigma", "lost"),
    [
        (0.9, 7.0, 900.0, 0.0, True),  # a free force explains what no law does
        (0.9, 1.3, 20.0, 0.0, True),  # nor to the noise, though nearly
        (0.9, 1.0, 20.0, 0.0, False),
        (0.9, 1.0, 500.0, 0.0, True),  # a law with the model far from its priors
        (0.9, 7.0, 900.0, 2.0, False),  # laws are compared in a window already
        (3.0, 7.0, 900.0, 0.0, False),  # a free force does not explain it either: several are missing, or another place
    ],
)
def test_laws_are_lost_on_the_way_where_a_free_force_explains_what_they_do_not(
    free: float, chosen: float, score: float, sigma: float, lost: bool
) -> None:
    located = [SimpleNamespace(fit=SimpleNamespace(score=free))]
    task: Any = SimpleNamespace(settings=Settings(), located=located)
    candidate = SimpleNamespace(chosen=chosen, reference=free, nonlinear=True)
    alone: Any = SimpleNamespace(score=1000.0, n_values=500.0, candidate=SimpleNamespace(chosen=7.0))
    ranked: Any = [SimpleNamespace(candidate=candidate, score=score)]
    assert diagnosis._lost_on_the_way(task, alone, ranked, sigma) is lost


@pytest.mark.parametrize(
    ("chosen", "nonlinear", "lost"),
    [(1.3, True, True), (1.3, False, True), (1.0, False, False), (7.0, False, True)],
)
def test_nothing_is_lost_where_no_nonlinear_law_was_worth_trying(chosen: float, nonlinear: bool, lost: bool) -> None:
    """A linear law leaves hardly more than a free force, and the model bends beside it."""
    task: Any = SimpleNamespace(settings=Settings(), located=[SimpleNamespace(fit=SimpleNamespace(score=0.9))])
    laws: Any = [
        SimpleNamespace(score=500.0, candidate=SimpleNamespace(chosen=chosen, reference=0.9, nonlinear=nonlinear))
    ]
    alone: Any = SimpleNamespace(score=1000.0, n_values=500.0, candidate=SimpleNamespace(chosen=7.0))
    assert diagnosis._lost_on_the_way(task, alone, laws, 0.0) is lost
