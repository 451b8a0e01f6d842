"""What stands in the fields of a deck after an update."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from femend.io.deck import FieldChange
from femend.model.cards.real_field import real
from femend.model.model import Model
from femend.model.parameter import Parameter
from femend.model.patched.deck_fields import Place, parameter_fields
from femend.numerals import listed, plain

__all__ = ["deck_changes", "kept_told", "kept_values"]

# parameters, and ids of one, that a sentence names at most
NAMED = 6
# what ids are of, one and several
_TARGETS = {
    "material": ("material", "materials"),
    "property_id": ("property", "properties"),
    "elements": ("element", "elements"),
    "mass": ("mass element", "mass elements"),
}


def deck_changes(model: Model, parameters: dict[str, Any]) -> list[FieldChange]:
    """Changed fields for factors by name, {name: {"factor": value}} for all `parameters` of the `model`; a parameter
    whose value no fields hold is left out (`kept_values`). The factors of several on one field are multiplied."""
    factors: dict[Place, float] = {}
    for name, places in parameter_fields(model).items():
        for place in places:
            factors[place] = factors.get(place, 1.0) * parameters[name]["factor"]
    changed = {place: factor for place, factor in factors.items() if factor != 1.0}
    return [FieldChange(*place, real(model.deck.field_text(*place)) * factor) for place, factor in changed.items()]


def kept_told(names: Sequence[str], values: Mapping[str, str]) -> str:
    """What is said of parameters that moved and that no field holds; `values` are theirs by name (`kept_values`), and
    `names` may have others (of fields) beside them."""
    each = listed((f"{n} is {values[n]}" for n in names if n in values), NAMED, "; ")
    return (
        f"no field of the deck holds the values of {', '.join(names)}: the deck keeps them as they were, so that it is "
        f"not the updated model; put them in by hand{each and f': {each}'}"
    )


def kept_values(model: Model, factors: Mapping[str, float]) -> dict[str, str]:
    """What the parameters of the `model` that no field holds stand for by name, where their `factors` by name (1 where
    not given) change something."""
    return {p.name: _value(p, factors[p.name]) for p in _unwritten(model) if factors.get(p.name, 1.0) != 1.0}


def _value(p: Parameter, factor: float) -> str:
    of = _TARGETS[p.target]
    return f"{plain(factor)} times {p.property} of {of[len(p.ids) > 1]} {listed(p.ids, NAMED)}"


def _unwritten(model: Model) -> list[Parameter]:
    """Those whose value no fields of the deck hold: of some elements of a card, or values that follow from others."""
    held = parameter_fields(model)
    return [p for p in model.parameters if not held[p.name]]
