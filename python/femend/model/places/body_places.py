"""Pairs of a body and what it faces as places: a payload, a motor or a valve that strikes the structure or rubs on it.

A body is a lumped mass at a node that no beam, rod, shell or solid has: rigid elements, springs or bushes carry it. To
members it is a point, and how large it is the deck does not say; so of every member the nearest node faces it that does
not move with it as one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.places.gap_places import STRUCTURE, joined
from femend.model.places.pair_places import Between
from femend.model.places.place import Place

__all__ = ["body_places", "faced"]

# cards of lumped masses
_LUMPS = ("CONM1", "CONM2")
# nodes that a body faces, the nearest ones, pairs in all, and bodies beyond which masses are spread over a structure
FACED, MAX_FACED, MAX_BODIES = 8, 200, 40


def body_places(
    model: Model, held: NDArray[np.bool_], members: Sequence[Sequence[int]], known: Sequence[Place] = ()
) -> list[Place]:
    """Places between bodies and the nodes of `members` (ids) that they face (`faced`), along the line between them and
    along the axes. Pairs of places `known` are not listed again; `held` (n_g,) are the DOFs of the g-set that cannot
    move."""
    had = {(frozenset(p.nodes), p.direction) for p in known}
    between = Between.of(model, held)
    places = []
    for a, b in faced(model, members):
        if between.fixed(a) and between.fixed(b):
            continue
        found = [between.along_line(a, b), *(between.along_axis(a, b, c) for c in range(3))]
        places += [p for p in found if p is not None and (frozenset(p.nodes), p.direction) not in had]
    return places


def faced(model: Model, members: Sequence[Sequence[int]]) -> list[tuple[int, int]]:
    """Bodies with the nearest node of each of the `members` (their node ids), in rising order of distance: the nearest
    `FACED` of a body, `MAX_FACED` in all; none of a model with more than `MAX_BODIES`."""
    drawn = model.as_drawn
    elements = list(drawn.fe.elements())
    structure = {n for _, card, nodes in elements if card.startswith(STRUCTURE) for n in nodes}
    bodies = sorted({nodes[0] for _, card, nodes in elements if card in _LUMPS} - structure)
    own = [np.array([drawn.index(n) for n in model.drawn(member)], dtype=np.int64) for member in members]
    if not bodies or not own or len(bodies) > MAX_BODIES:
        return []
    xyz, at = drawn.xyz, np.array([drawn.index(n) for n in bodies], dtype=np.int64)
    nodes = np.unique(np.concatenate(own))
    distance = np.linalg.norm(xyz[at][:, None] - xyz[nodes], axis=2)
    tied = joined(drawn, np.repeat(at, len(nodes)), np.tile(nodes, len(at))).reshape(distance.shape)
    # rounded, so that nodes that are as far away stand in their order
    size = max(float(np.linalg.norm(np.ptp(xyz, axis=0))), 1e-300)
    distance = np.where(tied, np.inf, np.round(distance / size, 9))
    pairs = []
    for i, body in enumerate(bodies):
        near = {}
        for k in (np.searchsorted(nodes, member) for member in own):
            nearest = k[int(np.argmin(distance[i, k]))]
            if np.isfinite(distance[i, nearest]):
                near[int(drawn.node_ids[nodes[nearest]])] = float(distance[i, nearest])
        pairs += [(d, body, n) for d, n in sorted((d, n) for n, d in near.items())[:FACED]]
    return [(body, n) for _, body, n in sorted(pairs)[:MAX_FACED]]
