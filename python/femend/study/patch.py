"""The updated deck: parameters changed where they stand, the new term added at the end."""

from __future__ import annotations

from typing import Any

from femend.diagnose import Diagnosis
from femend.io.deck import next_id
from femend.model import Model
from femend.model.deck_changes import deck_changes

__all__ = ["deck_cards", "deck_changes"]


def deck_cards(model: Model, diagnosis: Diagnosis, result: dict[str, Any]) -> list[str]:
    """Bulk-data lines for the new terms: cards where Nastran has some that fit, their descriptions as comments."""
    lines: list[str] = []
    id_ = next_id(model.deck, "element")
    for finding in result["findings"]:
        where = finding["location"]
        values = {name: v["value"] for name, v in finding["parameters"].items()}
        words = ", ".join(
            f"{name} = {value} {finding['parameters'][name]['unit']}".strip() for name, value in values.items()
        )
        nodes = ", ".join(str(n) for n in where["nodes"])
        name = finding["physics"] or "unnamed"
        words = words or finding.get("class", "")
        cards = _term(id_, finding["physics"], where, values)
        id_ += len(cards)
        lines += [
            f"$ femend: {name} at node {nodes} {where['direction']} to {where['to'] or 'nothing'}",
            f"$ femend: {words}",
            *cards,
        ]
    return lines


def _term(id_: int, physics: str, where: dict[str, Any], values: dict[str, Any]) -> list[str]:
    axes = {"X": 1, "Y": 2, "Z": 3}
    if len(where["nodes"]) != 1 or where["to"] != "ground" or where["direction"] not in axes:
        return []
    node, component = where["nodes"][0], axes[where["direction"]]
    if physics == "support_stiffness":
        return [f"CELAS2,{id_},{values['k']:.6E},{node},{component}"]
    if physics == "viscous_damper":
        return [f"CDAMP2,{id_},{values['c']:.6E},{node},{component}"]
    if physics == "added_mass":
        return [f"CONM2,{id_},{node},,{values['m']:.6E}"]
    return []
