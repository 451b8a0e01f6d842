"""Scatter of members and masses as unknowns: nothing at their means, and one member's error where it is asked for."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

from femend.diagnose.locating.joint import enlarged, open_joint
from femend.estimate import Problem
from femend.model import FormErrors, ReducedModel, find_places, form_errors, read_model, reduce_model
from femend.model.mesh.form_errors import SD
from femend.model.mesh.scatter import GYRATION, LUMP_SD, MASS_SD, STIFFNESS_SD, SUPPORT_SD, Unit
from femend.model.reduced.reduction import extend_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

sys.path.insert(0, str(Path(__file__).parent))
from test_refined import shells

form_errors_module = import_module("femend.model.mesh.form_errors")  # the package has a function of that name

FloatArray = NDArray[np.float64]

F_MAX = 150.0


@pytest.fixture
def reduced(tmp_path: Path) -> ReducedModel:
    (tmp_path / "model.bdf").write_text(small_study.deck())
    model = read_model(tmp_path / "model.bdf", parameters=small_study.PARAMETERS)
    return reduce_model(model, F_MAX, [6 * model.index(13) + 2])


def at(reduced: ReducedModel, p: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """K and M of a reduced model at its unknowns."""
    K, M = reduced.K_fixed.copy(), reduced.M_fixed.copy()
    for term in reduced.terms:
        scale = float(np.exp(sum(power * p[i] for i, power in term.exponents)))
        K += 0 if term.K is None else scale * term.K
        M += 0 if term.M is None else scale * term.M
    return K, M


def test_nothing_changes_at_the_means(reduced: ReducedModel) -> None:
    with_errors = form_errors(reduced, F_MAX).on(reduced)
    added = len(with_errors.names) - len(reduced.names)
    assert added >= 2
    assert np.all(with_errors.prior_sd[-added:] == SD)
    n = len(reduced.names)
    for found, expected in zip(at(with_errors, np.zeros(n + added)), at(reduced, np.zeros(n)), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    bare = with_errors.bare()
    assert bare.names == reduced.names
    p = np.array([0.1, -0.2])
    for found, expected in zip(at(bare, p), at(reduced, p), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def moved(reduced: ReducedModel, unit: Unit, stiff: float, mass: float) -> FloatArray:
    """Relative changes of the frequencies (r,) where a unit's elements have so much more stiffness and mass."""
    K, M = at(reduced, np.zeros(len(reduced.names)))
    omega0 = np.sqrt(eigh(K, M, eigvals_only=True))
    for eid in unit.elements:
        rows, Ke, Me = reduced.model.fe.element_matrices(eid, np.ones(len(reduced.model.parameters)))
        K = K + stiff * reduced.V[rows].T @ Ke @ reduced.V[rows]
        M = M + mass * reduced.V[rows].T @ Me @ reduced.V[rows]
    return np.asarray(np.sqrt(eigh(K, M, eigvals_only=True)) / omega0 - 1)


def carried(reduced: ReducedModel, errors: FormErrors, unit: int) -> FloatArray:
    """The same by the combinations that are kept, of one standard deviation of unit `unit`."""
    with_errors = errors.on(reduced)
    omega0 = np.sqrt(eigh(*at(reduced, np.zeros(len(reduced.names))), eigvals_only=True))
    p = np.concatenate([np.zeros(len(reduced.names)), SD * errors.weights[:, unit]])
    return np.asarray(np.sqrt(eigh(*at(with_errors, p), eigvals_only=True)) / omega0 - 1)


def test_one_member_off_moves_the_modes_as_it_does_itself(reduced: ReducedModel) -> None:
    """The combinations kept carry a member's error into the band's frequencies to a twentieth of it; its section takes
    stiffness and mass along."""
    errors = form_errors(reduced, F_MAX)
    unit = next(i for i, u in enumerate(errors.units) if u.stiffness.nnz > 0)
    expected = moved(reduced, errors.units[unit], STIFFNESS_SD, MASS_SD)
    band = reduced.freq < F_MAX
    found = carried(reduced, errors, unit)
    np.testing.assert_allclose(found[band], expected[band], rtol=0, atol=0.05 * np.abs(expected[band]).max())
    assert np.abs(expected[band]).max() > 1e-4


