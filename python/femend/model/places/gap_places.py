"""Pairs across a gap as places: nodes of different parts that face each other, or of one part that is folded or slit.

Parts are what beams, rods, shells and solids make without springs, rigid elements and constraints: these join parts,
and beside them the parts may still meet. Two nodes of different parts face each other where each is the nearest of the
other's part to it, and the gap is no wider than `WIDEST` elements there or `NEAR` of the smaller part. Two nodes of one
part do where they are no farther apart than an element is long, though the way along the mesh is `AROUND` times that
long. Nodes that an element or a constraint joins directly have no gap between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from femend.model.model import Model
from femend.model.places.pair_places import Between
from femend.model.places.place import Place

__all__ = ["STRUCTURE", "facing", "gap_places", "joined"]

FloatArray = NDArray[np.float64]
Ints = NDArray[np.int64]

# cards of elements that are structure, by their beginnings; those with rotations at their nodes
STRUCTURE = (
    "CBAR",
    "CBEAM",
    "CBEND",
    "CROD",
    "CONROD",
    "CTUBE",
    "CQUAD",
    "CTRIA",
    "CHEXA",
    "CPENTA",
    "CTETRA",
    "CPYRAM",
)
_TURNING = ("CBAR", "CBEAM", "CBEND", "CQUAD", "CTRIA")
# width of a gap between parts: in sizes of the elements there, and as a share of the smaller part's diagonal
WIDEST, NEAR = 2.0, 0.25
# way along the mesh between two facing nodes of one part, in sizes of the elements there
AROUND = 5.0
# pairs that are places, the nearest ones first
MAX_GAPS = 2500
# neighbours that are looked at in one part, and sources of ways along the mesh that are followed at once
NEIGHBOURS, AT_ONCE = 24, 64
# nodes closer than this share of the model's diagonal are at one point
AT_ONE_POINT = 1e-6


def gap_places(model: Model, held: NDArray[np.bool_], known: Sequence[Place] = ()) -> list[Place]:
    """Places between nodes that face each other (`facing`), the nearest `MAX_GAPS` pairs: along the line between them
    and along the axes across it, at one point along all axes, and about them where both nodes carry rotations. Pairs of
    places `known` are not listed again; `held` (n_g,) are the DOFs of the g-set that cannot move."""
    had = {(frozenset(p.nodes), p.direction) for p in known}
    turning = {n for _, card, nodes in model.as_drawn.fe.elements() if card.startswith(_TURNING) for n in nodes}
    between = Between.of(model, held)
    together = AT_ONE_POINT * _diagonal(between.xyz)
    places = []
    for a, b in facing(model)[:MAX_GAPS]:
        if between.fixed(a) and between.fixed(b):
            continue
        apart = float(np.linalg.norm(between.xyz[model.index(b)] - between.xyz[model.index(a)])) > together
        found = [between.along_line(a, b)] if apart else []
        axes = range(6 if not apart and {a, b} <= turning else 3)
        found += [between.along_axis(a, b, c) for c in axes]
        places += [p for p in found if p is not None and (frozenset(p.nodes), p.direction) not in had]
    return places


def facing(model: Model) -> list[tuple[int, int]]:
    """Pairs of node ids of the user's deck that face each other across a gap, in rising order of distance."""
    mesh = _Mesh.of(model.as_drawn)
    pairs = sorted({*_between_parts(mesh), *_within_parts(mesh)})
    if not pairs:
        return []
    a, b = np.array(pairs, dtype=np.int64).T
    apart = ~joined(model.as_drawn, a, b)
    a, b = a[apart], b[apart]
    # rounded, so that pairs that are as far apart stand in the order of their nodes
    distance = np.round(np.linalg.norm(mesh.xyz[a] - mesh.xyz[b], axis=1) / max(mesh.diagonal, 1e-300), 9)
    ids = model.as_drawn.node_ids
    return [(int(ids[a[i]]), int(ids[b[i]])) for i in np.lexsort((b, a, distance))]


def _diagonal(xyz: FloatArray) -> float:
    return float(np.linalg.norm(np.ptp(xyz, axis=0))) if len(xyz) else 0.0


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Nodes `xyz` (n, 3) with the `part` (n,) of each (-1 where no structure is) and the `size` (n,) of the elements
    around it; `ways` (n, n) are the lengths between nodes that share an element."""

    xyz: FloatArray
    part: Ints
    size: FloatArray
    ways: csr_array

    @classmethod
    def of(cls, model: Model) -> _Mesh:
        n, xyz = len(model.node_ids), model.xyz
        by_count: dict[int, list[list[int]]] = {}
        for _, card, nodes in model.fe.elements():
            if card.startswith(STRUCTURE):
                own = [model.index(node) for node in dict.fromkeys(nodes) if node]
                by_count.setdefault(len(own), []).append(own)
        size = np.zeros(n)
        ends: list[Ints] = [np.zeros((2, 0), dtype=np.int64)]
        for count, rows in by_count.items():
            elements = np.array(rows, dtype=np.int64)
            i, j = np.triu_indices(count, 1)
            a, b = elements[:, i], elements[:, j]
            mean = np.linalg.norm(xyz[a] - xyz[b], axis=2).mean(axis=1) if count > 1 else np.zeros(len(elements))
            np.maximum.at(size, elements.ravel(), np.repeat(mean, count))
            ends.append(np.array([a.ravel(), b.ravel()]))
        a, b = np.unique(np.sort(np.hstack(ends), axis=0), axis=1)
        # a way of no length at all would be none to scipy
        length = np.maximum(np.linalg.norm(xyz[a] - xyz[b], axis=1), 1e-12 * max(_diagonal(xyz), 1e-300))
        ways = csr_array(coo_array((length, (a, b)), shape=(n, n)))
        ways = csr_array(ways + ways.T)
        part = np.asarray(connected_components(ways, directed=False)[1], dtype=np.int64)
        return cls(xyz, np.where(size > 0, part, -1), size, ways)

    @property
    def diagonal(self) -> float:
        """Diagonal of the box around all nodes."""
        return _diagonal(self.xyz)


def _between_parts(mesh: _Mesh) -> Iterator[tuple[int, int]]:
    """Positions of nodes of two parts each of which is the other part's nearest to the other."""
    own = [np.flatnonzero(mesh.part == p) for p in np.unique(mesh.part[mesh.part >= 0])]
    if len(own) < 2:
        return
    low, high = (np.array([f(mesh.xyz[i], axis=0) for i in own]) for f in (np.min, np.max))
    diagonal = np.linalg.norm(high - low, axis=1)
    coarsest = np.array([mesh.size[i].max() for i in own])
    trees = [cKDTree(mesh.xyz[i]) for i in own]
    for p in range(len(own)):
        q = np.arange(p + 1, len(own))
        widest = np.maximum(WIDEST * np.maximum(coarsest[p], coarsest[q]), NEAR * np.minimum(diagonal[p], diagonal[q]))
        gap = np.linalg.norm(np.maximum(np.maximum(low[q] - high[p], low[p] - high[q]), 0.0), axis=1)
        for k in q[gap <= widest].tolist():
            reach = NEAR * min(diagonal[p], diagonal[k])
            yield from _mutual(mesh, (own[p], own[k]), (trees[p], trees[k]), reach)


