"""The catalogue of physics against the core's library, and its maps and start values."""

from __future__ import annotations

import doctest
import re
from importlib import import_module

import numpy as np
import pytest

from femend import _core
from femend.errors import LawParameterError
from femend.physics import (
    CATALOGUE,
    FAMILIES,
    FitCoordinates,
    Physics,
    catalogue,
    companion_jacobian,
    linear_sizes,
    physics,
    selected,
    shapes,
    simpler,
    with_companion,
)
from femend.units import parse_unit, unit_system

VALUES = {
    "support_stiffness": {"k": -3e4},
    "compliant_support": {"k": 3e4},
    "joint_stiffness": {"k": 3e4},
    "spring_bending": {"k": 3e2},
    "added_mass": {"m": 0.4},
    "tuned_absorber": {"m": 0.2, "k": 4e3, "c": 1.5},
    "viscous_damper": {"c": 30.0},
    "structural_damping": {"k": 2e4, "eta": 0.1},
    "viscoelastic": {"k0": 2e3, "k1": 8e3, "tau": 0.004},
    "quadratic_damping": {"c": 80.0},
    "cubic_stiffness": {"k3": -3e8},
    "quadratic_stiffness": {"k2": 1e6},
    "clearance": {"k": 3e4, "gap": 1e-3, "sides": 2.0},
    "bilinear_stiffness": {"k_plus": 1e4, "k_minus": 3e3},
    "coulomb_friction": {"f": 8.0, "kt": 2e4},
    "bouc_wen": {"k": 2e4, "alpha": 0.2, "n": 1.6, "beta": 3e4, "gamma": 1e4},
    "generalised_maxwell": {"k0": 2e3, "k1": 8e3, "tau1": 0.004, "k2": 5e3, "tau2": 0.02},
    "generalised_maxwell_3": {"k0": 2e3, "k1": 8e3, "tau1": 0.004, "k2": 5e3, "tau2": 0.02, "k3": 3e3, "tau3": 0.001},
    "fractional": {"k": 2e3, "c": 900.0, "alpha": 0.4},
    "springpot": {"c": 900.0, "alpha": 0.4},
    "box_spectrum": {"c": 2e3, "tau": 0.05},
    "released_support": {"g": 700.0},
    "saturating_stiffness": {"k": 2e4, "d0": 4e-3},
    "preloaded_contact": {"k": 2e4, "preload": 12.0, "side": -1.0},
    "hertz_contact": {"k": 1e6, "gap": 2e-4, "sides": 1.0},
    "play_friction": {"f": 8.0, "kt": 2e4, "gap": 3e-4},
    "sliding_friction": {"f": 8.0, "v0": 0.02},
    "cubic_damping": {"c": 2e4},
    "displacement_damping": {"c": 30.0, "beta": 1e6},
    "iwan": {"k1": 9e3, "k2": 8e3, "k3": 7e3, "k4": 6e3, "k5": 5e3, "k6": 4e3, "span": 1e-3},
    "free_form": {
        **{f"fd{i + 1}": f for i, f in enumerate((-50.0, -30.0, -14.0, -5.0, 5.0, 14.0, 30.0, 50.0))},
        **{f"fv{i + 1}": f for i, f in enumerate((-6.0, -3.0, -1.0, 1.0, 3.0, 6.0))},
        "d_span": 1e-3,
        "v_span": 0.06,
    },
}
# laws that other tests register come and go
LOCAL = [entry.name for entry in catalogue(extended=True) if entry.name in VALUES or not entry.extended]
# forms of their own that parse_unit does not know
OTHER_UNITS = ("-", "1/m^n", "N s^alpha/m", "N/m^1.5")


def motion(amplitude: float = 1e-3, omega: float = 60.0, n: int = 2000, dt: float = 1e-4):
    t = np.arange(n) * dt
    return (
        amplitude * np.sin(omega * t),
        amplitude * omega * np.cos(omega * t),
        -(omega**2) * amplitude * np.sin(omega * t),
    )


