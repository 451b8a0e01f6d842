"""Values of a deck that are below nothing: allowed, and seldom meant."""

from __future__ import annotations

from femend import _core
from femend.model.deck_changes import real

__all__ = ["negative_values"]

# field of the value (the card's name is field 1) and what it is
_FIELDS = {
    "CONM2": (5, "mass"),
    "CMASS2": (3, "mass"),
    "CELAS2": (3, "stiffness"),
    "CDAMP2": (3, "damping coefficient"),
}


def negative_values(deck: _core.Deck) -> list[str]:
    """A sentence for every concentrated mass, spring and dashpot of a deck whose value is negative."""
    told = []
    for eid, card, _, nodes in sorted(deck.elements(), key=lambda element: element[0]):
        field, what = _FIELDS.get(card, (0, ""))
        text = deck.field_text(card, eid, field).strip() if field else ""
        if text and real(text) < 0:
            at = " and ".join(f"node {node}" for node in nodes if node)
            told.append(
                f"{card} {eid} at {at} has a {what} of {text}, below nothing; it is taken as it stands: change its "
                "sign if it was not meant to take something away"
            )
    return told
