"""Sensors, exciters and forecasts of a planned test against closed answers and exhaustive search."""

from __future__ import annotations

import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from femend import Dof
from femend.correlate import automac
from femend.errors import PretestError
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    ModeTest,
    Problem,
    ShapeDifferences,
    Unknowns,
    affine_matrices,
    factor,
    modal_system,
    update,
)
from femend.pretest import (
    distinguish,
    driving_point_residues,
    effective_independence,
    energy_fractions,
    exciters,
    iterative_guyan,
    mac_elimination,
    mass_loading,
    mode_indicator,
    parameter_sensors,
    planned_test,
    qr_placement,
    suspension_points,
    target_modes,
    virtual_test,
)

sys.path.insert(0, str(Path(__file__).parents[1]))
from updating_models import TRUTH, chain

RNG = np.random.default_rng(5)
PRIOR = Unknowns.of([factor(n, 0.2) for n in ("k1", "k2", "k3", "m")])


def beam_shapes(n: int = 40, m: int = 3) -> np.ndarray:
    """Sine modes of a simply supported beam at n inner points."""
    x = np.arange(1, n + 1) / (n + 1)
    return np.sin(np.pi * np.outer(x, np.arange(1, m + 1)))


def test_effective_independence_keeps_what_it_says() -> None:
    phi = RNG.standard_normal((30, 4))
    found = effective_independence(phi, 7)
    # the running determinant, kept by rank-one updates through 23 removals, is that of the rows left
    assert found.score[-1] == pytest.approx(np.linalg.slogdet(phi[found.rows].T @ phi[found.rows])[1], rel=1e-10)
    # each single removal was the best: with one row more, no other removal keeps a larger determinant
    before = effective_independence(phi, 8).rows
    dets = [np.linalg.det(phi[np.setdiff1d(before, r)].T @ phi[np.setdiff1d(before, r)]) for r in before]
    assert set(found.rows) == set(np.setdiff1d(before, before[int(np.argmax(dets))]))


def test_masks_and_placed_sensors_are_kept() -> None:
    phi = beam_shapes()
    K = np.diag(np.arange(1.0, 41))
    for choose in (effective_independence, mac_elimination, qr_placement):
        found = choose(phi, 5, allowed=np.arange(40) % 2 == 0, placed=[1])
        assert 1 in found.rows
        assert all(r % 2 == 0 or r == 1 for r in found.rows)
        assert len(found.rows) == 5
    found = iterative_guyan(K, np.eye(40), 5, allowed=range(0, 40, 2), placed=[39])
    assert found.rows.tolist() == [0, 2, 4, 6, 39]  # uncoupled: the lowest K/M stay


def test_noise_of_a_sensor_counts() -> None:
    phi = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert effective_independence(phi, 2, sd=[0.1, 1.0, 1.0]).rows.tolist() == [0, 2]
    assert effective_independence(phi, 2, sd=[1.0, 0.1, 1.0]).rows.tolist() == [1, 2]


def test_three_modes_of_a_beam_are_nearly_as_well_placed_as_by_all_triples() -> None:
    phi = beam_shapes(25)
    best = max(np.linalg.det(phi[list(c)]) ** 2 for c in combinations(range(25), 3))
    for choose in (effective_independence, qr_placement):
        rows = choose(phi, 3).rows
        assert np.linalg.det(phi[rows]) ** 2 > 0.9 * best


def test_mac_elimination_beats_nearly_all_sets() -> None:
    phi = RNG.standard_normal((12, 3))

    def off(rows: object) -> float:
        return float(np.max(automac(phi[list(rows)]) - np.eye(3)))  # type: ignore[call-overload]

    found = mac_elimination(phi, 5)
    assert found.score[-1] == pytest.approx(off(found.rows), abs=1e-12)
    every = np.array([off(c) for c in combinations(range(12), 5)])
    assert np.mean(every < found.score[-1]) < 0.02


def test_iterative_guyan_keeps_the_heavy_masses() -> None:
    # Penny, Friswell and Garvey's criterion: what moves with little mass on stiff springs goes first
    K = 2 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1)
    M = np.diag([1.0, 50, 1, 1, 60, 1, 1, 55])
    found = iterative_guyan(K, M, 3)
    assert found.rows.tolist() == [1, 4, 7]


