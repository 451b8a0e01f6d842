"""How searches end: at a minimum beside which costs are rounding, and at factors that run to 0."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.estimate.updating import Configuration, Problem, State, Unknowns, Values, design, factor, update
from femend.estimate.updating.unknown import LEAST_FACTOR, factors_of, limits
from femend.model import Parameter

sys.path.insert(0, str(Path(__file__).parents[1]))
from updating_models import FunctionSystem

Array = NDArray[np.float64]


def fitted(function: FunctionSystem, measured: Array, sd: float = 0.3, scatter: float = 1e-2) -> Problem:
    values = Values("y", measured, np.full(measured.shape, scatter))
    unknowns = Unknowns.of([factor(name, sd) for name in function.names])
    return Problem(unknowns, (Configuration("c", function, (values,)),))


class Rounded:
    """y = (x^3, x, 1), the last off by rounding that grows with every solution."""

    names = ("a",)

    def __init__(self, rounding: float) -> None:
        self.rounding, self.solved = rounding, 0

    def solve(self, factors: Array) -> State:
        self.solved += 1
        x = float(factors[0])
        slopes = {"y": np.array([[3 * x**2, 1.0, 0.0]])}
        return State({"y": np.array([x**3, x, 1.0 + self.rounding * self.solved])}, lambda _: slopes)


@pytest.mark.parametrize(("rounding", "status"), [(0.0, "converged"), (1.5e-7, "converged"), (1e-2, "stalled")])
def test_a_minimum_beside_which_costs_are_rounding_is_one(rounding: float, status: str) -> None:
    """Values that disagree leave a cost of thousands, and solutions scatter it by more than the last steps promise; a
    search that such scatter ends far from a minimum is stalled."""
    values = Values("y", np.array([1.3, 0.9, 0.97]), np.full(3, 3e-3))
    found = update(Problem(Unknowns.of([factor("a", 0.3)]), (Configuration("c", Rounded(rounding), (values,)),)))
    assert found.status == status
    assert found.after.cost > 1000
    assert ("no step lowers the cost" in found.advice) == (status == "stalled")


def test_a_search_that_no_step_lowers_far_from_a_minimum_is_stalled() -> None:
    """A cost that jumps up all around the start, against derivatives that promise much."""

    class Walled(FunctionSystem):
        def solve(self, factors: Array):  # type: ignore[no-untyped-def]
            state = super().solve(factors)
            if factors[0] != 1.0:
                state.values["y"] = state.values["y"] + 10.0
            return state

    found = update(fitted(Walled(("a",), lambda x: x), np.array([1.5])))
    assert found.status == "stalled"
    assert "no step lowers the cost" in found.advice


def test_a_factor_that_runs_to_zero_is_held_above_and_named() -> None:
    def stiffness(x: Array) -> Array:
        if x[0] <= 0:
            raise ArithmeticError("a deck cannot be solved without stiffness")
        return np.array([x[0], x[1]])

    class Deck(FunctionSystem):
        def solve(self, factors: Array):  # type: ignore[no-untyped-def]
            assert (factors > 0).all()
            return super().solve(factors)

    found = update(fitted(Deck(("k", "E"), stiffness), np.array([-0.2, 1.1])))
    assert found.status == "at bound"
    assert found.values["k"] == pytest.approx(LEAST_FACTOR)
    assert found.advice.count("k ran to 0 and is held at 0.001") == 1
    assert "E" not in found.advice.replace("E ", "")


def test_starts_of_wide_priors_are_above_zero() -> None:
    unknowns = Unknowns.of([factor("c", 1.0), factor("k", 0.4), factor("b", 0.3, (0.2, 3.0))])
    points = design(unknowns, 200, seed=1)
    assert points[:, 0].min() > 0.03
    assert points[:, 0].max() > 2.9
    assert points[:, 1].min() == pytest.approx(0.2, abs=0.02)
    assert points[:, 2].min() == pytest.approx(0.2, abs=0.02)


def test_a_decks_lower_bound_of_zero_is_short_of_it() -> None:
    both = factors_of([Parameter("a", "E", "material", (1,), 0.1, (0.0, 2.0)), Parameter("b", "E", "material", (1,))])
    assert limits(both)[0].tolist() == [LEAST_FACTOR, LEAST_FACTOR]
    assert limits(both)[1].tolist() == [2.0, np.inf]
