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
_MAT1 = re.compile(r"^[ ]*MAT1\*?[ ,]+(\d+)", re.IGNORECASE | re.MULTILINE)
# fields of the card, its name being the first
E_FIELD, RHO_FIELD = 3, 6


def material_doubts(deck: _core.Deck, units: str, said: str = "[model] units") -> list[str]:
    """A sentence where no MAT1 of the deck has a modulus, or none a density, that a solid has in the unit system
    `units`; the system in which all have is named. Values left out and densities of 0 do not count.
    `said` is where the user says the units.

    One material alone may be a stand-in: a link that is to be rigid, a mass that is smeared.
    """
    # a deck of weights has its densities times this
    mass = mass_of_card(deck)
    moduli, densities = _values(deck, E_FIELD), {m: v * mass for m, v in _values(deck, RHO_FIELD).items()}
    own = unit_system(units)
    wrong = []
    for values, what, quantity, limits, unit in (
        (moduli, "modulus", "pressure", E_RANGE, "Pa"),
        (densities, "density", "density", RHO_RANGE, "kg/m³"),
    ):
        if values and not any(_plausible(v, quantity, limits, own) for v in values.values()):
            value = next(iter(values.values()))
            wrong.append(f"a {what} of {value:.6g}, which is {plain(_si(value, quantity, own), 3)} {unit}")
    if not wrong:
        return []
    others = [
        name
        for name in SYSTEMS
        if name != units
        and all(_plausible(v, "pressure", E_RANGE, unit_system(name)) for v in moduli.values())
        and all(_plausible(v, "density", RHO_RANGE, unit_system(name)) for v in densities.values())
    ]
    hint = f"in {others[0]!r} all are those of solids: " if others else ""
    mid = next(iter({**moduli, **densities}))
    return [
        f"in the units {units!r} no material of the deck is a solid's: MAT1 {mid} has {' and '.join(wrong)}; {hint}"
        f"check {said}, and E and RHO of the deck"
    ]


def _values(deck: _core.Deck, field: int) -> dict[int, float]:
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
