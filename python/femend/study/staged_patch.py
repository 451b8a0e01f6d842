"""The updated deck of a staged study: changed fields, and the terms as cards."""

from __future__ import annotations

import numpy as np

from femend.diagnose.staged import Flow, Setup
from femend.errors import DeckError
from femend.io.deck import FieldChange, next_id
from femend.model.linear_terms import LinearTerm
from femend.study.patch import deck_changes

__all__ = ["staged_cards", "staged_changes"]

_ROTATIONS = {"k_rot_x": 7, "k_rot_y": 8, "k_rot_z": 9}
_INERTIA = {"I11": 12, "I22": 14, "I33": 17}
_AXES = {"x": 1, "y": 2, "z": 3, "rx": 4, "ry": 5, "rz": 6}


def staged_changes(setup: Setup, flow: Flow) -> list[FieldChange]:
    """Factors of parameters and inertias where they stand, and rotational stiffnesses of springs that bend (PBUSH)."""
    posterior = flow.posterior
    factors = {p.name: {"factor": posterior.values[posterior.unknowns.index(p.name)]} for p in setup.free.parameters}
    changes = deck_changes(setup.free, factors)
    for term in flow.terms:
        for name, value in _values(flow, term).items():
            if term.physics == "spring_bending" and name in _ROTATIONS and term.property_id is not None:
                changes += _field(setup, "PBUSH", term.property_id, _ROTATIONS[name], value, 1.0)
            if term.name.startswith("inertia of mass") and name in _INERTIA:
                eid = int(term.name.rsplit(" ", 1)[1])
                changes += _field(setup, "CONM2", eid, _INERTIA[name], value, None)
    return changes


def _field(setup: Setup, card: str, id_: int, field: int, value: float, old: float | None) -> list[FieldChange]:
    """One change, `value` itself or times what stands there where `old` is None; none where the field is blank."""
    try:
        text = setup.free.deck.field_text(card, id_, field).strip()
    except DeckError:
        return []
    if not text:
        return []
    return [FieldChange(card, id_, field, value * (float(text) if old is None else 1.0))]


def _values(flow: Flow, term: LinearTerm) -> dict[str, float]:
    posterior = flow.posterior
    return {
        u.name.split(": ")[-1].split(" [")[0]: float(posterior.values[posterior.unknowns.index(u.name)])
        for u in term.unknowns
        if u.name in posterior.unknowns.names
    }


def staged_cards(setup: Setup, flow: Flow) -> list[str]:
    """Bulk-data lines for the terms, each with its description as comments."""
    lines: list[str] = []
    element = next_id(setup.free.deck, "element")
    for term in flow.terms:
        values = _values(flow, term)
        if term.name.startswith("inertia of mass"):
            continue
        words = ", ".join(f"{k} = {v:.6g}" for k, v in values.items())
        where = f" in {', '.join(term.configurations)}" if term.configurations else ""
        lines += _comment(f"{term.physics}: {term.name}{where}; {words}")
        cards, element = _cards(setup, term, values, element)
        lines += cards
    return lines


def _comment(text: str, width: int = 70) -> list[str]:
    out, line = [], ""
    for word in text.split():
        if len(line) + len(word) + 1 > width:
            out.append(f"$ femend: {line}")
            line = ""
        line = f"{line} {word}".strip()
    return [*out, f"$ femend: {line}"]


def _cards(setup: Setup, term: LinearTerm, values: dict[str, float], element: int) -> tuple[list[str], int]:
    if term.physics == "compliant_support":
        return _support(setup, term, values, element)
    if term.physics == "added_mass":
        count = {n: 1 for n in term.nodes}
        lines = [f"CONM2,{element + i},{n},,{values['m'] * count[n]:.6E}" for i, n in enumerate(term.nodes)]
        return lines, element + len(lines)
    if term.physics == "support_stiffness":
        component = "XYZ".index(term.direction) + 1
        return [f"CELAS2,{element},{values['k']:.6E},{term.nodes[0]},{component}"], element + 1
    if term.physics == "spring_bending":
        return _comment("k_rot stand in PBUSH K4 to K6; the coupling has no field there"), element
    if term.physics in ("gyroscopic", "speed_stiffness"):
        return _comment("no card of a deck at rest; it acts with the speed of rotation"), element
    return _comment("no card; change the element's property"), element


def _support(setup: Setup, term: LinearTerm, values: dict[str, float], element: int) -> tuple[list[str], int]:
    """Springs and dashpots to ground under every node; they work where the SPC set leaves the region free."""
    region = next((r for rs in setup.regions.values() for r in rs if r.nodes == term.nodes), None)
    if region is None:
        return [], element
    share = region.areas if region.area > 0 else np.ones(len(region.nodes))
    lines = _comment(
        "springs under held nodes do nothing; to stand on them, select an SPC set (or SPC = 0) without these nodes"
    )
    for node, part in zip(region.nodes, share, strict=True):
        for axis, component in _AXES.items():
            for letter, card in (("k", "CELAS2"), ("c", "CDAMP2")):
                value = values.get(f"{letter}_{axis}")
                if value is not None:
                    lines.append(f"{card},{element},{value * part:.6E},{node},{component}")
                    element += 1
    return lines, element
