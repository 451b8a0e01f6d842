"""Connections as places: a bush or spring of the deck may be softer or stiffer than it is drawn, or no spring at all.

Bolts, bearings and mounts are bushes and springs in most decks. Each is a place with a factor on its whole stiffness,
and so are all of one property together; between the two nodes of each, along their line and along the axes, whatever
else acts there is looked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.pair_places import Between
from femend.model.place import Place
from femend.model.region_places import scaled_by

__all__ = ["connection_places"]

# cards of connections, by their beginnings
_CARDS = ("CBUSH", "CELAS")
# connections whose nodes are tried as pairs too, those of the deck's first; all have a factor
MAX_PAIRS = 200


def connection_places(model: Model, held: NDArray[np.bool_], known: Sequence[Place] = ()) -> list[Place]:
    """Factors on the stiffness of every connection and of all of one property, and the pairs of their nodes, but for
    those of places `known`; `held` (n_g,) are the DOFs of the g-set that cannot move. What a parameter scales by itself
    has no factor beside it."""
    found = list(_connections(model))
    scaled = {eid: scaled_by(model, eid) for eid, _, _ in found}
    covered = [{eid for eid, by in scaled.items() if by == i} for i in range(len(model.parameters))]
    places = [place for place in _factors(found, scaled) if set(place.elements) not in covered]
    had = {(frozenset(p.nodes), p.direction) for p in known if p.kind == "pair"}
    return places + [p for p in _pairs(model, held, found) if (frozenset(p.nodes), p.direction) not in had]


def _connections(model: Model) -> Iterator[tuple[int, int, tuple[int, ...]]]:
    """Id, property (0 without one) and nodes of every connection that has a stiffness."""
    property_of = {eid: pid or 0 for eid, _, pid, _ in model.deck.elements()}
    ones = np.ones(len(model.parameters))
    for eid, card, nodes in model.fe.elements():
        ends = tuple(dict.fromkeys(n for n in nodes if n))
        if eid and ends and card.startswith(_CARDS) and np.any(model.fe.element_matrices(eid, ones)[1]):
            yield eid, property_of.get(eid, 0), ends


def _factors(found: Sequence[tuple[int, int, tuple[int, ...]]], scaled: Mapping[int, int | None]) -> Iterator[Place]:
    """A factor on each connection, and on all of each property that has several with the same parameter; `scaled` is
    the parameter that scales each."""
    for eid, _, nodes in found:
        words = f"between nodes {nodes[0]} and {nodes[1]}" if len(nodes) > 1 else f"of node {nodes[0]} to ground"
        label = f"connection {eid} {words}"
        to = str(nodes[1]) if len(nodes) > 1 else "ground"
        yield Place("connection", nodes[:2], "", to, elements=(eid,), label=label, parameter=scaled[eid])
    for pid in sorted({pid for _, pid, _ in found if pid}):
        own = [(eid, nodes) for eid, p, nodes in found if p == pid]
        if len(own) > 1 and len({scaled[eid] for eid, _ in own}) == 1:
            nodes = tuple(dict.fromkeys(ends[0] for _, ends in own))
            yield Place(
                "connection", nodes, "", "", elements=tuple(eid for eid, _ in own),
                label=f"all {len(own)} connections of property {pid}", parameter=scaled[own[0][0]],
            )  # fmt: skip


def _pairs(model: Model, held: NDArray[np.bool_], found: Sequence[tuple[int, int, tuple[int, ...]]]) -> Iterator[Place]:
    """The two nodes of each connection, moving along the line between them and along the axes."""
    between = Between.of(model, held)
    seen: set[frozenset[int]] = set()
    for _, _, nodes in found[:MAX_PAIRS]:
        if len(nodes) != 2 or frozenset(nodes) in seen or (between.fixed(nodes[0]) and between.fixed(nodes[1])):
            continue
        seen.add(frozenset(nodes))
        for place in (between.along_line(*nodes), *(between.along_axis(*nodes, c) for c in range(3))):
            if place is not None:
                yield place
