"""Estimators against closed forms: posterior, evidence, strength, surfaces, Sobol indices, populations, many starts."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.errors import UpdatingError
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    ModalSystem,
    ModeTest,
    Problem,
    ShapeDifferences,
    StartsInterrupted,
    Unknowns,
    Values,
    design,
    factor,
    multi_start,
    reduced_problem,
    response_surface,
    sample,
    sobol,
    tikhonov,
    update,
    update_population,
)
from femend.estimate.updating.state import State
from femend.numerals import plain

sys.path.insert(0, str(Path(__file__).parents[1]))
from updating_models import TRUTH, FunctionSystem, LinearSystem, chain, chain_problem, free

A = np.array([[1.0, 0.5], [0.2, 1.0], [1.0, -1.0]])
Y = np.array([1.0, 2.0, -0.5])


def linear(sd: float = 2.0, bounds: tuple[float, float] | None = None) -> Problem:
    unknowns = Unknowns.of([free("x1", sd, bounds), free("x2", sd)])
    return Problem(unknowns, (Configuration("c", LinearSystem(A), (Values("y", Y, 0.5),)),))


def test_draws_have_the_closed_posterior_and_evidence() -> None:
    drawn = sample(linear(), 2000, solve_all=lambda p: (((p @ A.T - Y) / 0.5) ** 2).sum(axis=1))
    exact = update(linear())
    sd = np.sqrt(np.diag(exact.covariance))
    # standard errors of 2000 draws: 0.022 of a mean, 0.016 of a deviation; moves leave some dependence
    np.testing.assert_allclose((drawn.mean - exact.p) / sd, 0.0, atol=0.1)
    np.testing.assert_allclose(np.sqrt(np.diag(drawn.covariance)) / sd, 1.0, atol=0.08)
    assert drawn.log_evidence == pytest.approx(exact.log_evidence, abs=max(0.15, 4 * drawn.log_evidence_se))
    assert drawn.advice == ""
    assert drawn.temperatures[-1] == 1.0
    low, middle, high = drawn.quantiles()["x1"]
    assert low < middle < high
    head, _, *rows = repr(drawn).splitlines()
    assert head.startswith("2000 draws, ln evidence")
    assert [row.split()[0] for row in rows] == list(drawn.quantiles())


def test_the_evidence_of_many_unknowns_is_not_that_of_lazy_particles() -> None:
    """18 unknowns known to a tenth of their prior: particles that are not new ones would raise ln Z by one."""
    rng = np.random.default_rng(3)
    J = rng.standard_normal((60, 18))
    y = J @ rng.standard_normal(18) + 0.5 * rng.standard_normal(60)
    system = LinearSystem(J)
    problem = Problem(
        Unknowns.of([free(n, 1.0) for n in system.names]), (Configuration("c", system, (Values("y", y, 0.5),)),)
    )
    exact = update(problem)
    sd = np.sqrt(np.diag(exact.covariance))
    assert sd.max() < 0.15
    drawn = [
        sample(problem, 500, seed=k, solve_all=lambda p: (((p @ J.T - y) / 0.5) ** 2).sum(axis=1)) for k in range(4)
    ]
    off = np.array([d.log_evidence - exact.log_evidence for d in drawn])
    se = float(np.mean([d.log_evidence_se for d in drawn]))
    assert se < 0.3
    assert abs(off.mean()) < 3 * se / np.sqrt(len(off))
    # three standard errors of 500 draws, widened by what dependence moves leave
    for d in drawn:
        np.testing.assert_allclose((d.mean - exact.p) / sd, 0.0, atol=0.2)
        np.testing.assert_allclose(np.sqrt(np.diag(d.covariance)) / sd, 1.0, atol=0.15)
        assert d.advice == ""


def test_draws_are_many_enough_for_their_unknowns() -> None:
    with pytest.raises(UpdatingError, match="7 draws for 2 unknowns say nothing of how these go together; take 8 or"):
        sample(linear(), 7)
    assert sample(linear(), 8).p.shape == (8, 2)


def test_draws_keep_limits() -> None:
    drawn = sample(linear(2.0, (-1.0, 0.3)), 300)
    assert drawn.p[:, 0].max() <= 0.3
    assert drawn.p[:, 0].mean() < 0.3 - 0.01


def test_draws_are_repeatable() -> None:
    one, two = (sample(linear(), 100, seed=5) for _ in range(2))
    np.testing.assert_array_equal(one.p, two.p)


def test_the_strength_the_data_choose() -> None:
    rng = np.random.default_rng(0)
    n = 80
    x = np.linspace(0, 1, n)
    blur = np.exp(-((x[:, None] - x) ** 2) / 0.01) / 14
    truth = np.sin(2 * np.pi * x)
    y = blur @ truth + 0.02 * rng.standard_normal(n)
    system = LinearSystem(blur)
    unknowns = Unknowns.of([free(m, 1.0) for m in system.names])
    problem = Problem(unknowns, (Configuration("c", system, (Values("y", y, 0.02),)),))
    strengths = np.logspace(3, -7, 11)
    errors = []
    for s in strengths:
        u = replace(unknowns, precision=s * unknowns.precision)
        errors.append(np.linalg.norm(blur @ (update(replace(problem, unknowns=u)).p - truth)))
    for rule in ("gcv", "discrepancy", "l-curve"):
        found = tikhonov(problem, strengths.tolist(), rule=rule)  # type: ignore[arg-type]
        assert repr(found).startswith(
            f"strength {plain(found.strength, 3)} of the priors by {rule!r}, of 11 from 1e-07"
        )
        # the rules are about prediction: within a factor of two of the best that any strength gives
        assert np.linalg.norm(blur @ (found.result.p - truth)) < 2 * min(errors), rule
        assert np.all(np.diff(found.squares) <= 1e-6 * found.squares[:-1])
    assert max(errors[0], errors[-1]) > 3 * min(errors)
    with pytest.raises(UpdatingError, match="no prior to strengthen"):
        tikhonov(replace(problem, unknowns=Unknowns.of([free(m, np.inf) for m in system.names])))
    with pytest.raises(UpdatingError, match="there are gcv"):
        tikhonov(problem, rule="eye")  # type: ignore[arg-type]


def test_a_quadratic_is_its_own_surface() -> None:
    def solve(x: np.ndarray) -> np.ndarray:
        return np.array([1 + x[0] + 0.5 * x[0] * x[1], x[1] - x[0] ** 2])

    unknowns = Unknowns.of([free(n, 1.0, (-2.0, 2.0)) for n in ("a", "b")])
    problem = Problem(
        unknowns, (Configuration("c", FunctionSystem(("a", "b"), solve), (Values("y", [1.2, 0.4], 0.1),)),)
    )
    surface = response_surface(problem)
    assert surface.error < 1e-9 * surface.spread
    assert repr(surface).startswith("quadratic surface of 2 residuals in a, b, from 12 points (0 failed): error ")
    p = np.array([0.3, -0.7])
    np.testing.assert_allclose(surface.residual(p)[0], problem.evaluate(p).residual, rtol=1e-9)
    start = surface.minimise()
    np.testing.assert_allclose(start, update(problem, start).p, atol=1e-4)
    with pytest.raises(UpdatingError, match="the quadratic has 6 terms"):
        response_surface(problem, 5)


def test_sobol_indices_of_a_sum_and_a_product() -> None:
    unknowns = Unknowns.of([free("a", 1.0), free("b", 2.0), free("c", 0.5)])
    eye = LinearSystem(np.eye(3))
    eye.names = ("a", "b", "c")
    problem = Problem(unknowns, (Configuration("c", eye, (Values("y", np.zeros(3), 1.0),)),))
    # a + b: variances 1 and 4; a c: no first order at all
    found = sobol(problem, lambda p: np.column_stack([p[:, 0] + p[:, 1], p[:, 0] * p[:, 2]]), 1024)
    np.testing.assert_allclose(found.first, [[0.2, 0.8, 0.0], [0.0, 0.0, 0.0]], atol=0.03)
    np.testing.assert_allclose(found.total, [[0.2, 0.8, 0.0], [1.0, 0.0, 1.0]], atol=0.06)
    assert found.n_solved == 1024 * 5
    assert [row.split()[0] for row in repr(found).splitlines()[2:]] == ["a", "b", "c"]
    # of both as one, variances 5 and 1/4
    alone, in_all = found.together(np.array([5.0, 0.25]))
    np.testing.assert_allclose(alone, np.array([1.0, 4.0, 0.0]) / 5.25, atol=0.03)
    np.testing.assert_allclose(in_all, np.array([1.25, 4.0, 0.25]) / 5.25, atol=0.06)
    with pytest.raises(UpdatingError, match="power of 2"):
        sobol(problem, lambda p: p, 1000)


def test_mean_and_scatter_of_a_population() -> None:
    rng = np.random.default_rng(2)
    mean, sd = np.array([0.4, -0.3]), np.array([0.30, 0.15])
    problems = []
    for _ in range(150):
        y = A @ (mean + sd * rng.standard_normal(2)) + 0.1 * rng.standard_normal(3)
        unknowns = Unknowns.of([free("x1", 1.0), free("x2", 1.0)])
        problems.append(Problem(unknowns, (Configuration("c", LinearSystem(A), (Values("y", y, 0.1),)),)))
    found = update_population(problems)
    assert found.converged
    # 150 structures: the mean to 1/12 of the scatter, the scatter to 6 %
    np.testing.assert_allclose((found.mean - mean) / found.mean_sd, 0.0, atol=3.0)
    np.testing.assert_allclose(found.sd, sd, rtol=0.2)
    np.testing.assert_allclose(found.mean_sd, np.hypot(sd, 0.08) / np.sqrt(150), rtol=0.25)
    with pytest.raises(UpdatingError, match="three or more"):
        update_population(problems[:2])


def test_many_starts_in_a_basis_end_in_one_place() -> None:
    matrices = chain()
    big = ModalSystem(matrices, np.eye(6), 5)
    problem = chain_problem(sd=np.inf)
    (c,) = problem.configurations
    problem = replace(problem, configurations=(replace(c, system=big),))
    small = reduced_problem(problem)
    assert small.error < 1e-3
    many = multi_start(problem, 12, small=small.problem)
    assert np.mean(np.abs(many.ends / TRUTH - 1).max(axis=1) < 1e-4) > 0.9
    assert len(many.minima[0].starts) >= 11
    assert repr(many).startswith(f"12 starts, {len(many.minima)} minima, 0 failed\nminimum 1: cost ")
    assert repr(many).endswith(repr(many.best))
    np.testing.assert_allclose(many.best.p, TRUTH, rtol=1e-5)


def test_a_system_that_configurations_share_is_solved_and_reduced_once() -> None:
    problem = chain_problem(sd=0.5)
    (c,) = problem.configurations
    big = ModalSystem(chain(), np.eye(6), 5)
    solved = []
    big.solve = lambda factors, own=big.solve: solved.append(1) or own(factors)  # type: ignore[method-assign]
    both = replace(problem, configurations=(replace(c, system=big), replace(c, name="again", system=big)))
    p = np.full(4, 1.1)
    states = both.states(p)
    assert len(solved) == 1
    assert states[0] is states[1]
    np.testing.assert_allclose(
        both.evaluate(p, slopes=True).jacobian, np.tile(problem.evaluate(p, slopes=True).jacobian, (2, 1)), atol=1e-6
    )
    small = reduced_problem(both).problem.configurations
    assert small[0].system is small[1].system
    # a link gives the second one factors of its own
    links = {c.system.names[0]: c.system.names[1]}
    other = replace(both, configurations=(both.configurations[0], replace(both.configurations[1], links=links)))
    solved.clear()
    other.states(np.array([1.0, 1.1, 1.0, 1.0]))
    assert len(solved) == 2


def test_a_basis_that_could_not_be_checked_is_not_called_good() -> None:
    def torn(factors: np.ndarray) -> State:
        raise UpdatingError("torn")

    problem = chain_problem(sd=0.5)
    (c,) = problem.configurations
    big = ModalSystem(chain(), np.eye(6), 5)
    problem = replace(problem, configurations=(replace(c, system=big),))
    assert reduced_problem(problem).error < 1e-3
    big.solve = torn  # type: ignore[method-assign]
    assert reduced_problem(problem).error == np.inf


def test_many_starts_tell_of_minima_and_failures() -> None:
    def solve(x: np.ndarray) -> np.ndarray:
        if x[0] > 1.8:
            raise UpdatingError("torn")
        return np.array([x[0] ** 2, 0.05 * x[0]])

    unknowns = Unknowns.of([free("x", np.inf, (-2.0, 2.0))])
    problem = Problem(unknowns, (Configuration("c", FunctionSystem(("x",), solve), (Values("y", [1.0, 0.05], 0.1),)),))
    many = multi_start(problem, starts=np.array([[-1.5], [0.6], [1.5], [1.9]]))
    assert [m.starts for m in many.minima] == [(2, 1), (0,)] or [m.starts for m in many.minima] == [(1, 2), (0,)]
    assert many.best.p[0] == pytest.approx(1.0, abs=1e-4)
    assert list(many.failures) == [3]
    assert np.isnan(many.ends[3, 0])
    with pytest.raises(UpdatingError, match="none of 1 starts"):
        multi_start(problem, starts=np.array([[1.9]]))


@pytest.mark.parametrize("reduced", [False, True])
def test_starts_that_are_stopped_give_what_those_before_gave(reduced: bool) -> None:
    problem = chain_problem(sd=0.5)
    small = reduced_problem(problem).problem if reduced else None
    starts = np.random.default_rng(2).uniform(0.7, 1.4, (5, 4))
    done: list[int] = []

    def told() -> None:
        done.append(1)
        if len(done) == 3:
            raise KeyboardInterrupt

    with pytest.raises(StartsInterrupted, match="interrupted after 3 of 5 starts") as stopped:
        multi_start(problem, starts=starts, small=small, told=told)
    assert len(done) == 3
    found, whole = stopped.value.found, multi_start(problem, starts=starts[:3], small=small, n_polished=1)
    np.testing.assert_array_equal(found.starts, starts[:3])
    np.testing.assert_allclose(found.ends, whole.ends, rtol=1e-9)
    assert found.best.problem is problem
    assert found.best.after.cost == pytest.approx(whole.best.after.cost, rel=1e-9)

    def at_once() -> None:
        raise KeyboardInterrupt

    # nothing is given back where nothing was found
    torn = Problem(problem.unknowns, problem.configurations)
    with pytest.raises(KeyboardInterrupt) as plain:
        multi_start(torn, starts=np.full((2, 4), np.nan), told=at_once)
    assert not isinstance(plain.value, StartsInterrupted)


def test_a_design_covers_values_and_priors() -> None:
    unknowns = Unknowns.of([factor("a", 0.1), factor("k", 1.0, (0.1, 10.0), logarithmic=True)])
    even = design(unknowns, 200)
    assert np.exp(even[:, 1]).mean() == pytest.approx(5.05, rel=0.02)
    prior = design(unknowns, 400, over="prior")
    assert prior[:, 0].std() == pytest.approx(0.1, rel=0.05)
    assert np.abs(prior[:, 1]).max() <= np.log(10.0)
    with pytest.raises(UpdatingError, match="neither bounds nor a prior"):
        design(Unknowns.of([factor("a", np.inf)]), 3)


def test_a_far_start_is_brought_home_by_order() -> None:
    problem = chain_problem(sd=np.inf, bounds=(0.02, 4.0))
    (c,) = problem.configurations
    freq, shapes = c.responses
    assert isinstance(freq, Frequencies)
    assert isinstance(shapes, ShapeDifferences)
    starts = np.random.default_rng(1).uniform(0.02, 4.0, (10, 4))
    many = multi_start(problem, starts=starts)
    assert np.mean(np.abs(many.ends / TRUTH - 1).max(axis=1) < 1e-3) >= 0.8
    assert c.test is not None
    assert ModeTest(c.test.freq).mates(c.system.solve(TRUTH)).mate.tolist() == [0, 1, 2, 3]