def test_what_cannot_be_planned_is_said() -> None:
    phi = beam_shapes()
    with pytest.raises(PretestError, match="2 sensors cannot tell 3 target modes apart"):
        effective_independence(phi, 2)
    with pytest.raises(PretestError, match="do not tell"):
        effective_independence(np.ones((9, 2)), 3)
    with pytest.raises(PretestError, match="50 sensors are wanted"):
        qr_placement(phi, 50)
    with pytest.raises(PretestError, match="rows 0 to 39"):
        mac_elimination(phi, 4, placed=[99])
    with pytest.raises(PretestError, match="complex"):
        effective_independence(phi + 0j, 4)
    with pytest.raises(PretestError, match="no parameter 'q'"):
        planned_test(modal_system(chain(), [0], 3), Unknowns.of([factor("q")]))


def test_targets_by_mass_and_energy() -> None:
    found = target_modes([4, 9, 15, 30], np.array([[80, 0], [1, 0], [0, 9], [9, 0]]), 100.0, band=(0, 20),
                         energy=[0.0, 0.3, 0.0, 0.9])  # fmt: skip
    assert found.modes == (0, 1, 2)  # by X, by energy, by Y; the last is outside the band
    np.testing.assert_allclose(found.total, [0.81, 0.09])
    phi = RNG.standard_normal((5, 2))
    np.testing.assert_allclose(energy_fractions(phi, np.diag(range(1, 6))).sum(axis=0), 1.0)


def test_exciters_avoid_nodes() -> None:
    phi = beam_shapes(39)  # row 19 is the middle: a node of mode 2
    omega = np.array([1.0, 4.0, 9.0]) * 10
    np.testing.assert_allclose(driving_point_residues(phi, omega)[19], [0.5, 0.0, 0.5], atol=1e-15)
    assert mode_indicator(phi, omega, 0.01, [19])[1] == 1.0
    found = exciters(phi, omega, 1)
    assert found.indicator.max() < 0.01
    # the best place by the worst mode's residue, over all places
    every = (driving_point_residues(phi, omega) / driving_point_residues(phi, omega).max(axis=0)).min(axis=1)
    assert found.excitation.min() == pytest.approx(every.max())
    # two modes at nearly one frequency: one exciter finds one dip, two find both
    close = np.array([40.0, 40.02, 90.0])
    assert exciters(phi, close, 2).indicator.max() < 0.05
    assert suspension_points(phi[:, 1:2], 1) == (19,)


def test_exciters_drive_before_they_tell_modes_apart() -> None:
    """Row 1 hardly moves, but alike in both modes, so its indicators are the best; rows 0 and 2 hide one mode."""
    phi = np.array([[1.0, 0.05], [1e-3, 1e-3], [0.06, 1.0]])
    omega = np.array([10.0, 10.5])
    indicators = np.array([mode_indicator(phi, omega, 0.01, [r]) for r in range(3)])
    assert (indicators.max(axis=1) > 0.3).tolist() == [True, False, True]
    found = exciters(phi, omega, 1)
    assert found.rows == (2,)
    assert found.excitation.min() == pytest.approx(0.06**2)
    # two exciters at the modes' antinodes do both
    both = exciters(phi, omega, 2)
    assert set(both.rows) == {0, 2}
    assert both.indicator.max() < 0.3
    # a place that moves nearly as well as the best, and shows both modes, is taken for its indicators
    nearly = np.vstack([phi, [[0.045, 0.045]]])
    assert exciters(nearly, omega, 1).rows == (3,)
    # so is one that moves enough, however much better another drives the worst mode
    driven = np.array([[1.0, 0.2], [0.16, 0.16], [0.2, 1.0]])
    close = np.array([10.0, 10.2])
    assert mode_indicator(driven, close, 0.01, [0]).max() > 0.3
    assert exciters(driven, close, 1).rows == (1,)
    with pytest.raises(PretestError, match=r"residue_min 2 is not from 0 to 1"):
        exciters(phi, omega, 1, residue_min=2.0)


