"""How long draws from a posterior will take is told after the first temperature, where they take long."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np
import pytest

from femend.app.progress import LineProgress
from femend.bench.updating.drawn import Pace
from femend.estimate.updating import Configuration, Problem, Unknowns, Values, sample
from femend.estimate.updating.sampling import temperatures_left
from femend.progress import SilentProgress

sys.path.insert(0, str(Path(__file__).parents[1]))
from updating_models import LinearSystem, free


@pytest.mark.parametrize(("n", "sd"), [(2, 0.02), (6, 0.1)])
def test_temperatures_are_foreseen_after_the_first(n: int, sd: float) -> None:
    rng = np.random.default_rng(1)
    A = rng.standard_normal((3 * n, n))
    y = A @ rng.standard_normal(n)
    unknowns = Unknowns.of([free(f"x{i + 1}", 1.0) for i in range(n)])
    problem = Problem(unknowns, (Configuration("c", LinearSystem(A), (Values("y", y, sd),)),))
    reached: list[float] = []
    sample(problem, 500, solve_all=lambda p: (((p @ A.T - y) / sd) ** 2).sum(axis=1), told=reached.append)
    assert reached[0] == 0.0
    assert reached[-1] == 1.0
    assert len(reached) - 1 > 5
    assert 1 + temperatures_left(reached[1], n) == pytest.approx(len(reached) - 1, rel=0.25)
    assert temperatures_left(1.0, n) == 0


def told(seconds: list[float]) -> str:
    """What stands on a log of draws at temperatures of 0, 1e-3 and 1 that are reached at `seconds`, begun at 0."""
    stream, times = io.StringIO(), iter([0.0, *seconds])
    pace = Pace(LineProgress(stream), 500, 2, clock=lambda: next(times))
    for beta in (0.0, 1e-3, 1.0):
        pace(beta)
    return stream.getvalue()


def test_long_draws_say_how_long() -> None:
    first, second = told([30.0, 130.0, 230.0]).splitlines()
    assert first.startswith("500 models took 30 s; the draws are moved through temperatures, each of which takes 60 s")
    # ln 1000 over that of the step of two unknowns, 1 + sqrt(2) + 1
    assert second.startswith("the draws take about 10 min more: 6 temperatures of about 1.7 min")
    assert "Ctrl-C leaves them out" in second


def test_short_draws_and_a_silent_progress_say_nothing() -> None:
    assert told([0.1, 0.5, 0.9]) == ""
    Pace(SilentProgress(), 500, 2, clock=iter([0.0, 99.0]).__next__)(0.0)