def test_every_local_physics_has_values_here() -> None:
    assert set(VALUES) == set(LOCAL)
    library = set(_core.law_library())
    assert {physics(name).law for name in LOCAL} == library - {"linear"}


def test_extended_laws_wait_to_be_asked_for() -> None:
    default = {entry.name for entry in catalogue()}
    assert not any(physics(name).extended for name in default)
    assert {"play_friction", "fractional", "free_form"} <= set(LOCAL) - default
    # the contract's names are fixed: every other law is told under one of them, in its own family
    for name in set(LOCAL) - default:
        entry = physics(name)
        assert entry.reported in {*default, ""}
        if entry.reported and not entry.nearest:
            assert physics(entry.reported).family == entry.family
    with selected(["cubic_stiffness", physics("play_friction")]) as chosen:
        assert [entry.name for entry in chosen] == ["cubic_stiffness", "play_friction"]
        assert [entry.name for entry in catalogue(kind="nonlinear", families=["hysteretic"])] == ["play_friction"]
    assert {entry.name for entry in catalogue()} == default
    with selected(None):
        assert {entry.name for entry in catalogue()} == default
    with pytest.raises(LawParameterError, match="nearest is 'play_friction'"), selected(["play_frictoin"]):
        pass


@pytest.mark.parametrize("name", LOCAL)
def test_parameters_and_units_are_those_of_the_core(name: str) -> None:
    entry = physics(name)
    core = _core.law_library()[entry.law or ""]
    assert [p for p, _ in core] == list(entry.parameter_names)
    assert entry.family in FAMILIES
    for parameter, (_, unit) in zip(entry.parameters, core, strict=True):
        text = parameter.unit(unit_system("SI"))
        if unit not in OTHER_UNITS:
            ours, theirs = parse_unit(text), parse_unit(re.sub(r"N (s\S*)/", r"N*\1/", unit))
            assert (ours.dims, ours.factor) == (theirs.dims, pytest.approx(theirs.factor))


def test_units_follow_system_and_rotation() -> None:
    mm = unit_system("mm-t-s")
    k3 = physics("cubic_stiffness").parameters[0]
    assert k3.unit(mm) == "N/mm^3"
    assert k3.si_factor(mm) == pytest.approx(1e9)
    mass, k = physics("added_mass").parameters[0], physics("support_stiffness").parameters[0]
    assert (mass.unit(mm), mass.si_factor(mm)) == ("t", pytest.approx(1e3))
    assert (k.unit(mm, rotational=True), k.si_factor(mm, rotational=True)) == ("N*mm/rad", pytest.approx(1e-3))
    assert mass.unit(unit_system("SI"), rotational=True) == "kg*m^2"
    assert physics("viscous_damper").parameters[0].unit(unit_system("in-lbf-s")) == "lbf*s/in"
    hertz, springpot = physics("hertz_contact").parameters[0], physics("fractional").parameters[1]
    assert (hertz.unit(mm), hertz.si_factor(mm)) == ("N/mm^1.5", pytest.approx(1e3**1.5))
    assert (springpot.unit(mm), springpot.si_factor(mm)) == ("N*s^alpha/mm", pytest.approx(1e3))
    assert physics("bouc_wen").parameters[3].unit(mm) == "1/mm^n"
    assert physics("displacement_damping").parameters[1].unit(mm) == "1/mm^2"


@pytest.mark.parametrize("name", LOCAL)
def test_fit_coordinates_come_back_with_their_slopes(name: str) -> None:
    fit = FitCoordinates(physics(name), VALUES[name])
    x = fit.start()
    assert fit.array(x) == pytest.approx(list(VALUES[name].values()), rel=1e-12)
    shifted = x + 0.3
    assert fit.coordinates(fit.parameters(shifted)) == pytest.approx(shifted, abs=1e-6)
    slopes = fit.jacobian(shifted)
    for j in range(len(x)):
        step = np.zeros_like(x)
        step[j] = 1e-6
        difference = (fit.array(shifted + step) - fit.array(shifted - step)) / 2e-6
        scale = np.abs(fit.array(shifted))
        # central difference: truncation 1e-12, rounding 1e-10 of the value
        assert (np.abs(slopes[:, j] - difference) <= 1e-8 * scale).all()


