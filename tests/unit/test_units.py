"""Units: what people write on channels, and the three unit systems of models."""

from __future__ import annotations

import pytest

from femend.errors import UnitError
from femend.units import QUANTITIES, SYSTEMS, parse_unit, quantity_factor, quantity_of, unit_system

G, LBF, INCH = 9.80665, 4.4482216152605, 0.0254


@pytest.mark.parametrize(
    ("text", "factor", "quantity"),
    [
        ("m/s^2", 1.0, "acceleration"),
        ("m/s2", 1.0, "acceleration"),
        ("m/s²", 1.0, "acceleration"),
        ("m s^-2", 1.0, "acceleration"),
        ("m·s⁻²", 1.0, "acceleration"),
        ("m/s**2", 1.0, "acceleration"),
        ("g", G, "acceleration"),
        ("mg", G / 1000, "acceleration"),
        ("in/s^2", INCH, "acceleration"),
        ("mm/s", 1e-3, "velocity"),
        ("um", 1e-6, "displacement"),
        ("µm", 1e-6, "displacement"),
        ("mil", INCH / 1000, "displacement"),
        ("kN", 1e3, "force"),
        ("lbf", LBF, "force"),
        ("kip", 1000 * LBF, "force"),
        ("N*m/rad", 1.0, None),
        ("(m/s^2)/N", 1.0, None),
        ("(1/N)*(m/s^2)", 1.0, None),
        ("g/lbf", G / LBF, None),
        ("MPa", 1e6, "pressure"),
        ("V", 1.0, "voltage"),
        ("ue", 1e-6, None),
    ],
)
def test_units_of_channels(text: str, factor: float, quantity: str | None) -> None:
    assert parse_unit(text).factor == pytest.approx(factor, rel=1e-14)
    assert quantity_of(text) == quantity


@pytest.mark.parametrize("text", ["", "furlong", "m//s", "m^", "(m/s", "m/s^x", "m$"])
def test_text_that_is_no_unit(text: str) -> None:
    with pytest.raises(UnitError, match=r"write it|not closed|not an integer|cannot be read"):
        parse_unit(text)


def test_a_unit_must_measure_its_quantity() -> None:
    assert quantity_factor("acceleration", "g") == G
    assert quantity_factor("acceleration", "rad/s^2", rotational=True) == 1.0
    assert quantity_factor("force", "N*m", rotational=True) == 1.0
    with pytest.raises(UnitError, match=r"'mm' does not measure acceleration; use a unit such as 'm/s\^2'"):
        quantity_factor("acceleration", "mm")
    with pytest.raises(UnitError, match="quantity 'speed' is unknown"):
        quantity_factor("speed", "m/s")


@pytest.mark.parametrize("system", list(SYSTEMS))
def test_the_written_unit_is_the_factor(system: str) -> None:
    for quantity in QUANTITIES:
        if quantity != "tacho":
            unit = parse_unit(unit_system(system).text(quantity))
            assert unit.dims == QUANTITIES[quantity], quantity
            assert unit.factor == pytest.approx(unit_system(system).factor(quantity), rel=1e-12), quantity


@pytest.mark.parametrize("system", list(SYSTEMS))
def test_systems_are_consistent(system: str) -> None:
    """Force is mass times acceleration, stiffness force per length, in every system."""
    factor = unit_system(system).factor
    assert factor("force") == pytest.approx(factor("mass") * factor("acceleration"), rel=1e-14)
    assert factor("stiffness") == pytest.approx(factor("force") / factor("length"), rel=1e-14)
    assert factor("damping") == pytest.approx(factor("force") / factor("velocity"), rel=1e-14)


def test_known_factors() -> None:
    assert unit_system("mm-t-s").factor("stiffness") == pytest.approx(1e3)
    assert unit_system("in-lbf-s").factor("mass") == pytest.approx(175.126835, rel=1e-8)
    with pytest.raises(UnitError, match="'cgs' are unknown; use one of SI, mm-t-s, in-lbf-s"):
        unit_system("cgs")
