"""What stands in the fields of a deck after an update."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from femend.io.deck import FieldChange
from femend.model.cards.real_field import real
from femend.model.model import Model
from femend.model.patched.deck_fields import Place, parameter_fields

__all__ = ["deck_changes", "kept_told", "unwritten"]


def deck_changes(model: Model, parameters: dict[str, Any]) -> list[FieldChange]:
    """Changed fields for factors by name, {name: {"factor": value}} for all `parameters` of the `model`; a parameter
    whose value no fields hold is left out (`unwritten`). Of several that scale one field the factors are multiplied."""
    factors: dict[Place, float] = {}
    for name, places in parameter_fields(model).items():
        for place in places:
            factors[place] = factors.get(place, 1.0) * parameters[name]["factor"]
    changed = {place: factor for place, factor in factors.items() if factor != 1.0}
    return [FieldChange(*place, real(model.deck.field_text(*place)) * factor) for place, factor in changed.items()]


def unwritten(model: Model) -> list[str]:
    """Parameters of the `model` whose value no fields of the deck hold: of some elements of a card, or values that
    follow from others (`parameter_fields`)."""
    return [name for name, places in parameter_fields(model).items() if not places]


def kept_told(names: Sequence[str]) -> str:
    """What is said of parameters that moved and that no field holds."""
    return (
        f"no field of the deck holds the values of {', '.join(names)}: the deck keeps them as they were, so that it is "
        "not the updated model; put them in by hand"
    )
