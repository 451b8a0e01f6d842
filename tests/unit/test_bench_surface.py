"""`femend update` from a design of experiments: the surface's least point, the gradient after it, and surfaces that are
not to be believed."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend import update_study
from femend.bench import UpdateRun
from femend.bench.updating.surface_start import start_on_surface
from femend.errors import StudyError, UpdatingError
from femend.estimate.updating import Configuration, Problem, Unknowns, Values, factor, response_surface
from femend.study.file.bench_settings import UpdatingSettings

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import TABLES, Recorded, study_text, write_study
from updating_models import FunctionSystem

RECORDED = (Recorded("tip"),)


def tables(keys: str = "response_surface = true\n") -> str:
    return f"{TABLES}[updating]\n{keys}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("surface")


@pytest.fixture(scope="module")
def run(folder: Path) -> UpdateRun:
    return update_study(write_study(folder, RECORDED, tables()), folder / "out")


def test_the_gradient_goes_on_from_the_least_point(run: UpdateRun, folder: Path) -> None:
    assert run.surface is not None
    assert run.surface.taken
    # two unknowns: 1, x, y, x^2, xy, y^2, each twice
    assert run.result["response_surface"]["points"] == 12
    again = response_surface(run.problem)
    np.testing.assert_allclose(run.surface.p, again.minimise())
    told = run.result["response_surface"]
    # frequencies over moduli are all but quadratic
    assert told["left_of_variance"] < 1e-3
    assert told["cost"]["foretold"] == pytest.approx(told["cost"]["there"], rel=0.2)
    assert told["cost"]["deck"] == pytest.approx(run.problem.evaluate(run.problem.unknowns.mean).cost)
    np.testing.assert_allclose(run.found.history[0].p, run.surface.p)
    (folder / "study.toml").write_text(study_text(RECORDED, tables("")))
    plain = update_study(folder)
    assert plain.surface is None
    assert plain.result["response_surface"] is None
    assert run.factors == pytest.approx(plain.factors, rel=1e-5)
    # what stood before is the deck
    assert run.result["cost"]["before"] == pytest.approx(plain.result["cost"]["before"])
    assert {p["before"] for p in run.result["parameters"].values()} == {1.0}
    assert len(run.found.history) < len(plain.found.history)


def test_what_is_written_and_said(run: UpdateRun, folder: Path) -> None:
    result = json.loads((folder / "out" / "updating.json").read_text())
    told = result["response_surface"]
    assert (told["points"], told["failed"], told["terms"], told["begun_there"]) == (12, 0, 6, True)
    assert set(told["minimum"]) == {"E_root", "E_tip"}
    # frequencies are all but linear in the two over their priors: no part together, and the root makes most
    share = told["sobol"]
    assert share["E_root"]["first"] > 0.6
    assert share["E_root"]["first"] + share["E_tip"]["first"] == pytest.approx(1.0, abs=0.05)
    assert share["E_root"]["total"] == pytest.approx(share["E_root"]["first"], abs=0.05)
    # those of the derivatives, in which each prior deviation counts as it does
    linear = np.square(run.sensitivity.table).sum(axis=0)
    assert share["E_tip"]["first"] == pytest.approx(linear[1] / linear.sum(), abs=0.05)
    page = (folder / "out" / "updating.html").read_text()
    assert "12 points of a Latin hypercube between the bounds, a quadratic of 6 terms" in page
    assert "The search began at the least point of the response surface." in page
    assert "has a part in" in page
    assert "surface   12 points" in repr(run)


def problem_of(values: Callable[[np.ndarray], np.ndarray], measured: list[float]) -> Problem:
    """`values` of a factor between 0.5 and 1.5, measured within 1."""
    unknowns = Unknowns.of([factor("x", 0.2, (0.5, 1.5))])
    system = FunctionSystem(("x",), values)
    return Problem(unknowns, (Configuration("c", system, (Values("y", measured, 1.0),)),))


def test_a_least_point_that_is_none_is_not_begun_at() -> None:
    """A response that no quadratic follows: the surface's least point costs more than the deck."""

    problem = problem_of(lambda x: np.array([20 * (1 - np.exp(-((x[0] - 1.0) ** 2) / 2e-3))]), [0.0])
    found = start_on_surface(problem, UpdatingSettings(design_points=40))
    assert found.left > 0.1
    assert not found.taken
    assert found.there > found.deck
    (said,) = found.advice()
    assert "the search began at the deck" in said
    assert found.as_dict()["begun_there"] is False


def test_a_surface_that_leaves_much_is_pointed_out() -> None:
    problem = problem_of(lambda x: np.array([60 * (x[0] - 0.7) + 12 * np.sin(25 * x[0])]), [0.0])
    found = start_on_surface(problem, UpdatingSettings(design_points=30))
    assert found.taken
    assert found.left > 0.1
    (said,) = found.advice()
    assert "it told where to begin, no more" in said


def test_points_without_solution_are_told() -> None:
    def values(x: np.ndarray) -> np.ndarray:
        if x[0] > 1.3:
            raise UpdatingError("nothing holds")
        return np.array([x[0]])

    found = start_on_surface(problem_of(values, [1.1]), UpdatingSettings(design_points=20))
    lost = len(found.surface.failures)
    assert lost > 0
    (said,) = found.warnings()
    assert said.startswith(f"{lost} of 20 points of the design gave no result, point ")
    assert said.endswith("nothing holds")


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("design_points = 20\n", r"updating\.design_points: is given and nothing uses it; say response_surface = true"),
        ("response_surface = true\ndesign_points = 0\n", r"updating\.design_points: 0 is less than one"),
    ],
)
def test_keys_that_cannot_be_meant(folder: Path, run: UpdateRun, keys: str, message: str) -> None:
    path = folder / "broken.toml"
    path.write_text(study_text(RECORDED, tables(keys)))
    with pytest.raises(StudyError, match=message):
        update_study(path)


def test_too_few_points_for_a_quadratic(folder: Path, run: UpdateRun) -> None:
    path = folder / "few.toml"
    path.write_text(study_text(RECORDED, tables("response_surface = true\ndesign_points = 4\n")))
    with pytest.raises(UpdatingError, match="4 of 4 points have a solution, the quadratic has 6 terms"):
        update_study(path)
