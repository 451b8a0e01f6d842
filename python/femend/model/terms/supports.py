"""Regions of nodes that the deck holds: where they are, how large they are, which DOFs are held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.numerals import listed

__all__ = ["SupportRegion", "connected", "held_rows", "nodal_areas", "support_regions"]

FloatArray = NDArray[np.float64]

SHELLS = ("CQUAD4", "CTRIA3", "CQUADR", "CTRIAR")
# an area support needs a surface: fewer nodes than this carry none
FEWEST = 3


@dataclass(frozen=True, eq=False)
class SupportRegion:
    """Held nodes that belong together, joined by elements of which every node is held.

    `nodes` (n,) ids; `areas` (n,) their shares of the shells' area, all 0 where there are no shells; `rows` the held
    DOFs of the independent set of the free model.
    """

    nodes: tuple[int, ...]
    areas: FloatArray
    rows: NDArray[np.int64]

    @property
    def area(self) -> float:
        """Supported area in the model's unit; 0 for a support at points."""
        return float(self.areas.sum())

    @property
    def name(self) -> str:
        """The region by its first nodes."""
        return f"nodes {listed(self.nodes, 4)}"


def held_rows(free: Model, held: Model) -> NDArray[np.int64]:
    """Independent DOFs of the `free` model that the `held` one (the same deck with an SPC set) does not have.

    A DOF that another depends on rigidly and that is held stands in neither.
    """
    own = set(zip(held.fe.dof_nodes.tolist(), held.fe.dof_components.tolist()))
    pairs = zip(free.fe.dof_nodes.tolist(), free.fe.dof_components.tolist())
    return np.array([i for i, pair in enumerate(pairs) if pair not in own], dtype=np.int64)


def nodal_areas(model: Model) -> dict[int, float]:
    """Share of every node in the area of the shells around it (a quarter of each quadrangle, a third of each
    triangle)."""
    xyz = model.xyz_of
    share: dict[int, float] = {}
    for _, card, nodes in model.fe.elements():
        if card not in SHELLS:
            continue
        corners = [xyz[n] for n in nodes[: 4 if card.startswith("CQUAD") else 3]]
        if len(corners) == 4:
            area = 0.5 * float(np.linalg.norm(np.cross(corners[2] - corners[0], corners[3] - corners[1])))
        else:
            area = 0.5 * float(np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])))
        for n in nodes[: len(corners)]:
            share[n] = share.get(n, 0.0) + area / len(corners)
    return share


def support_regions(free: Model, rows: NDArray[np.int64]) -> tuple[SupportRegion, ...]:
    """The regions of the held DOFs `rows` of the independent set of a model read without supports, largest first.

    Nodes held in one direction only (a symmetry plane, a plane model) make no region: what holds them is no support
    but an assumption about the motion.
    """
    by_node: dict[int, list[int]] = {}
    for i in rows.tolist():
        by_node.setdefault(int(free.fe.dof_nodes[i]), []).append(i)
    components = free.fe.dof_components
    free_rows: dict[int, int] = {}
    for node in free.fe.dof_nodes.tolist():
        free_rows[node] = free_rows.get(node, 0) + 1
    clamped = {
        n: own for n, own in by_node.items() if sum(int(components[i]) <= 3 for i in own) >= min(3, free_rows[n])
    }
    areas = nodal_areas(free)
    found = []
    for group in connected(free, set(clamped)):
        nodes = tuple(sorted(group))
        inside = np.array([areas.get(n, 0.0) for n in nodes])
        if len(nodes) < FEWEST:
            inside = np.zeros(len(nodes))
        own_rows = np.array(sorted(i for n in nodes for i in clamped[n]), dtype=np.int64)
        found.append(SupportRegion(nodes, inside, own_rows))
    return tuple(sorted(found, key=lambda r: -len(r.nodes)))


def connected(model: Model, nodes: set[int]) -> list[set[int]]:
    """Groups of `nodes` that share elements."""
    parent = {n: n for n in nodes}

    def root(n: int) -> int:
        while parent[n] != n:
            parent[n] = parent[parent[n]]
            n = parent[n]
        return n

    for _, _, members in model.fe.elements():
        inside = [n for n in members if n in nodes]
        for n in inside[1:]:
            parent[root(n)] = root(inside[0])
    groups: dict[int, set[int]] = {}
    for n in nodes:
        groups.setdefault(root(n), set()).add(n)
    return list(groups.values())