def test_exciters_drive_most_modes_where_axes_do_not_couple() -> None:
    """Rows 0 to 4 move in modes 1, 2 and 4 alone, rows 5 to 9 in 3 and 5: no row drives all, and rounding decided."""
    x = np.linspace(0.2, 1.0, 5)
    phi = np.zeros((10, 5))
    phi[:5, [0, 1, 3]] = np.column_stack([x**2, x**2 * (1.5 * x - 1), x**2 * (x - 0.5)])
    phi[5:, [2, 4]] = np.column_stack([x**2, x**2 * (x - 0.7)])
    phi += 1e-12 * np.array([1, 2, 3, 4, 1, 9, 5, 5, 5, 1])[:, None]
    omega = np.array([10.0, 30.0, 40.0, 90.0, 130.0])
    one = exciters(phi, omega, 1)
    assert one.rows == (4,)  # the tip along the axis in which three modes move
    both = exciters(phi, omega, 2)
    assert both.rows == (4, 9)
    assert both.excitation.min() == pytest.approx(1.0)


def test_sensor_mass_is_exact_with_all_modes() -> None:
    from scipy.linalg import eigh

    system = chain()
    k = np.zeros((6, 6))
    m = np.zeros((6, 6))
    cols = np.repeat(np.arange(6), np.diff(system.indptr))
    k[system.indices, cols], m[system.indices, cols] = system.at(np.ones(4))
    lam, phi = eigh(k, m)
    loaded = mass_loading(phi, np.sqrt(lam) / 2 / np.pi, [1, 4], [0.02, 0.3])
    direct = eigh(k, m + np.diag([0, 0.02, 0, 0, 0.3, 0]), eigvals_only=True)
    np.testing.assert_allclose(loaded.freq, np.sqrt(direct) / 2 / np.pi, rtol=1e-10)
    tiny = mass_loading(phi, np.sqrt(lam) / 2 / np.pi, [1], [1e-6])
    np.testing.assert_allclose(tiny.shift, -0.5e-6 * phi[1] ** 2, rtol=1e-3, atol=1e-12)


def plan_of_chain(shape_sd: float = 0.02, freq_sd: float = 0.002):  # type: ignore[no-untyped-def]
    system = modal_system(chain(), list(range(6)), 6)
    return planned_test(system, PRIOR, modes=range(4), freq_sd=freq_sd, shape_sd=shape_sd)


def test_forecast_is_the_covariance_of_the_updating() -> None:
    """The plan's information and the Laplace covariance of updating on clean data of the same test are one matrix."""
    rows = [0, 2, 5]
    plan = plan_of_chain()
    system = modal_system(chain(), rows, 6)
    state = system.solve(np.ones(4))
    freq, phi = state.value("freq")[:4], state.value("phi")[:, :4]
    largest = np.abs(modal_system(chain(), list(range(6)), 6).solve(np.ones(4)).value("phi")[:, :4]).max(axis=0)
    responses = (Frequencies(freq, 0.002 * freq), ShapeDifferences(phi, np.tile(0.02 * largest, (3, 1))))
    problem = Problem(PRIOR, (Configuration("c", system, responses, ModeTest(freq, phi)),))
    J = problem.evaluate(PRIOR.mean, slopes=True).jacobian
    assert J is not None
    # the scale's prior of e^10 is all that differs
    np.testing.assert_allclose(plan.covariance(rows), np.linalg.inv(J.T @ J + PRIOR.precision), rtol=1e-3)


