"""Connections as places: a bush or spring of the deck may be softer or stiffer than it is drawn, or no spring at all.

Bolts, bearings and mounts are bushes and springs in most decks. Each is a place with a factor on its whole stiffness,
and so are all of one property, or all as stiff, together; between the two nodes of each, along their line and along the
axes, whatever else acts there is looked for. What rubber or wire does it does in every mount of a kind: one law in all
that are alike, along an axis, is a place too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.places.pair_places import Between
from femend.model.places.place import AXES, Place
from femend.model.places.region_places import scaled_by

__all__ = ["connection_places"]

FloatArray = NDArray[np.float64]

# cards of connections, by their beginnings
_CARDS = ("CBUSH", "CELAS")
# connections whose nodes are tried as pairs too, those of the deck's first; all have a factor
MAX_PAIRS = 200
# alike connections that have a law together: as many coordinates as a simulation carries
MOST_ALIKE = 6
# share of the largest stiffness by which those of alike connections differ at most, and below which there is none
ALIKE = 1e-6


def connection_places(model: Model, held: NDArray[np.bool_], known: Sequence[Place] = ()) -> list[Place]:
    """Factors on the stiffness of every connection and of all of one property, and the pairs of their nodes, but for
    those of places `known`; `held` (n_g,) are the DOFs of the g-set that cannot move. What a parameter scales by itself
    has no factor beside it."""
    found = list(_connections(model))
    scaled = {one.eid: scaled_by(model, one.eid) for one in found}
    covered = [{eid for eid, by in scaled.items() if by == i} for i in range(len(model.parameters))]
    groups = _alike(model, found)
    places = [place for place in _factors(found, groups, scaled) if set(place.elements) not in covered]
    places += _together(model, held, groups)
    had = {(frozenset(p.nodes), p.direction) for p in known if p.kind == "pair"}
    return places + [p for p in _pairs(model, held, found) if (frozenset(p.nodes), p.direction) not in had]


@dataclass(frozen=True, eq=False)
class _Connection:
    """A bush or spring: id, property (0 without one), nodes, and stiffness (n, n) along the DOFs `rows` (n,) of the
    g-set."""

    eid: int
    pid: int
    nodes: tuple[int, ...]
    rows: NDArray[np.int64]
    stiffness: FloatArray


def _connections(model: Model) -> Iterator[_Connection]:
    """Every connection that has a stiffness."""
    property_of = {eid: pid or 0 for eid, _, pid, _ in model.deck.elements()}
    ones = np.ones(len(model.parameters))
    for eid, card, nodes in model.fe.elements():
        ends = tuple(dict.fromkeys(n for n in nodes if n))
        if eid and ends and card.startswith(_CARDS):
            rows, stiffness, _ = model.fe.element_matrices(eid, ones)
            if np.any(stiffness):
                yield _Connection(eid, property_of.get(eid, 0), ends, rows, stiffness)


def _alike(model: Model, found: Sequence[_Connection]) -> list[tuple[str, list[_Connection]]]:
    """Connections that are alike, what they have in common in words and as they are: several of one property, and
    several of different ones that have one stiffness, since many decks give every mount a property of its own."""
    groups: list[tuple[str, list[_Connection]]] = []
    of_property: dict[int, list[_Connection]] = {}
    for one in found:
        of_property.setdefault(one.pid, []).append(one)
    for pid, own in sorted(of_property.items()):
        if pid and len(own) > 1:
            groups.append((f"of property {pid}", own))
    taken = {one.eid for _, own in groups for one in own}
    size = np.array([np.abs(one.stiffness).max() for one in found])
    order = np.argsort(size, kind="stable")
    rising = size[order]
    for first, largest in zip(found, size, strict=True):
        # stiffnesses that are equal have equal largest values, so that only these need to be compared
        near = np.searchsorted(rising, [largest * (1 - 2 * ALIKE), largest * (1 + 2 * ALIKE)])
        close = [found[i] for i in np.sort(order[slice(*near)])] if first.eid not in taken else []
        own = [one for one in close if one.eid not in taken and _equal(first.stiffness, one.stiffness)]
        taken.update(one.eid for one in own)
        if len(own) > 1:
            groups.append((f"as stiff as {own[0].eid}", own))
    return groups


def _equal(a: FloatArray, b: FloatArray) -> bool:
    return a.shape == b.shape and bool(np.abs(a - b).max() <= ALIKE * np.abs(a).max())


def _factors(
    found: Sequence[_Connection], groups: Sequence[tuple[str, list[_Connection]]], scaled: Mapping[int, int | None]
) -> Iterator[Place]:
    """A factor on each connection, and on all of each of the `groups` with the same parameter; `scaled` is the
    parameter that scales each."""
    for one in found:
        nodes = one.nodes
        words = f"between nodes {nodes[0]} and {nodes[1]}" if len(nodes) > 1 else f"of node {nodes[0]} to ground"
        to = str(nodes[1]) if len(nodes) > 1 else "ground"
        label = f"connection {one.eid} {words}"
        yield Place("connection", nodes[:2], "", to, elements=(one.eid,), label=label, parameter=scaled[one.eid])
    for words, own in groups:
        if len({scaled[one.eid] for one in own}) == 1:
            nodes = tuple(dict.fromkeys(one.nodes[0] for one in own))
            elements, parameter = tuple(one.eid for one in own), scaled[own[0].eid]
            label = f"all {len(own)} connections {words}"
            yield Place("connection", nodes, "", "", elements=elements, label=label, parameter=parameter)


def _together(
    model: Model, held: NDArray[np.bool_], groups: Sequence[tuple[str, list[_Connection]]]
) -> Iterator[Place]:
    """Those connections of each of the `groups` that are stiff along a basic axis (a mount may be three single springs)
    moving along it, each by its own motion, `held` (n_g,) as of `connection_places`."""
    between = Between.of(model, held)
    for words, own in groups:
        for c in range(3):
            stiff = [one for one in own if _stiff(model, one, c)]
            if not 2 <= len(stiff) <= MOST_ALIKE or any(len(one.nodes) != len(stiff[0].nodes) for one in stiff):
                continue
            each = [between.opening(one.nodes, c) for one in stiff]
            rows, values = [at for at, _ in each if len(at)], [by for at, by in each if len(at)]
            if len(rows) == len(stiff):
                elements, nodes = tuple(one.eid for one in stiff), tuple(dict.fromkeys(one.nodes[0] for one in stiff))
                to = "ground" if len(stiff[0].nodes) == 1 else ""
                count = f"all {len(own)}" if len(stiff) == len(own) else f"{len(stiff)} of the {len(own)}"
                yield Place(
                    "bushes", nodes, AXES[c], to, tuple(rows), tuple(values), elements=elements,
                    label=f"{count} connections {words}, {AXES[c]}",
                )  # fmt: skip


def _stiff(model: Model, one: _Connection, c: int) -> bool:
    """Whether a connection resists its first node's motion along basic axis c."""
    first = model.index(one.nodes[0])
    along = np.zeros(len(one.rows))
    own = np.flatnonzero((one.rows // 6 == first) & (one.rows % 6 < 3))
    along[own] = model.frames[first][one.rows[own] % 6, c]
    return float(along @ one.stiffness @ along) > ALIKE * float(np.abs(one.stiffness).max())


def _pairs(model: Model, held: NDArray[np.bool_], found: Sequence[_Connection]) -> Iterator[Place]:
    """The two nodes of each connection, moving along the line between them and along the axes."""
    between = Between.of(model, held)
    seen: set[frozenset[int]] = set()
    for nodes in (one.nodes for one in found[:MAX_PAIRS]):
        if len(nodes) != 2 or frozenset(nodes) in seen or (between.fixed(nodes[0]) and between.fixed(nodes[1])):
            continue
        seen.add(frozenset(nodes))
        for place in (between.along_line(*nodes), *(between.along_axis(*nodes, c) for c in range(3))):
            if place is not None:
                yield place
