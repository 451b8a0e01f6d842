"""The catalogue of physics against the core's library, and its maps and start values."""

from __future__ import annotations

import doctest
import re
from importlib import import_module

import numpy as np
import pytest

from femend import _core
from femend.errors import LawParameterError
from femend.physics import CATALOGUE, FAMILIES, FitCoordinates, catalogue, physics, shapes, simpler, with_companion
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
}
LOCAL = [entry.name for entry in catalogue()]


def motion(amplitude: float = 1e-3, omega: float = 60.0, n: int = 2000, dt: float = 1e-4):
    t = np.arange(n) * dt
    return (
        amplitude * np.sin(omega * t),
        amplitude * omega * np.cos(omega * t),
        -(omega**2) * amplitude * np.sin(omega * t),
    )


def test_every_local_physics_has_values_here() -> None:
    assert set(VALUES) == set(LOCAL)


@pytest.mark.parametrize("name", LOCAL)
def test_parameters_and_units_are_those_of_the_core(name: str) -> None:
    entry = physics(name)
    core = _core.law_library()[entry.law or ""]
    assert [p for p, _ in core] == list(entry.parameter_names)
    assert entry.family in FAMILIES
    for parameter, (_, unit) in zip(entry.parameters, core, strict=True):
        text = parameter.unit(unit_system("SI"))
        if unit not in ("-", "1/m^n"):
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
    for module in ("catalogue", "starts", "nested"):
        result = doctest.testmod(import_module(f"femend.physics.{module}"))
        assert (result.failed, result.attempted > 0) == (0, True)
