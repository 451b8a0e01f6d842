"""Rods as places: each bar of a truss may be weaker than it is drawn, and two of its joints may be joined by one that
the deck does not have."""

from __future__ import annotations

from femend.model.model import Model

__all__ = ["struts"]

# cards that carry a force along their line alone
_RODS = ("CROD", "CONROD")
# structure of which a rod along it is a part, by the beginnings of its cards
_BODIES = ("CBAR", "CBEAM", "CQUAD", "CTRIA", "CHEXA", "CPENTA", "CTETRA", "CPYRAM")


def struts(model: Model) -> dict[int, tuple[int, int]]:
    """Nodes of each rod by its element id.

    Without those along an edge or a diagonal of a shell or solid or beside a beam: they stiffen what is there, and are
    weak with it.
    """
    elements = model.fe.elements()
    rods = {eid: (nodes[0], nodes[1]) for eid, card, nodes in elements if card in _RODS}
    if not rods:
        return rods
    at: dict[int, set[int]] = {}
    for i, (_, card, nodes) in enumerate(elements):
        if card.startswith(_BODIES):
            for node in nodes:
                at.setdefault(node, set()).add(i)
    nothing: set[int] = set()
    return {eid: (a, b) for eid, (a, b) in rods.items() if not at.get(a, nothing) & at.get(b, nothing)}
