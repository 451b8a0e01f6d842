"""Moduli and densities of a deck in the units it is said to be in: values of no solid tell that these are others."""

from __future__ import annotations

import re
from pathlib import Path

from femend import _core
from femend.errors import DeckError
from femend.model.cards.card_mass import mass_of_card
from femend.model.cards.real_field import real
from femend.numerals import plain
from femend.units import SYSTEMS, UnitSystem, unit_system

__all__ = ["material_doubts"]

# from rubber to diamond, in Pa, and from cork to osmium, in kg/m³; foams and smeared masses are given their room
E_RANGE, RHO_RANGE = (1e6, 2e12), (10.0, 3e4)
# kg/m³, no mass is smeared so thick: osmium has 22 600, steel that is given in the unit of another system 7.85e6
HEAVIEST, OSMIUM = 1e6, 22600.0
# m/s, root of modulus over density: 5 km/s in metals, 13 in beryllium, 18 in diamond
FASTEST = 2.5e4
# what PARAM,WTMASS makes of masses that are given otherwise in a unit system: its value, and what they then are
OTHERWISE = {
    "SI": ((1 / 9.80665, "weights in N"),),
    "mm-t-s": ((1e-3, "kilograms"), (1 / 9806.65, "weights in N")),
    "in-lbf-s": ((1 / 386.0886, "weights in lbf (pounds)"),),
}
_MAT1 = re.compile(r"^[ ]*MAT1\*?[ ,]+(\d+)", re.IGNORECASE | re.MULTILINE)
# fields of the card, its name being the first
E_FIELD, RHO_FIELD = 3, 6


Values = dict[int, float]


def material_doubts(deck: _core.Deck, units: str, said: str = "[model] units") -> list[str]:
    """A sentence where no MAT1 of the deck has a modulus, or none a density, that a solid has in the unit system
    `units`, or none both at a speed of sound that there is; the PARAM,WTMASS, or the system, with which all have is
    named. Values left out and densities of 0 do not count. `said` is where the user says the units.

    One material alone may be a stand-in: a link that is to be rigid, a mass that is smeared. Told of single ones is a
    density far beyond what is smeared.
    """
    # a deck of weights has its densities times this
    mass = mass_of_card(deck)
    moduli, densities = _values(deck, E_FIELD), _values(deck, RHO_FIELD)
    own = unit_system(units)
    wrong = _wrong(moduli, densities, mass, own)
    if not wrong:
        return _far_too_heavy(densities, mass, own)
    said_of = "; ".join(f"MAT1 {mid} has {' and '.join(of_it)}" for mid, of_it in wrong.items())
    return [
        f"in the units {units!r} no material of the deck is a solid's: {said_of}; "
        f"{_hint(moduli, densities, mass, own)}check {said}, and E and RHO of the deck"
    ]


def _far_too_heavy(densities: Values, mass: float, own: UnitSystem) -> list[str]:
    """A sentence on materials whose density is beyond any that a smeared mass has, beside others that are solids'."""
    heavy = {m: rho for m, v in densities.items() if (rho := _si(v * mass, "density", own)) > HEAVIEST}
    return [
        f"MAT1 {mid} has a density of {densities[mid]:.6g}, which is {plain(rho, 3)} kg/m³ in the units {own.name!r}, "
        f"{plain(rho / OSMIUM, 2)} times that of osmium, while other materials have those of solids: correct its RHO"
        for mid, rho in heavy.items()
    ]


def _wrong(moduli: Values, densities: Values, mass: float, own: UnitSystem) -> dict[int, list[str]]:
    """What is no solid's, where none of the deck is one, by the id of the material it is told of: the first that has
    both values, or the first that has each."""
    on_card = "" if mass == 1 else f" times PARAM,WTMASS {mass:g}"
    wrong: dict[int, list[str]] = {}
    # of one material where one has both
    both = next((mid for mid in moduli if mid in densities), None)
    for values, what, quantity, limits, unit, by, times in (
        (moduli, "modulus", "pressure", E_RANGE, "Pa", 1.0, ""),
        (densities, "density", "density", RHO_RANGE, "kg/m³", mass, on_card),
    ):
        if values and not any(_plausible(v * by, quantity, limits, own) for v in values.values()):
            mid = next(iter(values)) if both is None else both
            value = values[mid]
            is_ = f"which is {plain(_si(value * by, quantity, own), 3)} {unit}"
            wrong.setdefault(mid, []).append(f"a {what} of {value:.6g}{times}, {is_}")
    speeds = _speeds(moduli, densities, mass, own)
    if not wrong and speeds and min(speeds.values()) > FASTEST:
        mid = next(iter(speeds))
        rho = plain(_si(densities[mid] * mass, "density", own), 3)
        wrong[mid] = [
            f"a modulus of {moduli[mid]:.6g} and a density of {densities[mid]:.6g}{on_card}, which is {rho} kg/m³: "
            f"sound would run at {plain(speeds[mid] / 1e3, 3)} km/s, and runs at 18 in diamond"
        ]
    return wrong


def _hint(moduli: Values, densities: Values, mass: float, own: UnitSystem) -> str:
    """The PARAM,WTMASS, or the unit system, with which all materials are solids; nothing where none makes them so."""
    if mass != 1 and _solids(moduli, densities, 1.0, own):
        return (
            "without PARAM,WTMASS all are those of solids, as RHO is a mass per volume already (it acts on CONM2 and "
            "NSM too): "
        )
    for by, what in OTHERWISE[own.name] if mass == 1 else ():
        if _solids(moduli, densities, by, own):
            return (
                f"taken as {what} its masses make all those of solids, which needs PARAM,WTMASS,{plain(by)} in "
                "the deck (it acts on CONM2 and NSM too): "
            )
    for name in SYSTEMS:
        if name != own.name and _solids(moduli, densities, mass, unit_system(name)):
            return f"in {name!r} all are those of solids: "
    return ""


def _solids(moduli: Values, densities: Values, mass: float, own: UnitSystem) -> bool:
    return (
        all(_plausible(v, "pressure", E_RANGE, own) for v in moduli.values())
        and all(_plausible(v * mass, "density", RHO_RANGE, own) for v in densities.values())
        and max(_speeds(moduli, densities, mass, own).values(), default=0.0) <= FASTEST
    )


def _speeds(moduli: Values, densities: Values, mass: float, own: UnitSystem) -> Values:
    """The speed of sound in each material that has both values, in m/s."""
    return {
        m: (_si(E, "pressure", own) / _si(densities[m] * mass, "density", own)) ** 0.5
        for m, E in moduli.items()
        if m in densities
    }


def _values(deck: _core.Deck, field: int) -> Values:
    """Values of a field of the MAT1 by id, those above 0."""
    ids: set[int] = set()
    for file in deck.files:
        ids.update(int(m) for m in _MAT1.findall(Path(file).read_text(encoding="latin-1")))
    found = {}
    for mid in sorted(ids):
        try:
            text = deck.field_text("MAT1", mid, field).strip()
        except DeckError:
            continue  # in case control, or commented out in a way of its own
        if text and real(text) > 0:
            found[mid] = real(text)
    return found


def _si(value: float, quantity: str, units: UnitSystem) -> float:
    return value * units.factor(quantity)


def _plausible(value: float, quantity: str, limits: tuple[float, float], units: UnitSystem) -> bool:
    return limits[0] <= _si(value, quantity, units) <= limits[1]
