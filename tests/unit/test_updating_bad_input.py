"""What updating is given that cannot work, and models that fail on the way: told clearly, and nothing is lost."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend.errors import UpdatingError
from femend.estimate.updating import (
    Command,
    Configuration,
    CrossOrthogonality,
    ExternalSystem,
    FracDifferences,
    Frequencies,
    FrfDifferences,
    MacDifferences,
    Problem,
    ShapeDifferences,
    State,
    Unknown,
    Unknowns,
    Values,
    factor,
    limits,
    multi_start,
    read_history,
    update,
)

sys.path.insert(0, str(Path(__file__).parents[1]))
from updating_models import Array, FunctionSystem, free

PHI, H = np.ones((3, 2)), np.ones((4, 3, 1), dtype=np.complex128)


def exponential(
    solve: Callable[[Array], Array] = np.exp, measured: float = 4.0, name: str = "c", sd: float = 0.1
) -> Problem:
    """y = exp(x) is to be 4: x = ln 4 = 1.386294."""
    system = FunctionSystem(("x",), solve)
    return Problem(Unknowns.of([free("x", np.inf)]), (Configuration(name, system, (Values("y", [measured], sd),)),))


def test_fewer_values_than_unknowns() -> None:
    unknowns = Unknowns.of([free("x", np.inf), free("z", np.inf)])
    both = FunctionSystem(("x", "z"), lambda x: np.array([x[0] + x[1]]))
    configuration = Configuration("c", both, (Values("y", [1.0], 0.1),))
    with pytest.raises(UpdatingError, match="1 paired values and 0 priors for 2 unknowns: give priors"):
        update(Problem(unknowns, (configuration,)))
    # a prior for one of them is enough
    held = Unknowns.of([free("x", np.inf), free("z", 1.0)])
    assert update(Problem(held, (configuration,))).status == "converged"


@pytest.mark.parametrize("sd", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize(
    "response",
    [
        lambda sd: Values("y", np.ones(2), sd),
        lambda sd: Frequencies(np.array([1.0, 2.0]), np.array([0.1, sd])),
        lambda sd: ShapeDifferences(PHI, sd),
        lambda sd: MacDifferences(PHI, np.array([sd, 0.1])),
        lambda sd: FrfDifferences(H, sd),
        lambda sd: FracDifferences(H, sd),
        lambda sd: CrossOrthogonality(PHI, np.eye(3), sd),
    ],
    ids=["values", "frequencies", "shapes", "MAC", "FRFs", "FRAC", "orthogonality"],
)
def test_zero_variance(response: Callable[[float], object], sd: float) -> None:
    with pytest.raises(UpdatingError, match=f"deviation of .* is {sd:g}.*: a value without scatter"):
        response(sd)


@pytest.mark.parametrize("sd", [0.0, -0.1, np.nan])
def test_a_prior_without_variance(sd: float) -> None:
    with pytest.raises(UpdatingError, match="standard deviation"):
        factor("E", sd)


@pytest.mark.parametrize("scale", [0.0, -2.0, np.nan])
def test_an_unknown_whose_value_would_never_change(scale: float) -> None:
    unknowns = Unknowns.of([Unknown("a", scale, positive=False, mean=0.5, sd=1.0)])
    with pytest.raises(UpdatingError, match=r"'a' has a scale of .* where the search starts is `mean`"):
        limits(unknowns)


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ((1.2, 0.8), "bounds of 'E' are 1.2 to 0.8: no value lies between them"),
        ((1.0, 1.0), "no value lies between them"),
        ((np.nan, 2.0), "no value lies between them"),
        ((1.2, 1.8), "mean at 1, outside its bounds 1.2 to 1.8"),
    ],
)
def test_contradictory_bounds(bounds: tuple[float, float], words: str) -> None:
    unknowns = Unknowns.of([factor("E", 0.1, bounds)])
    with pytest.raises(UpdatingError, match=words):
        limits(unknowns)
    with pytest.raises(UpdatingError, match=words):
        Problem(unknowns, (Configuration("c", FunctionSystem(("E",), np.exp), (Values("y", [1.0], 0.1),)),))


def test_values_that_are_no_numbers_are_named() -> None:
    with pytest.raises(UpdatingError, match="bridge: the difference 1 of y is not a number; what was measured"):
        update(exponential(measured=np.nan, name="bridge"))
    with pytest.raises(UpdatingError, match="the start of 'x' is nan"):
        update(exponential(), [np.nan])

    class NoSlope(FunctionSystem):
        def solve(self, factors: Array) -> State:
            return State({"y": self.function(factors)}, lambda _: {"y": np.array([[np.nan]])})

    system = NoSlope(("x",), np.exp)
    blind = Problem(Unknowns.of([free("x", np.inf)]), (Configuration("c", system, (Values("y", [4.0], 0.1),)),))
    with pytest.raises(UpdatingError, match="the derivative of the difference 1 of y is not a number"):
        update(blind)


def test_a_mass_matrix_that_does_not_fit() -> None:
    with pytest.raises(UpdatingError, match=r"shape \(2, 2\) for 3 sensors"):
        CrossOrthogonality(PHI, np.eye(2), 0.1)
    with pytest.raises(UpdatingError, match="test mode 2 has the modal mass 0"):
        CrossOrthogonality(PHI * [1.0, 0.0], np.eye(3), 0.1)


def failing_after(n: int) -> Callable[[Array], Array]:
    """exp(x), `n` times: a solve and two runs for its derivative make three a step."""
    left = [n]

    def solve(x: Array) -> Array:
        left[0] -= 1
        if left[0] < 0:
            raise UpdatingError("no licence")
        return np.exp(x)

    return solve


@pytest.mark.parametrize(("n", "where"), [(3, -2.0), (4, -2.0), (6, -1.0)])
def test_a_model_that_fails_from_some_run_on_is_no_minimum(n: int, where: float) -> None:
    """The start takes three runs, the first step (radius 1, to -1) one and its derivative two: a step whose derivative
    fails is not taken, and no search that only failures ended has converged."""
    found = update(exponential(failing_after(n)), [-2.0])
    assert found.status == "stalled"
    assert found.p.tolist() == [where]
    assert "no licence" in found.advice
    assert "no licence" in repr(found)
    with pytest.raises(UpdatingError, match="no licence"):
        update(exponential(failing_after(2)), [-2.0])


def test_a_derivative_of_the_wrong_sign_is_no_minimum() -> None:
    class Wrong(FunctionSystem):
        def solve(self, factors: Array) -> State:
            return State({"y": np.exp(factors)}, lambda _: {"y": -np.diag(np.exp(factors))})

    system = Wrong(("x",), np.exp)
    problem = Problem(Unknowns.of([free("x", np.inf)]), (Configuration("c", system, (Values("y", [4.0], 0.1),)),))
    found = update(problem, [-2.0])
    assert found.status == "stalled"
    assert "no step lowers the cost" in found.advice


def test_points_that_are_no_numbers_are_gone_around() -> None:
    """Beyond 1.5 the model writes NaN; ln 4 = 1.386 lies before."""
    found = update(exponential(lambda x: np.where(x < 1.5, np.exp(np.minimum(x, 2.0)), np.nan)), [-2.0], radius=8.0)
    assert found.status == "converged"
    assert found.p[0] == pytest.approx(1.386294, abs=1e-5)


SOLVER = """
import json, pathlib, sys
if not pathlib.Path(LICENCE).exists():
    print("no licence"); sys.exit(7)