def test_forecast_is_right_on_simulated_tests() -> None:
    """Structures drawn from the prior, tested with noise and updated: errors are as large as foretold."""
    rows = [1, 3, 5]
    prior = Unknowns.of([factor(n, 0.05) for n in ("k1", "k2", "k3", "m")])
    full = modal_system(chain(), list(range(6)), 6)
    plan = planned_test(full, prior, modes=range(3), freq_sd=0.01, shape_sd=0.02)
    foretold = plan.forecast(rows)
    rng = np.random.default_rng(8)
    system, errors = modal_system(chain(), rows, 6), []
    for _ in range(25):
        truth = 1 + 0.05 * rng.standard_normal(4)
        state = full.solve(truth)
        freq, phi = state.value("freq")[:3], state.value("phi")[:, :3]
        sd = np.tile(0.02 * np.abs(phi).max(axis=0), (3, 1))
        f = freq * (1 + 0.01 * rng.standard_normal(3))
        y = phi[rows] + sd * rng.standard_normal((3, 3))
        test = Configuration("c", system, (Frequencies(f, 0.01 * f), ShapeDifferences(y, sd)), ModeTest(f, y))
        errors.append(update(Problem(prior, (test,))).p - truth)
    ratio = np.std(errors, axis=0) / [r.expected_sd for r in foretold]
    # a standard deviation of 25 draws is known to 14 %: three of these
    assert np.abs(ratio - 1).max() < 0.42
    told = {r.name for r in foretold if r.determined}
    learned = 1 - (np.std(errors, axis=0) / 0.05) ** 2
    clear = np.abs(np.array([r.learned for r in foretold]) - 0.5) > 0.2
    assert clear.any()
    for name, share, sure in zip(prior.names, learned, clear, strict=True):
        assert not sure or (share > 0.5) == (name in told)


def test_parameter_sensors_are_the_best_of_all_sets() -> None:
    plan = plan_of_chain(freq_sd=0.02)
    found = parameter_sensors(plan, 3)
    every = [plan.variance_left(c) for c in combinations(range(6), 3)]
    assert plan.variance_left(found.rows) == pytest.approx(min(every))
    assert found.score[-1] == pytest.approx(min(every))
    assert parameter_sensors(plan, 3, placed=[0]).rows[0] == 0


def test_parameters_that_act_alike_are_told() -> None:
    parts = {"a": np.diag([1.0, 0.0]), "b": np.diag([1.0, 0.0]), "c": np.array([[1.0, -1.0], [-1.0, 1.0]])}
    system = modal_system(affine_matrices(parts, np.eye(2)), [0, 1], 2)
    unknowns = Unknowns.of([factor(n, 0.1) for n in "abc"])
    plan = planned_test(system, unknowns, freq_sd=5e-4, shape_sd=0.005)
    (group,) = plan.collinear([0, 1])
    assert set(group.names) == {"a", "b"}
    pairs = {(d.truth, d.rival): d for d in distinguish(plan, [0, 1], ["a", "b", "c"])}
    assert not pairs["a", "b"].told
    assert pairs["a", "b"].distance < 1e-3
    assert pairs["a", "c"].told
    # by hand: the misfit left when b and c are free is that of the projected columns
    F = plan.information([0, 1], prior=False)
    expected = 0.1 * np.sqrt(F[0, 0] - F[0, 2] ** 2 / F[2, 2])
    assert pairs["a", "c"].distance == pytest.approx(expected, rel=1e-9)


def test_virtual_test_finds_modes_and_parameters() -> None:
    system = modal_system(chain(), list(range(6)), 6)
    sensors = [Dof(i + 1, 1) for i in range(6)]
    f = system.solve(TRUTH).value("freq")
    lines = np.arange(0.5, 1.1 * f[3], 0.01)
    done = virtual_test(system, PRIOR, TRUTH, sensors, [5], lines, noise=0.002)
    assert done.found == (0, 1, 2, 3)
    assert done.missed == ()
    assert done.result is not None
    for row, truth, inside in done.parameters():
        assert inside, row.name
        assert row.value == pytest.approx(truth, rel=0.02)


def test_a_mode_that_the_exciter_does_not_drive_is_missed() -> None:
    k = {"k": np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]]) * 1e3}
    system = modal_system(affine_matrices(k, np.eye(3)), [0, 1, 2], 3)
    sensors = [Dof(i + 1, 1) for i in range(3)]
    done = virtual_test(system, Unknowns.of([factor("k", 0.1)]), [1.1], sensors, [1], np.arange(2, 12, 0.02))
    assert 1 in done.missed  # the second mode has a node in the middle
    assert {0, 2} <= set(done.found)
