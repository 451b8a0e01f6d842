"""Values of a deck that are below nothing: allowed, and seldom meant."""

from __future__ import annotations

from collections.abc import Sequence

from femend import _core
from femend.model.cards.real_field import real

__all__ = ["negative_values"]

# field of the value (the card's name is field 1) and what it is
_FIELDS = {
    "CONM2": (5, "mass"),
    "CMASS2": (3, "mass"),
    "CELAS2": (3, "stiffness"),
    "CDAMP2": (3, "damping coefficient"),
}


# card of the property that an element takes its values from, the fields they stand in and what they are
_OF_PROPERTY = {
    "CELAS1": ("PELAS", (3,), "stiffness"),
    "CDAMP1": ("PDAMP", (3,), "damping coefficient"),
    "CMASS1": ("PMASS", (3,), "mass"),
    "CBUSH": ("PBUSH", (4, 5, 6, 7, 8, 9), "stiffness"),
}


def negative_values(deck: _core.Deck) -> list[str]:
    """A sentence for every concentrated mass, spring and dashpot of a deck, and every property of such, whose value is
    negative."""
    told, seen = [], set()
    for eid, card, pid, nodes in sorted(deck.elements(), key=lambda element: element[0]):
        field, what = _FIELDS.get(card, (0, ""))
        if field:
            at = " and ".join(f"node {node}" for node in nodes if node)
            told += _told(deck, card, eid, (field,), what, f"{card} {eid} at {at}")
        if pid is not None and card in _OF_PROPERTY and (card, pid) not in seen:
            seen.add((card, pid))
            name, fields, what = _OF_PROPERTY[card]
            if name != "PBUSH" or deck.field_text(name, pid, 3).strip().upper() == "K":
                told += _told(deck, name, pid, fields, what, f"{name} {pid} ({card} {eid} and its like)")
    return told


def _told(deck: _core.Deck, card: str, number: int, fields: Sequence[int], what: str, who: str) -> list[str]:
    found = []
    for field in fields:
        text = deck.field_text(card, number, field).strip()
        if text and real(text) < 0:
            found.append(
                f"{who} has a {what} of {text}, below nothing; it is taken as it stands: change its sign if it was not "
                "meant to take something away"
            )
    return found
