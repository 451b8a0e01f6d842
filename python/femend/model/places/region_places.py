"""Regions of shells and solids as places: all elements of a property, connected pieces of them, and patches of these.

What is weak in a region is as a weak member is: the stiffness of its elements takes a factor. Patches are boxes that
stand side by side in a piece and overlap by half, of a half, a third and a quarter of its longest side.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from femend.model.model import Model
from femend.model.places.place import Place

__all__ = ["Group", "boxes", "pieces", "region_places", "scaled_by"]

FloatArray = NDArray[np.float64]
Elements = tuple[int, ...]

_CARDS = ("CQUAD", "CTRIA", "CHEXA", "CPENTA", "CTETRA", "CPYRAM")
# shares of a piece's longest side that patches are long
PATCHES = (2, 3, 4)
# elements from which on a piece is also taken in patches, and of the smallest patch
PARTED, FEWEST = 16, 4
# regions that are places: whole properties first, then pieces, then patches from the largest down
MAX_REGIONS = 400
# sides shorter than this share of the longest have no corners of their own
FLAT = 0.05


def region_places(model: Model) -> list[Place]:
    """Places where the stiffness of shells or solids may be off: every property, piece and patch (module docstring) but
    those that a parameter of the model covers exactly, at most `MAX_REGIONS`."""
    drawn = model.as_drawn
    groups = _groups(drawn)
    solid = {pid: own for pid, own in groups.items() if own.elements}
    covered = _of_parameters(drawn, groups)
    places: list[Place] = []
    taken: set[frozenset[int]] = set()
    for pid, elements, part in _regions(solid):
        key = frozenset(elements)
        if key in covered or key in taken:
            continue
        if len(places) == MAX_REGIONS:
            break
        taken.add(key)
        places.append(_place(model, solid[pid], pid, elements, unlikely=part))
    return places


@dataclass(frozen=True, eq=False)
class Group:
    """The shells and solids of one property with their nodes and middles `at` (n, 3), and `others` of that property."""

    elements: Elements
    nodes: tuple[tuple[int, ...], ...]
    at: FloatArray
    others: Elements = ()

    def some(self, which: Sequence[int]) -> Group:
        """Those at the positions `which`."""
        return Group(tuple(self.elements[i] for i in which), tuple(self.nodes[i] for i in which), self.at[list(which)])


def _groups(model: Model) -> dict[int, Group]:
    """Elements with stiffness by their property."""
    property_of = {eid: pid or 0 for eid, _, pid, _ in model.deck.elements()}
    found: dict[int, tuple[list[tuple[int, tuple[int, ...]]], list[int]]] = {}
    for eid, card, nodes in model.fe.elements():
        mine, others = found.setdefault(property_of.get(eid, 0), ([], []))
        if card.startswith(_CARDS):
            mine.append((eid, tuple(n for n in nodes if n)))
        else:
            others.append(eid)
    groups, xyz = {}, model.xyz
    for pid, (mine, others) in sorted(found.items()):
        at = np.array([xyz[[model.index(n) for n in nodes]].mean(axis=0) for _, nodes in mine]).reshape(-1, 3)
        groups[pid] = Group(tuple(e for e, _ in mine), tuple(n for _, n in mine), at, tuple(others))
    return groups


def _of_parameters(model: Model, groups: dict[int, Group]) -> set[frozenset[int]]:
    """The elements whose stiffness each parameter changes; elements of one property are all changed or none, where it
    does not name elements."""
    covered = set()
    ones = np.ones(len(model.parameters))
    for i, parameter in enumerate(model.parameters):
        changed: set[int] = set()
        factors = np.where(np.arange(len(ones)) == i, 2.0, 1.0)
        for group in groups.values():
            own = [*group.elements, *group.others]
            if parameter.target == "elements":
                changed.update(set(own).intersection(parameter.ids))
            elif any(_changes(model, kind[0], ones, factors) for kind in (group.elements, group.others) if kind):
                changed.update(own)
        covered.add(frozenset(changed))
    return covered


def _changes(model: Model, eid: int, ones: FloatArray, factors: FloatArray) -> bool:
    """Whether an element's stiffness changes with the parameters' `factors` (n_par,)."""
    if eid == 0:
        return False
    K, changed = (np.asarray(model.fe.element_matrices(eid, x)[1]) for x in (ones, factors))
    return not np.allclose(changed, K, rtol=1e-9, atol=1e-12 * np.abs(K).max(initial=0.0))


def _regions(groups: dict[int, Group]) -> Iterator[tuple[int, Elements, bool]]:
    """Property, elements, and whether it is a patch, of every region: the largest kinds first."""
    connected = {pid: [group.some(w) for w in pieces(group)] for pid, group in groups.items()}
    for pid, group in groups.items():
        yield pid, group.elements, False
    for pid, own in connected.items():
        for piece in own:
            yield pid, piece.elements, False
    for parts in PATCHES:
        for pid, own in connected.items():
            for piece in own:
                for patch in _cubes(piece, parts):
                    yield pid, patch, True


def pieces(group: Group) -> list[list[int]]:
    """Positions of the elements of each connected piece: those that share nodes."""
    names = {n: i for i, n in enumerate(sorted({n for nodes in group.nodes for n in nodes}))}
    element = np.repeat(np.arange(len(group.nodes)), [len(nodes) for nodes in group.nodes])
    node = np.array([names[n] for nodes in group.nodes for n in nodes], dtype=np.int64)
    size = len(group.nodes) + len(names)
    graph = coo_array((np.ones(len(node)), (element, len(group.nodes) + node)), shape=(size, size))
    labels = connected_components(graph, directed=False)[1][: len(group.nodes)]
    return [np.flatnonzero(labels == label).tolist() for label in np.unique(labels)]


def _cubes(piece: Group, parts: int) -> Iterator[Elements]:
    """Connected patches of a piece in boxes `parts` to its longest side, as near to cubes as they fill it."""
    sides = np.ptp(piece.at, axis=0)
    yield from boxes(piece, np.maximum(np.rint(sides / max(float(sides.max()), 1e-300) * parts), 1).astype(int))


def boxes(piece: Group, per_side: NDArray[np.int64]) -> Iterator[Elements]:
    """Connected patches of a piece in boxes that overlap by half, `per_side` (3,) of them side by side along each
    axis."""
    if len(piece.elements) < PARTED:
        return
    # the middles of the outer elements are half an element inside
    low, sides = piece.at.min(axis=0), np.ptp(piece.at, axis=0)
    share = np.clip((piece.at - low) / np.maximum(sides, 1e-300), 0.0, 1.0)
    steps = [np.arange(2 * n - 1) / (2 * n) for n in per_side]
    for start in product(*steps):
        first = np.array(start)
        inside = ((share >= first - 1e-9) & (share <= first + 1 / per_side + 1e-9)).all(axis=1)
        patch = piece.some(np.flatnonzero(inside).tolist())
        for which in pieces(patch) if len(patch.elements) else []:
            if len(which) >= FEWEST:
                yield patch.some(which).elements


def _place(model: Model, group: Group, pid: int, elements: Elements, *, unlikely: bool) -> Place:
    """The region as a place, named by the nodes at its corners."""
    own = set(elements)
    nodes = sorted({n for e, nodes in zip(group.elements, group.nodes, strict=True) if e in own for n in nodes})
    corners = _corners(model, nodes)
    label = f"region of {len(elements)} elements of property {pid} between nodes {', '.join(map(str, corners))}"
    parts = tuple(part for e in elements for part in model.parts.get(e, (e,)))
    return Place("region", corners, "", "", elements=parts, label=label, parameter=scaled_by(model, parts[0]),
                 unlikely=unlikely)  # fmt: skip


def _corners(model: Model, nodes: Sequence[int]) -> tuple[int, ...]:
    """Those of the nodes that are farthest out towards the corners of the box around them."""
    xyz = model.xyz[[model.index(n) for n in nodes]]
    sides = np.ptp(xyz, axis=0)
    signs = product(*[(-1.0, 1.0) if side > FLAT * sides.max() else (0.0,) for side in sides])
    scaled = (xyz - xyz.mean(axis=0)) / np.maximum(sides, 1e-300)
    return tuple(dict.fromkeys(nodes[int(np.argmax(np.round(scaled @ np.array(sign), 9)))] for sign in signs))


def scaled_by(model: Model, eid: int) -> int | None:
    """The parameter that multiplies the whole stiffness of an element; None where none or several change it, or one
    changes it otherwise."""
    ones = np.ones(len(model.parameters))
    K = np.asarray(model.fe.element_matrices(eid, ones)[1])
    changing = [
        i for i in range(len(ones)) if _changes(model, eid, ones, np.where(np.arange(len(ones)) == i, 2.0, 1.0))
    ]
    if len(changing) != 1:
        return None
    doubled = np.asarray(model.fe.element_matrices(eid, np.where(np.arange(len(ones)) == changing[0], 2.0, 1.0))[1])
    return changing[0] if np.allclose(doubled, 2 * K, rtol=1e-9, atol=1e-12 * np.abs(K).max()) else None
