"""Nodes of different members as pairs: a brace, a strut or a tie that the deck lacks may join any two of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from femend.model.model import Model
from femend.model.places.pair_places import Between
from femend.model.places.place import Place
from femend.model.places.places import Topology

__all__ = ["pairs_between_members"]

# pairs of nodes, the nearest ones, each with a place along its line and along the axes
MOST = 2500


def pairs_between_members(model: Model, top: Topology, known: Sequence[Place] = ()) -> list[Place]:
    """Places between the nodes (of the deck) of different members and rods, the nearest `MOST` pairs, along the line
    between them and, where neither is held, along the axes; those of places `known` are not listed again. Nothing of
    the model suggests that they are joined, so that all are `unlikely`."""
    own = _members_of(model, top)
    nodes = sorted(own)
    if len(nodes) < 2:
        return []
    between = Between.of(model, top.held)
    had = {(frozenset(p.nodes), p.direction) for p in known}
    places = []
    for a, b in _nearest(between, nodes):
        if own[a] & own[b] or (between.fixed(a) and between.fixed(b)):
            continue
        axes = () if between.fixed(a) or between.fixed(b) else range(3)
        found = [between.along_line(a, b), *(between.along_axis(a, b, c) for c in axes)]
        places += [p for p in found if p is not None and (frozenset(p.nodes), p.direction) not in had]
    return [replace(place, unlikely=True) for place in places]


def _members_of(model: Model, top: Topology) -> dict[int, set[int]]:
    """The members, numbered, with rods after them, that each node of the deck belongs to."""
    chains = [{n for eid in chain for n in top.beams[eid]} for _, _, chain in top.members]
    own: dict[int, set[int]] = {}
    for number, nodes in enumerate([*chains, *map(set, top.rods.values())]):
        for node in model.drawn(nodes):
            own.setdefault(node, set()).add(number)
    return own


def _nearest(between: Between, nodes: Sequence[int]) -> list[tuple[int, int]]:
    """Some `MOST` pairs of `nodes`, in rising order of distance."""
    xyz = between.xyz[[between.model.index(n) for n in nodes]]
    neighbours = min(len(nodes), 2 + 2 * MOST // len(nodes))
    distance, other = map(np.asarray, cKDTree(xyz).query(xyz, k=neighbours))
    # rounded, so that pairs that are as far apart stand in the order of their nodes
    size = max(float(np.linalg.norm(np.ptp(xyz, axis=0))), 1e-300)
    pairs = {
        (round(float(d) / size, 9), min(i, int(j)), max(i, int(j)))
        for i in range(len(nodes))
        for d, j in zip(distance[i], other[i], strict=True)
        if i != j
    }
    return [(nodes[i], nodes[j]) for _, i, j in sorted(pairs)[:MOST]]
