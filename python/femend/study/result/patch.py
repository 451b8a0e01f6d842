"""The updated deck: parameters changed where they stand, the new term added at the end."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femend.errors import DeckError
from femend.io.deck import next_id
from femend.model import Model, model_of
from femend.model.cards.card_mass import mass_of_card
from femend.model.patched.deck_changes import deck_changes
from femend.model.terms.supports import held_rows
from femend.report.vocabulary import DIRECTIONS
from femend.study.result.damped_cards import Ids, damped_cards
from femend.study.result.without_cards import without_cards

__all__ = ["cards_told", "deck_cards", "deck_changes", "on_new_supports"]

# where ids of SPC sets that the deck does not have are looked for, and the nodes of an SPC1 in one line
FIRST_SET, NODES_A_LINE = 900001, 6
# components of a node by their axes
_AXES = {"X": 1, "Y": 2, "Z": 3}
# SPC in case control, with what stands before and after the set's id
_SELECTS = re.compile(rb"^([ \t]*SPC[ \t]*=[ \t]*)(\d+)(?=[ \t]*(?:\$|\r?$))", re.IGNORECASE | re.MULTILINE)
_BULK = re.compile(rb"^[ \t]*BEGIN[ \t]+BULK|^[ \t]*BEGIN[ \t]*=[ \t]*BULK", re.IGNORECASE | re.MULTILINE)


def deck_cards(model: Model, result: dict[str, Any]) -> list[str]:
    """Bulk-data lines for the new terms: cards where Nastran has some that fit, their descriptions as comments."""
    lines: list[str] = []
    for finding, cards in _terms(model, result):
        where = finding["location"]
        values = {name: v["value"] for name, v in finding["parameters"].items()}
        words = ", ".join(
            f"{name} = {value} {finding['parameters'][name]['unit']}".strip() for name, value in values.items()
        )
        name = finding["physics"] or "unnamed"
        words = words or finding.get("class", "")
        of = f" (elements {', '.join(map(str, where['elements']))})" if where.get("elements") else ""
        told = filter(None, [f"{name} {_place(where)}{of}", words])
        lines += [*(f"$ femend: {line}" for line in told), *cards]
    soft = _soft(result)
    return lines + (_supports(model, soft) if soft else [])


def _terms(model: Model, result: dict[str, Any]) -> Iterator[tuple[dict[str, Any], list[str]]]:
    """Every finding with its cards; none where none fit."""
    id_, pid, point = (next_id(model.deck, kind) for kind in ("element", "property", "node"))
    for finding in result["findings"]:
        where = finding["location"]
        values = {name: v["value"] for name, v in finding["parameters"].items()}
        cards = _term(model, Ids(id_, pid, point), finding["physics"], where, values)
        springs = _springs(finding["physics"], where, values)
        cards += [f"CELAS2,{id_ + i},{k:.6E},{node},{component}" for i, (node, component, k) in enumerate(springs)]
        id_, pid, point = id_ + len(cards), pid + 1, point + sum(card.startswith("SPOINT") for card in cards)
        yield finding, cards


def cards_told(model: Model, result: dict[str, Any]) -> list[str]:
    """Sentences on what the lines of `deck_cards` do not do: findings that have no cards, and springs under nodes that
    the deck's own SPC set goes on to hold."""
    told = [without_cards(finding) for finding, cards in _terms(model, result) if not cards]
    if _soft(result) and not _selects(Path(model.deck.path).read_bytes(), model):
        told.append(
            "the springs under held nodes that were added to the updated deck do nothing until case control selects "
            f"SPC set {_new_set(model)} of it, which leaves these nodes to them"
        )
    return list(filter(None, told))


def _place(where: dict[str, Any]) -> str:
    """Where a finding is, as its comment says it; a place between two nodes has both, and is told "to" the second."""
    nodes, direction = where["nodes"], f" {where['direction']}" if where["direction"] else ""
    if len(nodes) == 2 and where["to"] == str(nodes[1]):
        return f"between nodes {nodes[0]} and {nodes[1]}{direction}"
    at = "at node" if len(nodes) == 1 else "at nodes"
    if where.get("shares"):
        at = f"under {len(where['region'])} nodes between"
    return f"{at} {', '.join(str(n) for n in nodes)}{direction} to {where['to'] or 'nothing'}"


def on_new_supports(text: bytes, model: Model, result: dict[str, Any]) -> bytes:
    """The main file of the deck with case control selecting the SPC set of `deck_cards`, where there is one and its own
    case control selects what held the model; as it is otherwise."""
    if not _soft(result) or not _selects(text, model):
        return text
    end, new = _bulk(text), str(_new_set(model)).encode()
    return _SELECTS.sub(rb"\g<1>" + new, text[:end]) + text[end:]


def _soft(result: dict[str, Any]) -> list[tuple[int, int]]:
    """(node, component) of held DOFs that stand on springs now."""
    return [
        (node, component)
        for finding in result["findings"]
        for node, component, _ in _springs(
            finding["physics"],
            finding["location"],
            {name: entry["value"] for name, entry in finding["parameters"].items()},
        )
    ]


def _bulk(text: bytes) -> int:
    found = _BULK.search(text)
    return found.start() if found else 0


