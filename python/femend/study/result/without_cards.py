"""What is found and no card of the updated deck holds: sentences that say so, and how it is put in by hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from femend.numerals import listed
from femend.physics import CATALOGUE
from femend.report.entries import mapping
from femend.report.words import by_importance, law_of, parameter_text, physics_name, place_text

__all__ = ["LACKS", "without_cards"]

# how such a sentence begins
LACKS = "the updated deck does not contain"
# elements that are named one by one
NAMED = 6


def without_cards(finding: Mapping[str, Any]) -> str:
    """That the updated deck lacks a `finding` of result.json that got no cards, which it is, and what to do; empty for
    a load, which is no part of a deck, and for what has no values that could be put in."""
    law = law_of(finding)
    parameters, where = mapping(finding.get("parameters")), mapping(finding.get("location"))
    entry = CATALOGUE.get(law)
    if not law or not parameters or finding.get("class") or (entry is not None and entry.family == "load"):
        return ""
    told = [parameter_text(name, value, law, with_sd=False) for name, value in by_importance(parameters)]
    values = ", ".join(" ".join(one) for one in told)
    what = f"{physics_name(law, parameters)} {place_text(where, law)}, {values}"
    linear = entry is not None and entry.kind == "linear"
    do = _by_hand(law, where, parameters) if linear else _NONLINEAR
    return f"{LACKS} what was found ({what}), which stands there as a comment: {do}"


_NONLINEAR = (
    "the cards of Nastran's linear solutions hold no such law; what is computed with that deck is the structure "
    "without it, so put it into the program that simulates the responses, with the values of result.json"
)


def _by_hand(law: str, where: Mapping[str, Any], parameters: Mapping[str, Any]) -> str:
    """How a linear law is put into the deck that no added card holds."""
    if "factor" in parameters:
        nodes = [str(node) for node in where.get("nodes") or ()]
        elements = listed(where.get("elements") or (), NAMED)
        of = f"elements {elements}" if elements else f"the elements between nodes {' and '.join(nodes)}"
        return (
            f"give {of} a property of their own with that factor on its stiffness (the moduli of a material of their "
            "own; K of a bush or spring)"
        )
    if str(where.get("to") or "").startswith("member"):
        turns = "about all three axes" if where.get("direction") == "R" else f"in {where.get('direction')}"
        node = next(iter(where.get("nodes") or ()), "")
        return (
            f"no card added beside the others opens a connection; let the element of that member end at a node of its "
            f"own, at the place of node {node}, and join the two by a CBUSH (along the element's axes) with that "
            f"stiffness {turns} and by RBE2 or MPC in the other components"
        )
    if law == "compliant_support":
        return (
            "free its nodes from their SPC, join them by an RBE2 to a node of its own in their middle, and hold that "
            "to ground by CELAS2 of these stiffnesses"
        )
    return (
        "put it in by hand (CELAS2, CDAMP2, CONM2, or CBUSH), where its direction is no axis of the nodes' "
        "displacement systems in a coordinate system along it"
    )
