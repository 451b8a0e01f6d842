"""The updated deck of a staged study: changed fields, and the terms as cards."""

from __future__ import annotations

from femend.diagnose.staged import Flow, Setup
from femend.errors import DeckError
from femend.io.deck import FieldChange, next_id, patch_deck
from femend.model.cards.card_mass import mass_of_card
from femend.model.cards.real_field import real
from femend.model.cards.section_fields import bush_fields
from femend.model.terms.linear_terms import LinearTerm
from femend.numerals import plain
from femend.study.result.patch import deck_changes
from femend.study.result.without_cards import LACKS

__all__ = ["staged_cards", "staged_changes", "staged_factors", "staged_told"]

_ROTATIONS = {"k_rot_x": "k4", "k_rot_y": "k5", "k_rot_z": "k6"}
_INERTIA = {"I11": 12, "I22": 14, "I33": 17}
_AXES = {"x": 1, "y": 2, "z": 3, "rx": 4, "ry": 5, "rz": 6}


def staged_changes(setup: Setup, flow: Flow) -> list[FieldChange]:
    """Factors of parameters and inertias where they stand, and rotational stiffnesses of springs that bend (PBUSH)."""
    changes = deck_changes(setup.free, {name: {"factor": f} for name, f in staged_factors(setup, flow).items()})
    for term in flow.terms:
        if term.physics == "spring_bending":
            changes += _rotations(setup, term, _values(flow, term))
        for name, value in _values(flow, term).items():
            if term.name.startswith("inertia of mass") and name in _INERTIA:
                eid = int(term.name.rsplit(" ", 1)[1])
                changes += _scaled(setup, "CONM2", eid, _INERTIA[name], value)
    return changes


def staged_factors(setup: Setup, flow: Flow) -> dict[str, float]:
    """Factors of the deck's parameters by name."""
    posterior = flow.posterior
    return {p.name: float(posterior.values[posterior.unknowns.index(p.name)]) for p in setup.free.parameters}


def _rotations(setup: Setup, term: LinearTerm, values: dict[str, float]) -> list[FieldChange]:
    """K4 to K6 of the springs' property, as far as the card has columns for them."""
    deck, pid, changes = setup.free.deck, term.property_id, []
    for name in (n for n in values if n in _ROTATIONS and pid is not None):
        for field in bush_fields(deck, int(pid or 0), _ROTATIONS[name]):
            change = FieldChange("PBUSH", int(pid or 0), field, values[name])
            try:
                patch_deck(deck, [change])
            except DeckError:  # the line ends before the field
                continue
            changes.append(change)
    return changes


def _scaled(setup: Setup, card: str, id_: int, field: int, factor: float) -> list[FieldChange]:
    """What stands in a field times `factor`; no change where it is blank."""
    try:
        text = setup.free.deck.field_text(card, id_, field).strip()
    except DeckError:
        return []
    return [FieldChange(card, id_, field, real(text) * factor)] if text else []


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


def staged_told(setup: Setup, flow: Flow) -> list[str]:
    """Sentences on what the lines of `staged_cards` do not hold of the terms, and on springs under held nodes."""
    return [said for term in flow.terms if (said := _told(setup, term, _values(flow, term)))]


def _told(setup: Setup, term: LinearTerm, values: dict[str, float]) -> str:
    label = term.label or term.name
    if term.physics == "compliant_support" and _support(setup, term, values, 1)[0]:
        return (
            f"springs and dashpots of the {label}, which were added to the updated deck, do nothing until case control "
            "selects an SPC set (or SPC = 0) without these nodes"
        )
    if term.physics == "spring_bending":
        lost, pid = _lost(setup, term, values), term.property_id
        parts = [f"{k} = {v} (put it into the K line of PBUSH {pid}, which has no columns for it)" for k, v in lost]
        if "coupling" in values:
            parts.append(
                f"the coupling of translation and rotation, {plain(values['coupling'])}, for which PBUSH has no field"
            )
        return f"{LACKS} all of the {label}; it lacks {' and '.join(parts)}" if parts else ""
    if term.physics in ("gyroscopic", "speed_stiffness"):
        return (
            f"{LACKS} the {label}, which acts with the speed of rotation and stands there as a comment: a deck at rest "
            "has no card for it, so put it into the rotor analysis with the values of result.json"
        )
    if term.physics in ("added_mass", "support_stiffness") or term.name.startswith("inertia of mass"):
        return ""
    return (
        f"{LACKS} what was found of the {label}, which stands there as a comment: give its element a property of its "
        f"own with {plain(next(iter(values.values()), 1.0))} times its stiffness (the moduli of a material of its own)"
    )


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
        mass = values["m"] / mass_of_card(setup.free.deck)
        lines = [f"CONM2,{element + i},{n},,{mass:.6E}" for i, n in enumerate(term.nodes)]
        return lines, element + len(lines)
    if term.physics == "support_stiffness":
        component = "XYZ".index(term.direction) + 1
        return [f"CELAS2,{element},{values['k']:.6E},{term.nodes[0]},{component}"], element + 1
    if term.physics == "spring_bending":
        return _comment(_where(setup, term, values)), element
    if term.physics in ("gyroscopic", "speed_stiffness"):
        return _comment("no card of a deck at rest; it acts with the speed of rotation"), element
    return _comment("no card; change the element's property"), element


def _where(setup: Setup, term: LinearTerm, values: dict[str, float]) -> str:
    """Where the stiffnesses of springs that bend stand, and which have to be put in by hand."""
    pid, lost = int(term.property_id or 0), _lost(setup, term, values)
    told = "k_rot stand in PBUSH K4 to K6; the coupling has no field there"
    if not lost:
        return told
    named = ", ".join(f"{k} = {v}" for k, v in lost)
    return f"PBUSH {pid} has no columns for {named}: put them into its K line by hand; the coupling has no field there"


def _lost(setup: Setup, term: LinearTerm, values: dict[str, float]) -> list[tuple[str, str]]:
    """Names (K4 to K6) and values of the rotational stiffnesses that the springs' property has no columns for."""
    written = {change.field for change in _rotations(setup, term, values)}
    pid = int(term.property_id or 0)
    return [
        (name.upper(), f"{values[key]:.6g}")
        for key, name in _ROTATIONS.items()
        if key in values and not written & set(bush_fields(setup.free.deck, pid, name))
    ]


def _support(setup: Setup, term: LinearTerm, values: dict[str, float], element: int) -> tuple[list[str], int]:
    """Springs and dashpots to ground under every node; they work where the SPC set leaves the region free."""
    lines = _comment(
        "springs under held nodes do nothing; to stand on them, select an SPC set (or SPC = 0) without these nodes"
    )
    for node, part in zip(term.nodes, term.shares, strict=True):
        for axis, component in _AXES.items():
            for letter, card in (("k", "CELAS2"), ("c", "CDAMP2")):
                value = values.get(f"{letter}_{axis}")
                if value is not None:
                    lines.append(f"{card},{element},{value * part:.6E},{node},{component}")
                    element += 1
    return lines, element