def test_every_bouc_wen_coordinate_is_a_law_the_core_takes() -> None:
    rng = np.random.default_rng(1)
    fit = FitCoordinates(physics("bouc_wen"), VALUES["bouc_wen"])
    d, v, a = motion()
    for _ in range(200):
        x = fit.start() + rng.normal(scale=2.0, size=len(fit.free))
        assert np.isfinite(_core.law_force("bouc_wen", fit.array(x), d, v, a, 1e-4)).all()


def test_fixed_and_bounded_parameters_stay() -> None:
    start = {"k": 2e4, "alpha": 0.0, "n": 2.0, "beta": 3e4, "gamma": 1e4}
    fit = FitCoordinates(physics("bouc_wen"), start, fixed=["n"])
    assert fit.free == ("k", "beta", "gamma")
    moved = fit.parameters(fit.start() + 1.0)
    assert (moved["alpha"], moved["n"]) == (0.0, 2.0)
    assert FitCoordinates(physics("clearance"), VALUES["clearance"]).free == ("k", "gap")
    surface = FitCoordinates(physics("free_form"), {**VALUES["free_form"], "fd1": 0.0})
    assert len(surface.free) == 14
    # the first coordinate is the mean slope of the curve over d in units of its largest force: a line more, no bend
    moved = surface.parameters(surface.start() - np.eye(14)[0])
    knots = (-1.0, -0.7, -0.4, -0.15, 0.15, 0.4, 0.7, 1.0)
    change = [moved[f"fd{i + 1}"] - surface.values[f"fd{i + 1}"] for i in range(8)]
    assert change == pytest.approx([-50.0 * at for at in knots], rel=1e-9)


@pytest.mark.parametrize("name", LOCAL)
def test_a_regression_on_shapes_recovers_a_force(name: str) -> None:
    entry = physics(name)
    if name == "structural_damping":
        pytest.skip("has no force history")
    d, v, a = motion()
    law = entry.law or ""
    grid = shapes(entry, amplitude=1e-3, band=(20.0, 200.0))
    assert 1 <= len(grid) <= 20
    # a force of the grid's own kind at its second shape comes back exactly, as the best of the grid
    target = grid[min(1, len(grid) - 1)]
    factors = [3.0 * (i + 1) for i in range(len(target.terms))]
    f = _core.law_force(law, target.values(factors), d, v, a, 1e-4)
    misfits = []
    for shape in grid:
        columns = np.array([_core.law_force(law, dict(term), d, v, a, 1e-4) for term in shape.terms]).T
        x = np.linalg.lstsq(columns, f, rcond=None)[0]
        misfits.append(float(np.linalg.norm(columns @ x - f)))
        if shape is target:
            assert x == pytest.approx(factors, rel=1e-6)
    assert min(misfits) < 1e-9 * np.linalg.norm(f)


