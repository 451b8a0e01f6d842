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
    rods: dict[int, tuple[int, int]] = {}
    at: dict[int, set[int]] = {}
    for i, (eid, card, nodes) in enumerate(model.fe.elements()):
        if card in _RODS:
            rods[eid] = (nodes[0], nodes[1])
        elif card.startswith(_BODIES):
            for node in nodes:
                at.setdefault(node, set()).add(i)
    nothing: set[int] = set()
    return {eid: (a, b) for eid, (a, b) in rods.items() if not at.get(a, nothing) & at.get(b, nothing)}