def _selects(text: bytes, model: Model) -> bool:
    """Whether the file's case control is what selects the one SPC set that the model is held by."""
    return model.spc is None and len({m[2] for m in _SELECTS.finditer(text[: _bulk(text)])}) == 1


def _new_set(model: Model) -> int:
    return next(i for i in range(FIRST_SET, FIRST_SET + len(model.node_ids) + 2) if not _is_set(model, i))


def _springs(physics: str, where: dict[str, Any], values: dict[str, Any]) -> list[tuple[int, int, float]]:
    """(node, component, stiffness) of the springs under a clamp, told as k1 to k6."""
    if physics != "compliant_support" or len(where["nodes"]) != 1:
        return []
    return [(where["nodes"][0], int(name[1:]), k) for name, k in values.items() if name in DIRECTIONS]


def _supports(model: Model, soft: Sequence[tuple[int, int]]) -> list[str]:
    """An SPC set like the deck's own without the (node, component) that stand on springs: no card can let go of what
    another holds."""
    free = model.unsupported
    by_node: dict[int, str] = {}
    for row in held_rows(free, model).tolist():
        node, component = int(free.fe.dof_nodes[row]), int(free.fe.dof_components[row])
        if (node, component) not in soft:
            by_node[node] = by_node.get(node, "") + str(component)
    set_ = _new_set(model)
    lines = (
        [f"$ femend: SPC set {set_}, which case control selects now, leaves these DOFs to the springs"]
        if _selects(Path(model.deck.path).read_bytes(), model)
        else [f"$ femend: springs under held nodes do nothing; to stand on them, select SPC set {set_}"]
    )
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


def _term(model: Model, ids: Ids, physics: str, where: dict[str, Any], values: dict[str, Any]) -> list[str]:
    """Cards of a linear term, or of the springs of a bedding, with the first `ids` that are free; none where none
    fit."""
    if where.get("shares"):
        return _bedding(model, ids.element, where, values["k"])
    if where.get("each"):
        return _in_each(model, ids, physics, where, values)
    if len(where["nodes"]) == 2:
        return _between(model, ids, physics, where, values)
    id_ = ids.element
    if len(where["nodes"]) != 1 or where["to"] != "ground" or where["direction"] not in _AXES:
        return []
    node, component = where["nodes"][0], _AXES[where["direction"]]
    if physics == "support_stiffness":
        return [f"CELAS2,{id_},{values['k']:.6E},{node},{component}"]
    if physics == "viscous_damper":
        return [f"CDAMP2,{id_},{values['c']:.6E},{node},{component}"]
    if physics == "added_mass":
        return [f"CONM2,{id_},{node},,{values['m'] / mass_of_card(model.deck):.6E}"]
    return damped_cards(ids, physics, values, (node, component), mass=mass_of_card(model.deck))


def _bedding(model: Model, id_: int, where: dict[str, Any], k: float) -> list[str]:
    """Springs to ground under all nodes of a bedding, of its stiffness `k` in all; none where displacements of a node
    are not told along the basic axes."""
    nodes, component = where["region"], _AXES[where["direction"]]
    if not all(np.array_equal(model.frames[model.index(n)], np.eye(3)) for n in nodes):
        return []
    each = enumerate(zip(nodes, where["shares"], strict=True))
    return [f"CELAS2,{id_ + i},{k * share:.6E},{n},{component}" for i, (n, share) in each]


def _in_each(model: Model, ids: Ids, physics: str, where: dict[str, Any], values: dict[str, Any]) -> list[str]:
    """Cards of a linear law in each of several connections to ground; none of connections between nodes, whose other
    ends are not told."""
    cards: list[str] = []
    law = "support_stiffness" if physics == "joint_stiffness" else physics
    for i, node in enumerate(where["nodes"] if where["to"] == "ground" else ()):
        own = Ids(ids.element + len(cards), ids.property, ids.point + i)
        cards += _term(model, own, law, {"nodes": [node], "to": "ground", "direction": where["direction"]}, values)
    return cards


def _between(model: Model, ids: Ids, physics: str, where: dict[str, Any], values: dict[str, Any]) -> list[str]:
    """Cards of a linear law between two nodes: a bush along the line between them for a spring or dashpot, scalar
    elements along a basic axis, where both nodes' displacements are told along it."""
    id_, pid, (a, b) = ids.element, ids.property, where["nodes"]
    if where["to"] != str(b):
        return []
    at = model.index(a), model.index(b)
    kinds = {"support_stiffness": ("K", "CELAS2", "k"), "viscous_damper": ("B", "CDAMP2", "c")}
    if where["direction"] in _AXES and all(np.array_equal(model.frames[i], np.eye(3)) for i in at):
        component = _AXES[where["direction"]]
        if physics not in kinds:
            return damped_cards(ids, physics, values, (a, component), (b, component))
        _, scalar, name = kinds[physics]
        return [f"{scalar},{id_},{values[name]:.6E},{a},{component},{b},{component}"]
    if physics not in kinds or where["direction"] or not np.any(model.xyz[at[0]] != model.xyz[at[1]]):
        return []
    kind, _, name = kinds[physics]
    return [f"CBUSH,{id_},{pid},{a},{b}", f"PBUSH,{pid},{kind},{values[name]:.6E}"]