@pytest.mark.parametrize("name", [n for n in LOCAL if physics(n).kind == "linear"])
def test_linear_laws_start_as_stiff_as_they_are_asked_to(name: str) -> None:
    middle = np.array([1j * 60.0])
    sizes = [1e3, 1e5]
    starts = linear_sizes(physics(name), sizes, (30.0, 120.0))
    assert len(starts) % len(sizes) == 0
    for values, k in zip(starts, sizes * (len(starts) // len(sizes)), strict=True):
        kappa = abs(_core.law_dynamic_stiffness(physics(name).law or "", values, middle)[0][0])
        # the terms share the size alike, but are not in phase
        assert 0.3 * k < kappa < 1.01 * k


def test_a_stop_that_peaks_alone_reach_has_a_start_near_it() -> None:
    t = np.arange(6000) * 1e-3
    d = sum(np.sin(2 * np.pi * f * t + f) for f in (2.3, 3.1, 3.9, 4.7, 5.3))
    amplitude = float(np.abs(d).max())
    stop = {"k": 5e4, "gap": 0.95 * amplitude, "sides": 2.0}

    def force(values: dict[str, float]) -> np.ndarray:
        return np.array(_core.law_force("clearance", values, d, np.gradient(d, 1e-3), np.zeros_like(d), 1e-3))

    f, left = force(stop), []
    for shape in shapes(physics("clearance"), amplitude=amplitude, band=(10.0, 40.0)):
        one = force(dict(shape.terms[0]))
        left.append(np.linalg.norm(f - one * (one @ f) / (one @ one)) / np.linalg.norm(f))
    assert min(left) < 0.6


def test_collapsed_laws_have_the_simpler_laws_force() -> None:
    d, v, a = motion()
    collapsed = [
        ("viscoelastic", {"k0": 0.0, "k1": 2e5, "tau": 1e-4}, "viscous_damper"),
        ("viscoelastic", {"k0": 1e4, "k1": 2e4, "tau": 10.0}, "support_stiffness"),
        ("tuned_absorber", {"m": 0.3, "k": 0.3 * 5000**2, "c": 2000.0}, "added_mass"),
        ("clearance", {"k": 1e4, "gap": 1e-8, "sides": 2.0}, "support_stiffness"),
        ("clearance", {"k": 1e4, "gap": 1e-8, "sides": -1.0}, "bilinear_stiffness"),
        ("bilinear_stiffness", {"k_plus": 1e4, "k_minus": 1.01e4}, "support_stiffness"),
        ("coulomb_friction", {"f": 100.0, "kt": 1e4}, "support_stiffness"),
        ("bouc_wen", {"k": 1e4, "alpha": 0.0, "n": 1.0, "beta": 1.0, "gamma": 0.5}, "support_stiffness"),
        ("generalised_maxwell", {"k0": 1e4, "k1": 2e4, "tau1": 0.01, "k2": 3e4, "tau2": 10.0}, "viscoelastic"),
        ("generalised_maxwell", {"k0": 1e4, "k1": 2e4, "tau1": 0.01, "k2": 0.0, "tau2": 0.1}, "viscoelastic"),
        (
            "generalised_maxwell_3",
            {"k0": 1e4, "k1": 2e4, "tau1": 0.01, "k2": 1e4, "tau2": 0.0105, "k3": 1e4, "tau3": 0.001},
            "generalised_maxwell",
        ),
        ("fractional", {"k": 1e3, "c": 4e3, "alpha": 0.01}, "support_stiffness"),
        ("fractional", {"k": 0.0, "c": 40.0, "alpha": 0.99}, "viscous_damper"),
        ("springpot", {"c": 4e3, "alpha": 0.01}, "support_stiffness"),
        ("springpot", {"c": 40.0, "alpha": 0.99}, "viscous_damper"),
        ("box_spectrum", {"c": 1e2, "tau": 1e14}, "support_stiffness"),
        ("box_spectrum", {"c": 1e5, "tau": 1e-3}, "viscous_damper"),
        ("saturating_stiffness", {"k": 1e4, "d0": 1.0}, "support_stiffness"),
        ("preloaded_contact", {"k": 1e4, "preload": 30.0, "side": 1.0}, "support_stiffness"),
        ("preloaded_contact", {"k": 1e4, "preload": 1e-6, "side": -1.0}, "bilinear_stiffness"),
        ("play_friction", {"f": 4.0, "kt": 1e4, "gap": 1e-8}, "coulomb_friction"),
        ("play_friction", {"f": 40.0, "kt": 1e4, "gap": 4e-4}, "clearance"),
        ("sliding_friction", {"f": 8.0, "v0": 1.0}, "viscous_damper"),
        ("displacement_damping", {"c": 30.0, "beta": 1e3}, "viscous_damper"),
        ("iwan", {**dict.fromkeys(("k1", "k2", "k3", "k5", "k6"), 0.0), "k4": 1e4, "span": 1e-3}, "coulomb_friction"),
        ("iwan", {**dict.fromkeys(("k1", "k2", "k3", "k4", "k5"), 0.0), "k6": 1e4, "span": 2e-3}, "support_stiffness"),
    ]
    for name, values, expected in collapsed:
        found = simpler(physics(name), values, amplitude=1e-3, band=(50.0, 100.0))
        assert found is not None, name
        assert found[0] == expected
        f = _core.law_force(name, values, d, v, a, 1e-4)
        g = _core.law_force(found[0], found[1], d, v, a, 1e-4)
        # after the start; 15 % of phase is what "collapsed" allows
        assert np.linalg.norm((f - g)[1000:]) < 0.15 * np.linalg.norm(f[1000:]), (name, expected)
    for name in LOCAL:
        assert simpler(physics(name), VALUES[name], amplitude=1e-2, band=(30.0, 400.0)) is None, name


def test_companion_is_told_inside_the_law() -> None:
    d, v, a = motion()
    for name in ("bouc_wen", "bilinear_stiffness", "viscoelastic"):
        values, k = VALUES[name], 1.5e4
        f = _core.law_force(name, values, d, v, a, 1e-4) + k * d
        merged = with_companion(physics(name), values, k)
        assert _core.law_force(name, merged, d, v, a, 1e-4) == pytest.approx(f, rel=1e-9, abs=1e-9)


def test_a_companion_told_inside_a_law_has_its_share_of_the_deviations() -> None:
    for name in ("bouc_wen", "bilinear_stiffness", "viscoelastic", "cubic_stiffness"):
        law, values, k = physics(name), VALUES[name], 1.5e4
        start = np.array([*(values[n] for n in law.parameter_names), k])

        def told(at: np.ndarray, law: Physics = law) -> np.ndarray:
            own = dict(zip(law.parameter_names, at[:-1].tolist(), strict=True))
            return np.array(list(with_companion(law, own, float(at[-1])).values()))

        steps = np.diag(1e-5 * np.maximum(np.abs(start), 1e-3))
        slopes = [(told(start + s) - told(start - s)) / (2 * s.sum()) for s in steps]
        np.testing.assert_allclose(companion_jacobian(law, values, k), np.array(slopes).T, rtol=1e-5, atol=1e-9)


def test_names_that_are_none() -> None:
    with pytest.raises(LawParameterError, match=r"nearest is 'clearance'"):
        physics("clearence")
    with pytest.raises(LawParameterError, match="is not one of them"):
        FitCoordinates(physics("viscous_damper"), {"c": 1.0, "k": 2.0})
    with pytest.raises(LawParameterError, match=r"tau = -1, it must be more than zero"):
        FitCoordinates(physics("viscoelastic"), {"k0": 1.0, "k1": 1.0, "tau": -1.0})
    with pytest.raises(LawParameterError, match="no start values"):
        shapes(physics("base_motion"), amplitude=1.0, band=(1.0, 2.0))
    assert CATALOGUE["base_motion"].law is None


def test_examples_in_docstrings() -> None:
    for module in ("catalogue", "starts", "nested", "tracing", "free_form", "classify", "rotor", "own"):
        result = doctest.testmod(import_module(f"femend.physics.{module}"))
        assert (result.failed, result.attempted > 0) == (0, True)


def test_coordinates_beyond_what_numbers_hold_keep_positive_parameters_so() -> None:
    values = {"k": 1e4, "alpha": 0.1, "n": 2.0, "beta": 1e6, "gamma": 4e5}
    coordinates = FitCoordinates(physics("bouc_wen"), values)
    x = coordinates.start()
    x[list(coordinates.free).index("beta")] = 800.0  # a yield displacement of exp(800), which nothing reaches
    there = coordinates.parameters(x)
    assert 0 < there["beta"] < 1e-300
    assert np.isfinite(list(there.values())).all()
