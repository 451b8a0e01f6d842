"""The examples of updating: a footbridge, two shear frames, a concrete frame, and CalculiX in the loop."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from femend.errors import UpdatingError
from femend.estimate.updating import Problem, UpdateResult, limits, modal_system, sample, update


def test_footbridge_from_its_nominal_model(script: Callable[[str], ModuleType], shared: Callable[[str], Path]) -> None:
    example = script("footbridge")
    problem = example.authors_problem(shared("data/pedestrian_bridge"))
    found = update(problem, tolerance=1e-4)
    notes = [n for i in found.history for n in i.notes]
    assert any("test mode 1 paired with model mode 1, before with 2" in n for n in notes), notes
    assert found.unpaired() == []
    after = np.array([m.freq_after for m in found.modes()])
    # where the authors' optimum is to the digits they print, but for mode 5, whose weight is smallest
    np.testing.assert_allclose(after[:4], example.PUBLISHED[:4], atol=0.002)
    assert found.values["y1"] == pytest.approx(0.28, abs=0.02)
    # the minimum that is next; the lowest is 0.6 % below it (the slow test)
    assert found.after.cost < 2.15


@pytest.mark.slow
def test_footbridge_from_many_starts(script: Callable[[str], ModuleType], shared: Callable[[str], Path]) -> None:
    example = script("footbridge")
    runs = example.run(shared("data/pedestrian_bridge"))
    # the authors' own optimum has 2.1388 in this objective
    assert runs.score(runs.authors) <= 2.1388
    errors = [abs(m.freq_after / m.freq - 1) for m in runs.tight.modes()]
    assert max(errors) < 0.005
    assert runs.tight.left_prior() == []
    assert {"Frame", "y1", "y2"} <= set(runs.tight.determined())


def test_four_storeys_and_the_whole_posterior(
    script: Callable[[str], ModuleType], shared: Callable[[str], Path]
) -> None:
    example = script("shear_frames")
    problem = example.four_storeys(shared("data/shear_frames"))
    found = update(problem)
    assert max(abs(m.freq_after / m.freq - 1) for m in found.modes()) < 0.01
    assert found.left_prior() == []
    drawn = sample(problem, 120)
    sd = np.sqrt(np.diag(found.covariance))
    # 120 draws: a mean to 0.09 deviations, a deviation to 7 %; three of those standard errors
    np.testing.assert_allclose((drawn.mean - found.p) / sd, 0.0, atol=0.3)
    np.testing.assert_allclose(np.sqrt(np.diag(drawn.covariance)) / sd, 1.0, atol=0.25)


def test_eighteen_storeys(script: Callable[[str], ModuleType], shared: Callable[[str], Path]) -> None:
    example = script("shear_frames")
    folder = shared("data/shear_frames")
    wide = update(example.eighteen_storeys(folder, 3, example.WIDE))
    assert max(abs(m.freq_after / m.freq - 1) for m in wide.modes()) < 0.01
    assert wide.left_prior() == []
    narrow = update(example.eighteen_storeys(folder, 3))
    # the two modes that the authors take are met within their 30 %
    two = update(example.eighteen_storeys(folder, freq_sd=example.CLOSER_SD))
    assert max(abs(m.freq_after / m.freq - 1) for m in two.modes()) < 0.005
    assert min(m.mac_after for m in two.modes()) > 0.99
    assert two.left_prior() == []
    # all three cannot be, and the run says where it hurts
    assert 0.055 < example.least_error(example.eighteen_storeys(folder, 3), 2) < 0.06
    assert narrow.status == "at bound"
    assert narrow.modes()[2].freq_after / narrow.modes()[2].freq < 0.97


def chain_of_draws(problem: Problem, start: UpdateResult, n: int, seed: int) -> np.ndarray:
    """A plain random walk of `n` steps in the posterior, which has nothing in common with `sample`."""
    rng = np.random.default_rng(seed)
    lower, upper = limits(problem.unknowns)
    L = 1.9 / np.sqrt(start.p.size) * np.linalg.cholesky(start.covariance)
    every = tuple(None if c.test is None else np.ones(c.test.freq.size, dtype=bool) for c in problem.configurations)
    p, cost, kept = start.p, problem.evaluate(start.p, active=every).cost, []
    for k in range(n):
        q = p + L @ rng.standard_normal(p.size)
        if np.all((q >= lower) & (q <= upper)):
            there = problem.evaluate(q, active=every).cost
            if np.log(rng.random()) < 0.5 * (cost - there):
                p, cost = q, there
        if k >= n // 20 and k % 20 == 0:
            kept.append(p)
    return np.array(kept)


@pytest.mark.slow
def test_eighteen_storeys_and_the_whole_posterior(
    script: Callable[[str], ModuleType], shared: Callable[[str], Path]
) -> None:
    """Three modes at six floors tell few of 18 factors: their posterior is cut off at the bounds and no bell. Draws are
    those of a long chain; Laplace's deviations are too large, but it tells what was measured as well as the draws do.
    """
    example = script("shear_frames")
    problem = example.eighteen_storeys(shared("data/shear_frames"), 3, example.WIDE)
    found = update(problem)
    sd = np.sqrt(np.diag(found.covariance))
    drawn = sample(problem, 300)
    assert drawn.advice == ""
    chain = chain_of_draws(problem, found, 120_000, 11)
    # 300 draws: a mean to 0.06 deviations, the chain, whose steps depend on each other for hundreds, to 0.1
    np.testing.assert_allclose((drawn.mean - chain.mean(axis=0)) / sd, 0.0, atol=0.35)
    ratio = np.sqrt(np.diag(drawn.covariance)) / chain.std(axis=0)
    np.testing.assert_allclose(ratio, 1.0, atol=0.3)
    narrower = chain.std(axis=0) / sd
    assert narrower.max() < 1.1
    assert np.count_nonzero(narrower < 0.8) >= 9
    # frequencies in deviations of the test: by the draws, and by Laplace to first order
    (c,) = problem.configurations
    assert c.test is not None
    unit = example.FREQUENCY_SD * c.test.freq
    freq = np.array([c.system.solve(problem.factors(p, 0)).value("freq")[:3] for p in drawn.p])
    state = found.after.states[0]
    slope = state.slope("freq")[:, :3] * np.exp(found.p)[:, None]
    first_order = np.sqrt(np.diag(slope.T @ found.covariance @ slope))
    np.testing.assert_allclose(freq.mean(axis=0) / unit, state.value("freq")[:3] / unit, atol=0.3)
    np.testing.assert_allclose(freq.std(axis=0) / first_order, 1.0, atol=0.15)


@pytest.mark.slow
def test_eighteen_storeys_that_six_modes_tell_of(script: Callable[[str], ModuleType]) -> None:
    """The same frame with six modes at all floors tells of every factor: there draws and Laplace say the same."""
    example = script("shear_frames")
    rng = np.random.default_rng(18)
    truth, n_modes, rows = np.exp(0.2 * rng.standard_normal(18)), 6, list(range(18))
    matrices = example.chain(example.LARGE_STIFFNESS, example.LARGE_WEIGHT / 9.8)
    state = modal_system(matrices, rows, n_modes).solve(truth)
    phi = state.value("phi") / np.abs(state.value("phi")).max(axis=0)
    freq = state.value("freq") * (1 + example.FREQUENCY_SD * rng.standard_normal(n_modes))
    phi = phi + example.SHAPE_SD * rng.standard_normal(phi.shape)
    problem = example.problem("18 storeys, simulated", matrices, rows, (freq, phi), example.WIDE)
    found = update(problem)
    sd = np.sqrt(np.diag(found.covariance))
    assert min(r.learned for r in found.parameters()) > 0.9
    assert np.abs((found.p - np.log(truth)) / sd).max() < 3.5
    drawn = sample(problem, 300)
    # three standard errors of 300 draws, 0.06 of a mean and 4 % of a deviation, widened for what moves leave
    np.testing.assert_allclose((drawn.mean - found.p) / sd, 0.0, atol=0.3)
    np.testing.assert_allclose(np.sqrt(np.diag(drawn.covariance)) / sd, 1.0, atol=0.2)
    # Laplace's prior reaches beyond the bounds at two deviations, that of the draws does not: 18 ln 0.9545
    inside = 18 * np.log(0.9545)
    assert drawn.log_evidence == pytest.approx(found.log_evidence - inside, abs=4 * drawn.log_evidence_se)


def recovered(script: Callable[[str], ModuleType], n_starts: int) -> tuple[float, float]:
    example = script("building_frame/building_frame")
    found = example.recover(n_starts=n_starts)
    return float(np.mean(found.error <= 1e-3)), found.seconds


def test_the_concrete_frame_from_a_few_starts(project_root: Path, script: Callable[[str], ModuleType]) -> None:
    example = script("building_frame/building_frame")
    folder = project_root / "python" / "examples" / "building_frame"
    assert (folder / "model.bdf").read_text(encoding="ascii") == example.make_model.deck()
    assert len(set(example.make_model.sensors())) == 43
    with pytest.raises(UpdatingError, match="6 paired values and 0 priors for 12 unknowns"):
        update(example.twin("MAC"))
    share, _ = recovered(script, 8)
    assert share >= 7 / 8


@pytest.mark.slow
def test_the_concrete_frame_from_a_hundred_starts(script: Callable[[str], ModuleType]) -> None:
    share, seconds = recovered(script, 100)
    assert share >= 0.99
    assert seconds < 60


def test_calculix_in_the_loop(
    script: Callable[[str], ModuleType], program: Callable[[str], str], tmp_path: Path
) -> None:
    example = script("external_solver/external_solver")
    one, two, n_runs, _ = example.both(tmp_path, program("ccx"))
    assert n_runs > 10
    for name, value in one.values.items():
        assert two.values[name] == pytest.approx(value, rel=0.01)
    # what was put in lies within three deviations
    for name, truth in zip(example.NAMES, example.TRUTH, strict=True):
        assert abs(one.values[name] - truth) < 3 * one.sd[name]
    again = example.both(tmp_path, program("ccx"))
    assert again[2] == 0, "a run that was finished is not made again"
