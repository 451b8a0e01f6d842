"""Bars and rods whose cross-section has no area: allowed, where they are meant to bend or twist alone, and easily a
field that was left blank."""

from __future__ import annotations

from femend import _core
from femend.model.cards.real_field import real

__all__ = ["zero_areas"]

# property cards, the elements that take them, and where A stands behind the name of the card
_BARS = {"PBAR": "CBAR", "PBEAM": "CBEAM"}
AREA = 2


def zero_areas(deck: _core.Deck) -> list[str]:
    """A sentence for each PBAR and PBEAM in use with A = 0 or blank, and each PROD in use and CONROD that has no J
    either.

    Nastran Quick Reference Guide: PBAR, PBEAM, PROD, CONROD.
    """
    first: dict[tuple[str, int | None], int] = {}
    for eid, card, pid, _ in sorted(deck.elements(), key=lambda element: element[0]):
        first.setdefault((card, pid), eid)
    told = []
    for name, card in _BARS.items():
        for fields in deck.cards(name):
            of = first.get((card, int(fields[0])))
            if of is not None and not _value(fields, AREA):
                told.append(
                    f"{name} {fields[0]} ({card} {of} and its like) has a cross-section A of 0: its bars have no "
                    "stiffness along their axis, and no mass but the non-structural one: give it A, unless they are "
                    "meant to bend and twist alone"
                )
    rods = [
        (f"PROD {fields[0]} (CROD {first['CROD', int(fields[0])]} and its like)", AREA, fields)
        for fields in deck.cards("PROD")
        if ("CROD", int(fields[0])) in first
    ]
    rods += [(f"CONROD {fields[0]}", 4, fields) for fields in deck.cards("CONROD")]
    told += [
        f"{who} has a cross-section A of 0 and no J: it holds nothing, and weighs nothing but the non-structural mass: "
        "give it A"
        for who, at, fields in rods
        if not _value(fields, at) and not _value(fields, at + 1)
    ]
    return told


def _value(fields: list[str], at: int) -> float:
    """The number in a field; 0 where it is blank."""
    text = fields[at].strip() if at < len(fields) else ""
    return real(text) if text else 0.0
