"""Updating: what is found, how it ends, what is told, and what is refused."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize

from femend import Dof
from femend.errors import ArgumentError, UpdatingError
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    ModeTest,
    Problem,
    ShapeDifferences,
    Unknowns,
    Values,
    affine_matrices,
    collinear_groups,
    factor,
    limits,
    modal_system,
    read_history,
    sensitivities,
    smooth,
    update,
)
from femend.estimate.updating.step import best_step

sys.path.insert(0, str(Path(__file__).parents[1]))
from updating_models import TRUTH, FunctionSystem, LinearSystem, chain, chain_problem, free

A = np.array([[1.0, 0.5], [0.2, 1.0], [1.0, -1.0]])


def linear(sd: float = 2.0, bounds: tuple[float, float] | None = None) -> Problem:
    unknowns = Unknowns.of([free("x1", sd, bounds), free("x2", sd)])
    return Problem(unknowns, (Configuration("c", LinearSystem(A), (Values("y", [1.0, 2.0, -0.5], 0.5),)),))


def test_linear_gaussian_posterior_in_closed_form() -> None:
    found = update(linear())
    H = A.T @ A / 0.25 + np.eye(2) / 4
    y = np.array([1.0, 2.0, -0.5])
    np.testing.assert_allclose(found.p, np.linalg.solve(H, A.T @ y / 0.25), rtol=1e-6)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(H), rtol=1e-10)
    # evidence of the data but for (2 pi)^(-m/2) and the deviations: N(y; 0, A S A' + 0.25 I)
    C = A @ A.T * 4 + 0.25 * np.eye(3)
    exact = -0.5 * y @ np.linalg.solve(C, y) - 0.5 * np.linalg.slogdet(C / 0.25)[1]
    assert found.log_evidence == pytest.approx(exact, abs=1e-9)
    assert found.status == "converged"
    assert found.determined() == ["x1", "x2"]


def test_limits_are_kept_and_told() -> None:
    found = update(linear(2.0, (-1.0, 0.3)))
    assert found.status == "at bound"
    assert found.at_bound.tolist() == [True, False]
    assert found.p[0] == 0.3
    # the other one is at the minimum that is left to it
    rest = (2.0 - 0.2 * 0.3) * 1.0 + (1.0 - 0.3) * 0.5 - (-0.5 - 0.3)
    assert found.p[1] == pytest.approx(rest / 0.25 / ((0.25 + 1 + 1) / 0.25 + 0.25), rel=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_a_step_is_the_least_of_its_box(seed: int) -> None:
    rng = np.random.default_rng(seed)
    J, r, scale = rng.standard_normal((9, 5)), 3 * rng.standard_normal(9), rng.uniform(0.1, 10, 5)
    low, high = -rng.uniform(0, 0.3, 5), rng.uniform(0, 0.3, 5)
    step, gain = best_step(r, J, low, high, scale)
    exact = scipy.optimize.lsq_linear(J, -r, (low, high + 1e-300), method="bvls")
    np.testing.assert_allclose(step, exact.x, atol=1e-7)
    assert gain == pytest.approx(r @ r - 2 * exact.cost, rel=1e-9)


def test_a_chain_is_recovered_and_told_of() -> None:
    found = update(chain_problem(sd=np.inf))
    np.testing.assert_allclose(found.p, TRUTH, rtol=1e-6)
    assert found.after.cost < 1e-9 * found.before.cost
    assert found.changed_most(2) == ["k1", "k2"]
    held = update(chain_problem(sd=0.05))
    assert "k1" in held.left_prior()
    assert "k1" in repr(held)
    assert [row.mac_after > 0.999 for row in held.modes()] == [True] * 4


def test_modes_that_change_places_are_followed() -> None:
    # two oscillators side by side, weakly coupled: the softer one becomes the stiffer
    parts = {"a": np.diag([1.0, 0.0]), "b": np.diag([0.0, 1.3])}
    matrices = affine_matrices(parts, np.eye(2), K_fixed=0.02 * np.array([[1.0, -1.0], [-1.0, 1.0]]))
    system = modal_system(matrices, [0, 1], 2)
    state = system.solve(np.array([1.9, 0.8]))
    freq, phi = state.value("freq"), state.value("phi")
    responses = (Frequencies(freq, 0.001 * freq), ShapeDifferences(phi, 0.02))
    unknowns = Unknowns.of([factor(n, np.inf, (0.2, 4.0)) for n in ("a", "b")])
    found = update(Problem(unknowns, (Configuration("pair", system, responses, ModeTest(freq, phi)),)), radius=0.1)
    np.testing.assert_allclose(found.p, [1.9, 0.8], rtol=1e-5)
    notes = [n for i in found.history for n in i.notes]
    assert any("paired with model mode 1, before with 2" in n for n in notes), notes


def test_a_history_is_gone_on_from(tmp_path: Path) -> None:
    problem, path = chain_problem(noise=1.0), tmp_path / "run.json"
    whole = update(problem)
    first = update(problem, history=path, stop=lambda i: True)
    assert first.status == "stopped"
    assert len(first.history) == 2
    rest = update(problem, history=path, resume=True)
    np.testing.assert_allclose(rest.p, whole.p, rtol=1e-9)
    assert len(rest.history) == len(whole.history)
    assert rest.before.cost == pytest.approx(whole.before.cost)
    assert len(read_history(path, problem)) == len(whole.history)
    with pytest.raises(UpdatingError, match="another problem"):
        read_history(path, chain_problem(noise=2.0))
    path.write_text("{}")
    with pytest.raises(UpdatingError, match="no history"):
        update(problem, history=path, resume=True)


def test_a_history_of_another_problem_says_what_differs(tmp_path: Path) -> None:
    problem, path = chain_problem(), tmp_path / "run.json"
    update(problem, history=path, iterations=1)

    def said(other: Problem) -> str:
        with pytest.raises(UpdatingError, match="put that back to go on from it, or start anew with another file") as e:
            read_history(path, other)
        return str(e.value)

    prior = said(chain_problem(sd=0.2))
    assert "(parameter 'k1': prior_sd was 0.3, is 0.2; parameter 'k2': prior_sd was 0.3, is 0.2; " in prior
    assert "bounds" not in prior
    assert "precision" not in prior
    assert "parameter 'm': bounds was 0.4, 2, is 0.4, 3" in said(chain_problem(bounds=(0.4, 3.0)))
    one, chained = problem.configurations[0], problem.configurations[0].responses
    fewer = replace(problem, unknowns=Unknowns.of(problem.unknowns.items[:3]))
    assert "(parameter 'm' is there no longer)" in said(fewer)
    frequencies, shapes = chained
    assert isinstance(frequencies, Frequencies)
    moved = replace(frequencies, freq=frequencies.freq * np.array([1.0, 1.001, 1.0, 1.0]))
    other = replace(problem, configurations=(replace(one, responses=(moved, shapes)),))
    assert "(frequencies of chain: freq has other values (4 values from " in said(other)
    assert "shapes of chain is there no longer" in said(
        replace(problem, configurations=(replace(one, responses=(frequencies,)),))
    )
    # a file of before, which told nothing of its problem
    kept = json.loads(path.read_text())
    del kept["told"]
    path.write_text(json.dumps(kept))
    assert "(unknowns, priors, limits or data differ)" in said(chain_problem(sd=0.2))


def test_a_search_that_is_cut_off_says_so() -> None:
    assert update(chain_problem(noise=1.0), iterations=1).status == "limit"


def test_a_point_without_solution_is_not_taken() -> None:
    def solve(x: np.ndarray) -> np.ndarray:
        if x[0] > 1.5:
            raise UpdatingError("no equilibrium")
        return np.array([np.exp(x[0])])

    unknowns = Unknowns.of([free("x", np.inf)])
    problem = Problem(unknowns, (Configuration("c", FunctionSystem(("x",), solve), (Values("y", [4.0], 0.1),)),))
    found = update(problem, [-2.0], radius=8.0)
    assert found.p[0] == pytest.approx(np.log(4.0), rel=1e-5)
    assert any("no equilibrium" in n for i in found.history for n in i.notes)


def test_a_field_prior_smooths() -> None:
    n = 12
    names = [f"e{i}" for i in range(n)]
    unknowns = Unknowns.of([free(m, 10.0) for m in names])
    eye = LinearSystem(np.eye(n))
    eye.names = tuple(names)
    y = np.where(np.arange(n) < 6, 0.0, 1.0) + 0.5 * np.random.default_rng(0).standard_normal(n)
    rough = Problem(unknowns, (Configuration("c", eye, (Values("y", y, 0.5),)),))
    flat = smooth(unknowns, list(pairwise(names)), 0.2)
    found = update(replace(rough, unknowns=flat))
    assert np.abs(np.diff(found.p)).max() < 0.3 * np.abs(np.diff(update(rough).p)).max()
    np.testing.assert_allclose(np.linalg.solve(np.eye(n) / 0.25 + flat.precision, y / 0.25), found.p, atol=1e-6)


def test_what_the_data_cannot_tell_is_named() -> None:
    system = LinearSystem(np.array([[1.0, 2.0, 0.0], [0.5, 1.0001, 0.0], [1.0, 2.0, 1e-4]]))
    unknowns = Unknowns.of([free(n, 1.0) for n in ("x1", "x2", "x3")])
    found = sensitivities(Problem(unknowns, (Configuration("c", system, (Values("y", np.zeros(3), 0.01),)),)))
    assert found.insensitive == ("x3",)
    assert [c.names for c in found.collinear] == [("x1", "x2")]
    assert "not told apart" in repr(found)
    # fewer values than unknowns: a direction no value sees
    assert collinear_groups(np.ones((1, 2)), ("a", "b"))[0].names == ("a", "b")
    assert collinear_groups(np.eye(3), ("a", "b", "c")) == ()


def test_unseen_unknowns_have_no_deviation() -> None:
    system = LinearSystem(np.array([[1.0, 1.0], [2.0, 2.0]]))
    unknowns = Unknowns.of([free("x1", np.inf), free("x2", np.inf)])
    found = update(Problem(unknowns, (Configuration("c", system, (Values("y", [1.0, 2.0], 0.1),)),)))
    assert np.isinf(np.diag(found.covariance)).all()
    assert found.p.sum() == pytest.approx(1.0)


def test_bad_problems_are_refused() -> None:
    problem = chain_problem(sd=np.inf)
    (c,) = problem.configurations
    freq = c.responses[0]
    assert isinstance(freq, Frequencies)
    assert c.test is not None
    few = modal_system(chain(4), list(range(6)), 6)
    five = Unknowns.of([factor(n, np.inf, (0.4, 2.0)) for n in ("k1", "k2", "k3", "k4", "m")])
    short = Problem(five, (Configuration("c", few, (freq,), replace(c.test, phi=None)),))
    with pytest.raises(UpdatingError, match="4 paired values and 0 priors for 5 unknowns"):
        update(short)
    lost = np.vstack([np.eye(4), -1e-3 * np.ones((2, 4))]) + np.array([[0.0], [3.0], [-3.0], [3.0], [0.0], [-3.0]])
    astray = replace(problem, mac_min=0.999, configurations=(replace(c, test=ModeTest(freq.freq, lost)),))
    with pytest.raises(UpdatingError, match="no measured mode has a mate"):
        update(astray)
    with pytest.raises(UpdatingError, match="no value lies between"):
        limits(Unknowns.of([factor("k1", 0.1, (1.2, 0.8))]))
    with pytest.raises(UpdatingError, match="outside its bounds"):
        limits(Unknowns.of([factor("k1", 0.1, (1.2, 1.8))]))
    with pytest.raises(UpdatingError, match="outside its bounds"):
        update(problem, [5.0, 1.0, 1.0, 1.0])
    with pytest.raises(UpdatingError, match="standard deviation"):
        factor("k1", 0.0)
    with pytest.raises(UpdatingError, match="no configuration has a parameter 'nu'"):
        Problem(Unknowns.of([factor("nu")]), problem.configurations)
    with pytest.raises(UpdatingError, match="no parameter 'q'"):
        Problem(problem.unknowns, (replace(c, links={"q": "k1"}),))
    with pytest.raises(UpdatingError, match="which is no unknown"):
        Problem(problem.unknowns, (replace(c, links={"k1": "q"}),))
    with pytest.raises(UpdatingError, match="ask it for more"):
        update(replace(problem, configurations=(replace(c, system=modal_system(chain(), list(range(6)), 3)),)))
    with pytest.raises(UpdatingError, match="not symmetric"):
        affine_matrices({"k": np.array([[1.0, 1.0], [0.0, 1.0]])}, np.eye(2))
    with pytest.raises(UpdatingError, match="rows 0 to 5"):
        modal_system(chain(), [6], 3)
    with pytest.raises(UpdatingError, match="a sensor is at row -1, the model has rows 0 to 5"):
        modal_system(chain(), [2, -1], 3)
    for sensor in (Dof(3, 1), "3:+X", 1.7, True):
        with pytest.raises(
            ArgumentError, match=r"row numbers of its matrices, from 0 \(`deck_system` takes DOFs\); an? "
        ):
            modal_system(chain(), [0, sensor], 3)
