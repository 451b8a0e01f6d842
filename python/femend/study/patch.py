"""The updated deck: parameters changed where they stand, the new term added at the end."""

from __future__ import annotations

from typing import Any

from femend.diagnose import Diagnosis
from femend.errors import DeckError
from femend.io.deck import FieldChange, next_id
from femend.model import Model, Parameter

__all__ = ["deck_cards", "deck_changes"]

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
    """Changed fields for the factors of result.json; a parameter whose value stands on no single field is left out."""
    changes = []
    for parameter in model.parameters:
        factor = parameters[parameter.name]["factor"]
        for card, id_, field in _fields(model, parameter):
            try:
                old = float(_number(model.deck.field_text(card, id_, field)))
            except ValueError:
                continue  # blank field: its value follows from others
            changes.append(FieldChange(card, id_, field, old * factor))
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
    places = [("PCOMP", id_, k) for k, value in text.items() if value and k <= last and k % 10 in (3, 7)]
    return places


def _has(model: Model, card: str, id_: int) -> bool:
    try:
        model.deck.find(card, id_)
    except DeckError:
        return False
    return True


def _number(text: str) -> str:
    """A Nastran real as Python reads it: 1.5-3 is 1.5e-3, D exponents too."""
    body = text.strip().upper().replace("D", "E")
    for i in range(len(body) - 1, 0, -1):
        if body[i] in "+-" and body[i - 1] not in "E":
            return f"{body[:i]}E{body[i:]}"
    return body


def deck_cards(model: Model, diagnosis: Diagnosis, result: dict[str, Any]) -> list[str]:
    """Bulk-data lines for the new term: a card where Nastran has one that fits, its description as comments."""
    if not result["findings"]:
        return []
    finding = result["findings"][0]
    where = finding["location"]
    values = {name: v["value"] for name, v in finding["parameters"].items()}
    words = ", ".join(
        f"{name} = {value} {finding['parameters'][name]['unit']}".strip() for name, value in values.items()
    )
    nodes = ", ".join(str(n) for n in where["nodes"])
    name = finding["physics"] or "unnamed"
    lines = [
        f"$ femend: {name} at node {nodes} {where['direction']} to {where['to'] or 'nothing'}",
        f"$ femend: {words}",
    ]
    return lines + _term(model, finding["physics"], where, values)


def _term(model: Model, physics: str, where: dict[str, Any], values: dict[str, Any]) -> list[str]:
    axes = {"X": 1, "Y": 2, "Z": 3}
    if len(where["nodes"]) != 1 or where["to"] != "ground" or where["direction"] not in axes:
        return []
    node, component = where["nodes"][0], axes[where["direction"]]
    id_ = next_id(model.deck, "element")
    if physics == "support_stiffness":
        return [f"CELAS2,{id_},{values['k']:.6E},{node},{component}"]
    if physics == "viscous_damper":
        return [f"CDAMP2,{id_},{values['c']:.6E},{node},{component}"]
    if physics == "added_mass":
        return [f"CONM2,{id_},{node},,{values['m']:.6E}"]
    return []