def test_stiffness_and_mass_of_a_patch_are_off_each_by_itself(tmp_path: Path) -> None:
    model = read_model(shells(tmp_path / "plate.bdf"))
    plate = reduce_model(model, 300.0, [6 * model.index(5) + 2])
    units = [u for u in form_errors(plate, 300.0).units if u.sd != SUPPORT_SD]
    stiff = {u.elements for u in units if u.stiffness.nnz}
    assert stiff
    assert stiff == {u.elements for u in units if u.mass.nnz}
    assert not [u for u in units if u.stiffness.nnz and u.mass.nnz]
    unit = next(u for u in units if u.mass.nnz)
    assert unit.sd == 0
    V, ones = plate.V, np.ones(len(model.parameters))
    expected = np.zeros((V.shape[1], V.shape[1]))
    for eid in unit.elements:
        rows, _, M = model.fe.element_matrices(eid, ones)
        expected += MASS_SD * V[rows].T @ M @ V[rows]
    found = V[unit.rows].T @ (unit.mass @ V[unit.rows])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_errors_in_a_wider_basis_are_those_of_the_one_within(reduced: ReducedModel) -> None:
    errors = form_errors(reduced, F_MAX)
    errors = replace(errors, mesh=F_MAX)
    within = errors.on(reduced)
    loads = np.random.default_rng(0).standard_normal((reduced.model.fe.n_a, 3))
    wider = extend_model(within.bare(), loads)
    assert wider.r == within.r + 3
    whole, known = errors.on(wider), errors.on(wider, within)
    assert known.names == whole.names
    p = whole.prior_sd * np.random.default_rng(1).standard_normal(len(whole.names))
    for found, expected in zip(at(known, p), at(whole, p), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_a_problem_takes_the_errors_with_their_prior(reduced: ReducedModel) -> None:
    with_errors = form_errors(reduced, F_MAX).on(reduced)
    problem = Problem([], (8.0, F_MAX), small_study.ZETA, 2)
    mean, sd = problem.prior(with_errors)
    n = len(with_errors.names)
    assert np.all(mean[: n + 2] == 0)
    assert np.all(sd[len(reduced.names) : n] == SD)
    assert problem.system(with_errors).modal(mean)[0].shape == (with_errors.r,)


def test_a_lump_without_inertia_may_turn(reduced: ReducedModel) -> None:
    """A mass given as a point has a radius of gyration in reality: its rotations get inertia, its mass scatters."""
    units = form_errors(reduced, F_MAX).units
    lumps = [u for u in units if u.turns]
    assert lumps
    model = reduced.model
    diagonal = float(np.linalg.norm(np.ptp(model.xyz, axis=0)))
    for unit in lumps:
        rows, _, M = model.fe.element_matrices(unit.elements[0], np.ones(len(model.parameters)))
        first = 6 * int(rows[0] // 6)
        np.testing.assert_array_equal(unit.rows, first + np.arange(6))
        off = unit.mass.toarray()
        np.testing.assert_allclose(np.diag(off)[:3], LUMP_SD * np.diag(M)[:3])
        np.testing.assert_allclose(np.diag(off)[3:], M[0, 0] * (GYRATION * diagonal) ** 2)


def test_a_cut_takes_no_more_than_a_softer_element_has(reduced: ReducedModel) -> None:
    """With a member far softer than drawn, cutting its end leaves it a mechanism at most: no negative stiffness."""
    errors = form_errors(reduced, F_MAX)
    model = reduced.model
    place = next(p for p in find_places(model) if p.kind == "clamp" and p.direction == "RY")
    unit = next(i for i, u in enumerate(errors.units) if place.elements[0] in u.elements)
    joint = open_joint(place, errors.on(reduced), F_MAX, [6 * model.index(13) + 2])
    p = np.zeros(len(joint.reduced.names))
    own = len(reduced.names)
    direction = errors.weights[:, unit]
    # a combination of errors by which the member has lost a tenth of its stiffness
    p[own : own + len(direction)] = np.log1p(-0.1 * SD / STIFFNESS_SD * direction / (direction @ direction))
    K, M = at(joint.reduced, p)
    lowest = eigh(K, M, eigvals_only=True)[0]
    highest = (2 * np.pi * F_MAX) ** 2
    assert lowest > -1e-6 * highest
    # without the errors' share the cut takes more than there is
    taken = place.w(joint.reduced.V, joint.reduced.V_a)
    assert eigh(K - 0.1 * taken.T @ taken / place.release[0, 0], M, eigvals_only=True)[0] < -1e-6 * highest


@pytest.mark.parametrize("large", [False, True])
def test_a_softer_member_that_is_cut_leaves_no_spring_in_the_cut(
    reduced: ReducedModel, monkeypatch: pytest.MonkeyPatch, large: bool
) -> None:
    """A cantilever with a hinge at its clamp swings as freely where it lacks a tenth of its stiffness."""
    if large:
        monkeypatch.setattr(form_errors_module, "LARGE", 1)
    errors = form_errors(reduced, F_MAX)
    model = reduced.model
    place = next(p for p in find_places(model) if p.kind == "clamp" and p.direction == "RY")
    unit = next(i for i, u in enumerate(errors.units) if place.elements[0] in u.elements)
    joint = open_joint(place, errors.on(reduced), F_MAX, [6 * model.index(13) + 2])
    own = len(reduced.names)
    direction = errors.weights[:, unit]
    p = np.zeros(len(joint.reduced.names))
    K, M = at(joint.reduced, p)
    swings = eigh(K, M)[1][:, 0]
    p[own : own + len(direction)] = np.log1p(-0.1 * SD / STIFFNESS_SD * direction / (direction @ direction))
    spring = swings @ (at(joint.reduced, p)[0] - K) @ swings / float((joint.w @ swings)[0]) ** 2
    assert abs(spring) < 0.01 * 0.1 * place.release[0, 0]


def test_a_cut_held_as_stiff_as_its_element_is_as_the_structure_stands(reduced: ReducedModel) -> None:
    """Whatever parameters and members' errors make of the element that is cut: rigid is rigid."""
    errors = form_errors(reduced, F_MAX)
    model = reduced.model
    place = next(p for p in find_places(model) if p.kind == "clamp" and p.direction == "RY")
    assert place.parameter is not None
    joint = open_joint(place, errors.on(reduced), F_MAX, [6 * model.index(13) + 2])
    whole = enlarged([place], errors.on(reduced), F_MAX, [6 * model.index(13) + 2])
    whole = errors.in_all_shapes(whole, place.elements)
    p = 0.1 * np.random.default_rng(2).standard_normal(len(whole.names))
    p[place.parameter] = 0.2
    for opened in (joint, joint.held_by(np.array([0.3 * place.release[0, 0]]))):
        softer = opened.at(p)
        rigid = softer.w.T @ (softer.w / softer.compliance[:, None])
        found, (expected, _) = at(softer.reduced, p)[0] + rigid, at(whole, p)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
        assert np.abs(
            at(opened.reduced, p)[0] + opened.w.T @ (opened.w / opened.compliance[:, None]) - expected
        ).max() > (1e-3 * np.abs(expected).max())


def test_of_many_units_the_strongest_combinations_are_those_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    effects = np.random.default_rng(0).standard_normal((60, 200)) * np.geomspace(1, 1e-3, 60)[:, None]
    U, s = form_errors_module._strongest(effects)
    monkeypatch.setattr(form_errors_module, "MANY", 10)
    few, values = form_errors_module._strongest(effects)
    np.testing.assert_allclose(values, s[: len(values)], rtol=1e-9)
    np.testing.assert_allclose(np.abs(few.T @ U[:, : len(values)]), np.eye(len(values)), atol=1e-7)


def test_units_are_combined_the_same_some_at_a_time(reduced: ReducedModel, monkeypatch: pytest.MonkeyPatch) -> None:
    errors = form_errors(reduced, F_MAX)
    whole = form_errors_module._combined(reduced, errors.units, errors.weights)
    monkeypatch.setattr(form_errors_module, "AT_ONCE", 1.0)
    for (K, M), (k, m) in zip(whole, form_errors_module._combined(reduced, errors.units, errors.weights), strict=True):
        np.testing.assert_allclose(k, K, rtol=1e-9, atol=1e-12 * np.abs(K).max())
        np.testing.assert_allclose(m, M, rtol=1e-9, atol=1e-12 * np.abs(M).max())


def tower(path: Path) -> ReducedModel:
    """Two storeys of slender legs, one bar each, with rods between them and lumps on top, up to 200 Hz."""
    corners = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.32), (0.0, 0.32)]
    cards = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1", "MAT1,1,7.+10,,0.33,2700."]
    cards += ["MAT1,2,2.1+11,,0.3,7850.", "PBAR,1,1,1.1-4,4.6-9,4.6-9,9.3-9", "PROD,2,2,2.8-5,1.3-10"]
    cards += [f"GRID,{10 * s + c},,{x},{y},{0.45 * s}" for s in range(3) for c, (x, y) in enumerate(corners, 1)]
    for s in (0, 1):
        for c in range(1, 5):
            low, up, beside = 10 * s + c, 10 * s + 10 + c, 10 * s + 10 + c % 4 + 1
            cards += [f"CBAR,{100 + low},1,{low},{up},1.,0.,0.", f"CROD,{200 + low},2,{up},{beside}"]
            cards += [f"CROD,{300 + low},2,{low},{beside}", f"CONM2,{400 + up},{up},,0.5"]
        cards += [f"CROD,{500 + s},2,{10 * s + 11},{10 * s + 13}"]
    path.write_text("\n".join([*cards, "SPC1,1,123456,1,THRU,4", "ENDDATA", ""]))
    model = read_model(path)
    return reduce_model(model, 200.0, [6 * model.index(21)])


def lightest(reduced: ReducedModel) -> float:
    """Smallest eigenvalue of the mass that 400 draws of all errors leave, of each up to three deviations."""
    with_errors = form_errors(reduced, 200.0).on(reduced)
    n, own = len(with_errors.names), len(reduced.names)
    draws = np.random.default_rng(1).normal(0.0, SD, (400, n))
    draws[:, :own] = 0.0
    return float(min(np.linalg.eigvalsh(at(with_errors, np.clip(p, -3 * SD, 3 * SD))[1])[0] for p in draws))


def test_lumps_that_turn_never_take_the_mass_of_slender_members(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fits of a truss with one bar a storey did not move from the deck's values."""
    reduced = tower(tmp_path / "tower.bdf")
    assert lightest(reduced) > 0.0
    monkeypatch.setattr(form_errors_module, "LEAVES", np.inf)
    assert lightest(reduced) < 0.0
