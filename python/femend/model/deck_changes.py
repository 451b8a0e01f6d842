"""Which fields of a deck hold the values of its parameters, and what stands there after an update."""

from __future__ import annotations

from typing import Any

from femend.errors import DeckError
from femend.io.deck import FieldChange
from femend.model.model import Model, Parameter

__all__ = ["deck_changes", "real", "unwritten"]

# card and Nastran fields of every property a parameter may scale
_MATERIAL: dict[str, dict[str, tuple[int, ...]]] = {
    "MAT1": {"E": (3,), "G": (4,), "nu": (5,), "rho": (6,)},
    "MAT2": {"E": tuple(range(3, 9)), "rho": (9,)},
    "MAT8": {"E": (3, 4), "nu": (5,), "G": (6, 7, 8), "rho": (9,)},
    "MAT9": {"E": (*range(3, 10), *range(12, 20), *range(22, 28)), "rho": (28,)},
}
_PROPERTY = {
    "PBAR": {"A": 4, "I1": 5, "I2": 6, "J": 7},
    "PROD": {"A": 4, "J": 5},
    "PSHELL": {"t": 4},
    "PELAS": {"k1": 3},
    "PBUSH": {f"k{i}": 3 + i for i in range(1, 7)},
}


def deck_changes(model: Model, parameters: dict[str, Any]) -> list[FieldChange]:
    """Changed fields for factors by name, {name: {"factor": value}} for all `parameters` of the `model`; a parameter
    whose value stands on no single field is left out (`unwritten`). Of several that scale one field the factors are
    multiplied."""
    factors: dict[tuple[str, int, int], float] = {}
    for parameter in model.parameters:
        for place in _fields(model, parameter):
            factors[place] = factors.get(place, 1.0) * parameters[parameter.name]["factor"]
    changes = []
    for place, factor in factors.items():
        try:
            changes.append(FieldChange(*place, real(model.deck.field_text(*place)) * factor))
        except ValueError:
            continue  # blank field: its value follows from others
    return changes


def _fields(model: Model, parameter: Parameter) -> list[tuple[str, int, int]]:
    if parameter.target == "material":
        return [
            (card, i, field)
            for i in parameter.ids
            for card, fields in _MATERIAL.items()
            if _has(model, card, i)
            for field in fields.get(parameter.property, ())
        ]
    if parameter.target == "mass" and parameter.property == "m":
        return [("CONM2", i, 5) for i in parameter.ids]
    if parameter.target == "property_id":
        counts = model.deck.card_counts()
        found = []
        for card, fields in _PROPERTY.items():
            if card in counts and parameter.property in fields:
                found += [(card, i, fields[parameter.property]) for i in parameter.ids if _has(model, card, i)]
        if parameter.property == "t":
            found += [place for i in parameter.ids for place in _plies(model, i)]
        return found
    return []


def _plies(model: Model, id_: int) -> list[tuple[str, int, int]]:
    """Thickness fields of a PCOMP; none where Z0 is given, for the factor grows the plies about their middle plane."""
    if not _has(model, "PCOMP", id_) or model.deck.field_text("PCOMP", id_, 3).strip():
        return []
    text = {k: model.deck.field_text("PCOMP", id_, k).strip() for k in range(12, 5000) if 2 <= k % 10 <= 9}
    last = max((k for k, value in text.items() if value), default=0)
    return [("PCOMP", id_, k) for k, value in text.items() if value and k <= last and k % 10 in (3, 7)]


def _has(model: Model, card: str, id_: int) -> bool:
    try:
        model.deck.find(card, id_)
    except DeckError:
        return False
    return True


def real(text: str) -> float:
    """A Nastran real: 1.5-3 is 1.5e-3, D exponents too. Raises ValueError for a blank field."""
    body = text.strip().upper().replace("D", "E")
    for i in range(len(body) - 1, 0, -1):
        if body[i] in "+-" and body[i - 1] not in "E":
            return float(f"{body[:i]}E{body[i:]}")
    return float(body)


def unwritten(model: Model) -> list[str]:
    """Parameters of the `model` whose value no field of the deck holds: element by element, or fields left blank."""
    out = []
    for parameter in model.parameters:
        try:
            texts = [model.deck.field_text(*place) for place in _fields(model, parameter)]
        except DeckError:
            texts = []
        if not texts or any(not text.strip() for text in texts):
            out.append(parameter.name)
    return out