def _mutual(
    mesh: _Mesh, own: tuple[Ints, Ints], trees: tuple[cKDTree, cKDTree], reach: float
) -> Iterator[tuple[int, int]]:
    """Positions of nodes of two parts, `own` (n,) and (m,), that are each other's nearest within `reach` or a few
    elements."""
    distance, there = map(np.asarray, trees[1].query(mesh.xyz[own[0]]))
    back = np.asarray(trees[0].query(mesh.xyz[own[1]])[1])
    a, b = own[0], own[1][there]
    near = distance <= np.maximum(WIDEST * np.maximum(mesh.size[a], mesh.size[b]), reach)
    for i in np.flatnonzero(near & (back[there] == np.arange(len(a)))).tolist():
        yield int(min(a[i], b[i])), int(max(a[i], b[i]))


def _within_parts(mesh: _Mesh) -> Iterator[tuple[int, int]]:
    """Positions of nodes of one part that are near through the air and far along the mesh, each the nearest such node
    to the other."""
    inside = np.flatnonzero(mesh.part >= 0)
    if len(inside) < 2:
        return
    xyz = mesh.xyz[inside]
    distance, there = map(np.asarray, cKDTree(xyz).query(xyz, k=min(NEIGHBOURS, len(inside))))
    a, b = np.repeat(inside, distance.shape[1]), inside[there.ravel()]
    length = distance.ravel()
    near = (a < b) & (mesh.part[a] == mesh.part[b]) & (length <= np.minimum(mesh.size[a], mesh.size[b]))
    a, b, length = a[near], b[near], length[near]
    near = np.asarray(mesh.ways[a, b]).ravel() == 0
    a, b, length = a[near], b[near], length[near]
    far = _way_is_long(mesh, a, b)
    a, b, length = a[far], b[far], length[far]
    nearest = np.full(len(mesh.xyz), np.inf)
    np.minimum.at(nearest, a, length)
    np.minimum.at(nearest, b, length)
    for i in np.flatnonzero((length <= nearest[a]) & (length <= nearest[b])).tolist():
        yield int(a[i]), int(b[i])


def _way_is_long(mesh: _Mesh, a: Ints, b: Ints) -> NDArray[np.bool_]:
    """Whether the way along the mesh between nodes `a` and `b` (n,) is `AROUND` elements long."""
    long = np.zeros(len(a), dtype=bool)
    least = AROUND * np.maximum(mesh.size[a], mesh.size[b])
    sources = np.unique(a)
    for some in np.array_split(sources, 1 + len(sources) // AT_ONCE):
        if not len(some):
            continue
        way = dijkstra(mesh.ways, directed=False, indices=some, limit=float(least.max()))
        mine = np.flatnonzero(np.isin(a, some))
        long[mine] = way[np.searchsorted(some, a[mine]), b[mine]] >= least[mine]
    return long


def joined(model: Model, a: Ints, b: Ints) -> NDArray[np.bool_]:
    """Whether an element of any kind or a constraint joins the nodes at the positions `a` and `b` (n,) directly."""
    at, group, groups = [], [], 0
    elements = [nodes for _, _, nodes in model.fe.elements()] + [nodes for *_, nodes in model.deck.elements()]
    known = {int(n): i for i, n in enumerate(model.node_ids.tolist())}
    wanted = set(a.tolist()) | set(b.tolist())
    for nodes in elements:
        own = [known[n] for n in nodes if n in known and known[n] in wanted]
        if len(own) > 1:
            at += own
            group += [groups] * len(own)
            groups += 1
    share = csr_array(coo_array((np.ones(len(at)), (at, group)), shape=(len(known), max(groups, 1))))
    # nodes that depend on one DOF
    T = model.transformation().tocoo()
    tied = csr_array(coo_array((np.ones(T.nnz), (T.row // 6, T.col)), shape=(len(known), model.fe.n_a)))
    both = [np.asarray(S[a].multiply(S[b]).sum(axis=1)).ravel() for S in (share, tied)]
    return np.asarray((both[0] + both[1]) > 0)
