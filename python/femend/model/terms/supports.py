"""Regions of nodes that the deck holds: where they are, how large they are, which DOFs are held."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.numerals import listed

__all__ = ["SupportRegion", "connected", "held_rows", "nodal_areas", "support_regions"]

FloatArray = NDArray[np.float64]

SHELLS = ("CQUAD4", "CTRIA3", "CQUADR", "CTRIAR")
# an area support needs a surface: fewer nodes than this carry none
FEWEST = 3
# share of an area up to which two of them, or their moments, are the same
EQUAL = 1e-6


@dataclass(frozen=True, eq=False)
class SupportRegion:
    """Held nodes that belong together, joined by elements of which every node is held.

    `nodes` (n,) ids; `areas` (n,) their shares of the shells' area, all 0 where there are no shells; `rows` the held
    DOFs of the independent set of the free model. On springs of the shares `tilting` (n,) the region tilts as on the
    layer itself; they are `areas` where its nodes do not allow it.
    """

    nodes: tuple[int, ...]
    areas: FloatArray
    rows: NDArray[np.int64]
    tilting: FloatArray

    def spread(self) -> tuple[SupportRegion, ...]:
        """The region with the shares of its nodes, and with those on which it tilts as on the layer, where these are
        others. Which is nearer to a layer is for recordings to say: they lie a few per cent of its stiffness against
        tilting apart."""
        other = replace(self, areas=self.tilting)
        return (self,) if np.allclose(self.tilting, self.areas, rtol=1e-3) else (self, other)

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


def _tilting_right(model: Model, nodes: tuple[int, ...], areas: FloatArray) -> FloatArray:
    """The shares `areas` (n,) of a region's nodes, moved so that their second moments are those of its shells.

    Springs on plain shares resist a rigid tilt too much, by 2 (h/L)^2 of a plate L long with elements of h: its edge
    carries more than is below it. The least relative changes are made with which area, centre and second moments
    come out (as in Simpson's rule). Shares stay as they are where shells reach beyond the region, and where nodes are
    too few for positive ones.
    """
    corners = _triangles(model, set(nodes))
    inside = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    total = float(areas.sum())
    if not total > 0 or abs(float(inside.sum()) - total) > EQUAL * total:
        return areas
    at = model.xyz_of
    xyz = np.array([at[n] for n in nodes])
    centre, size = areas @ xyz / total, max(float(np.ptp(xyz, axis=0).max()), 1e-300)
    x, corners = (xyz - centre) / size, (corners - centre) / size
    sums = corners.sum(axis=1)
    # of a triangle: the moments of its corners and of their sum, a twelfth of the area each
    second = np.einsum("t,tci,tcj->ij", inside, corners, corners) + np.einsum("t,ti,tj->ij", inside, sums, sums)
    i, j = np.triu_indices(3)
    wanted = np.concatenate([[total], inside @ sums / 3, second[i, j] / 12])
    moments = np.column_stack([np.ones(len(x)), x, x[:, i] * x[:, j]])
    follow = np.linalg.lstsq(moments.T @ (areas[:, None] * moments), wanted - moments.T @ areas, rcond=1e-10)[0]
    moved = areas * (1.0 + moments @ follow)
    right = np.abs(moments.T @ moved - wanted).max() < EQUAL * total
    return np.asarray(moved) if right and float(moved.min()) > 0 else areas


def _triangles(model: Model, nodes: set[int]) -> FloatArray:
    """Corners (t, 3, 3) of the shells all of whose corners are `nodes`, quadrangles as two triangles."""
    xyz = model.xyz_of
    found = []
    for _, card, members in model.fe.elements():
        own = members[: 4 if card.startswith("CQUAD") else 3]
        if card in SHELLS and nodes.issuperset(own):
            found += [[xyz[n] for n in (own[0], own[k], own[k + 1])] for k in range(1, len(own) - 1)]
    return np.array(found).reshape(-1, 3, 3)


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
        found.append(SupportRegion(nodes, inside, own_rows, _tilting_right(free, nodes, inside)))
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
