"""The updated deck: parameters changed where they stand, the new term added at the end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from femend.diagnose import Diagnosis
from femend.errors import DeckError
from femend.io.deck import next_id
from femend.model import Model, model_of
from femend.model.deck_changes import deck_changes
from femend.model.supports import held_rows
from femend.report.vocabulary import DIRECTIONS

__all__ = ["deck_cards", "deck_changes"]

# where ids of SPC sets that the deck does not have are looked for, and the nodes of an SPC1 in one line
FIRST_SET, NODES_A_LINE = 900001, 6


def deck_cards(model: Model, diagnosis: Diagnosis, result: dict[str, Any]) -> list[str]:
    """Bulk-data lines for the new terms: cards where Nastran has some that fit, their descriptions as comments."""
    lines: list[str] = []
    soft: list[tuple[int, int]] = []
    id_ = next_id(model.deck, "element")
    for finding in result["findings"]:
        where = finding["location"]
        values = {name: v["value"] for name, v in finding["parameters"].items()}
        words = ", ".join(
            f"{name} = {value} {finding['parameters'][name]['unit']}".strip() for name, value in values.items()
        )
        at = " ".join(filter(None, (", ".join(str(n) for n in where["nodes"]), where["direction"])))
        name = finding["physics"] or "unnamed"
        words = words or finding.get("class", "")
        cards = _term(id_, finding["physics"], where, values)
        springs = _springs(finding["physics"], where, values)
        cards += [f"CELAS2,{id_ + i},{k:.6E},{node},{component}" for i, (node, component, k) in enumerate(springs)]
        id_ += len(cards)
        soft += [(node, component) for node, component, _ in springs]
        lines += [
            f"$ femend: {name} at node {at} to {where['to'] or 'nothing'}",
            f"$ femend: {words}",
            *cards,
        ]
    return lines + (_supports(model, soft) if soft else [])


def _springs(physics: str, where: dict[str, Any], values: dict[str, Any]) -> list[tuple[int, int, float]]:
    """(node, component, stiffness) of the springs under a clamp, told as k1 to k6."""
    if physics != "compliant_support" or len(where["nodes"]) != 1:
        return []
    return [(where["nodes"][0], int(name[1:]), k) for name, k in values.items() if name in DIRECTIONS]


def _supports(model: Model, soft: Sequence[tuple[int, int]]) -> list[str]:
    """An SPC set like the deck's own without the (node, component) that stand on springs; nothing else in the deck can
    let go of them, since what case control selects stays as it is."""
    free = model.unsupported
    by_node: dict[int, str] = {}
    for row in held_rows(free, model).tolist():
        node, component = int(free.fe.dof_nodes[row]), int(free.fe.dof_components[row])
        if (node, component) not in soft:
            by_node[node] = by_node.get(node, "") + str(component)
    set_ = next(i for i in range(FIRST_SET, FIRST_SET + len(model.node_ids) + 2) if not _is_set(model, i))
    lines = [
        "$ femend: springs under held nodes do nothing; to stand on them,",
        f"$ femend: select SPC = {set_} in case control",
    ]
    for components in sorted(set(by_node.values())):
        nodes = sorted(n for n, c in by_node.items() if c == components)
        for i in range(0, len(nodes), NODES_A_LINE):
            at = ",".join(str(n) for n in nodes[i : i + NODES_A_LINE])
            lines.append(f"SPC1,{set_},{components},{at}")
    return lines


def _is_set(model: Model, id_: int) -> bool:
    try:
        model_of(model.deck, units=model.units, spc=id_)
    except DeckError:
        return False
    return True


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