x = float(open("in.txt").read())
json.dump([x ** 3], open("out.json", "w"))
"""


def cube(folder: Path, licence: Path) -> tuple[Problem, ExternalSystem]:
    """A solver that says x^3 as long as it has its licence; 1.331 makes x = 1.1 times its nominal 1."""

    def read(at: Path) -> dict[str, Array]:
        return {"y": np.array(json.loads((at / "out.json").read_text()))}

    templates = {"in.txt": "{{x:.15g}}", "solve.py": SOLVER.replace("LICENCE", repr(str(licence)))}
    own = ExternalSystem(Command((sys.executable, "-S", "solve.py"), templates, read), {"x": 1.0}, folder)
    unknowns = Unknowns.of([factor("x", np.inf, (0.5, 1.5))])
    return Problem(unknowns, (Configuration("c", own, (Values("y", [1.331], 0.001),)),)), own


def test_a_solver_that_dies_on_the_way_loses_nothing(tmp_path: Path) -> None:
    """The licence goes after the first step and comes back: the search goes on there, and no finished run is made
    again."""
    licence, history = tmp_path / "licence", tmp_path / "history.json"
    licence.touch()
    problem, own = cube(tmp_path / "runs", licence)

    def revoke(_: object) -> bool:
        licence.unlink(missing_ok=True)
        return False

    cut = update(problem, tolerance=1e-4, history=history, stop=revoke)
    assert cut.status == "stalled"
    assert "ended with code 7" in cut.advice
    assert len(read_history(history, problem)) == len(cut.history) == 2
    done = len(list((tmp_path / "runs").glob("*/results.npz")))
    assert done == 6, "a point and a difference to both sides, twice"

    licence.touch()
    again, fresh = cube(tmp_path / "runs", licence)
    rest = update(again, tolerance=1e-4, history=history, resume=True)
    assert rest.status == "converged"
    assert rest.values["x"] == pytest.approx(1.1, rel=1e-4)
    assert fresh.n_runs == len(list((tmp_path / "runs").glob("*/results.npz"))) - done
    assert own.n_runs > done, "the runs that failed were tried"


def test_starts_that_fail_leave_the_others_alone() -> None:
    """Two of four starts lie where the model tears; the other two end at ln 4."""

    def solve(x: Array) -> Array:
        if x[0] < 0.0:
            raise UpdatingError("torn")
        return np.exp(x)

    many = multi_start(exponential(solve), starts=np.array([[-1.0], [1.0], [-0.5], [2.0]]))
    assert many.failures == {0: "torn", 2: "torn"}
    assert many.ends[[1, 3], 0] == pytest.approx([1.386294, 1.386294], abs=1e-5)
