"""Pairs of nodes as places: what pushes, slides or rubs between two of them, along their line or along an axis."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.places.place import AXES, Place

__all__ = ["Between", "joint_pairs"]

FloatArray = NDArray[np.float64]

# two nodes on a line as near to an axis as this have one place along both
ALONG = 0.99
# up to this number all joints are paired with each other; beyond it the nearest ones are, with so many neighbours each
# and so many pairs in all: the pairs would outnumber everything else
MAX_PAIRED_JOINTS, NEIGHBOURS, MAX_JOINT_PAIRS = 40, 16, 400
# and beyond this number not along the axes either, only along the line between them
MAX_PAIRED_ALONG_AXES = 16


@dataclass(frozen=True, eq=False)
class Between:
    """Makes places between two nodes of a model: coordinates `xyz` (n, 3) and displacement frames `frames` (n, 3, 3) of
    its nodes are read once, `held` (n_g,) are the DOFs of the g-set that cannot move."""

    model: Model
    held: NDArray[np.bool_]
    xyz: FloatArray
    frames: FloatArray

    @classmethod
    def of(cls, model: Model, held: NDArray[np.bool_]) -> Between:
        """For the nodes of a model; `held` (n_g,) are the DOFs of the g-set that cannot move."""
        return cls(model, held, model.xyz, model.frames)

    def fixed(self, node: int) -> bool:
        """Whether a node cannot move in any direction."""
        first = 6 * self.model.index(node)
        return bool(self.held[first : first + 3].all())

    def along_line(self, a: int, b: int) -> Place | None:
        """Two nodes moving apart along the line between them; None where both are held or they are at one point."""
        at = self.model.index(a), self.model.index(b)
        x = self.xyz[at[1]] - self.xyz[at[0]]
        length = float(np.linalg.norm(x))
        if (self.fixed(a) and self.fixed(b)) or length == 0:
            return None
        rows = np.concatenate([6 * at[0] + np.arange(3), 6 * at[1] + np.arange(3)])
        values = np.concatenate([-(self.frames[at[0]] @ x), self.frames[at[1]] @ x]) / length
        return Place("pair", (a, b), "", str(b), (rows,), (values,), label=f"between nodes {a} and {b}")

    def along_axis(self, a: int, b: int, c: int) -> Place | None:
        """Motion of node b against node a along basic axis c, or about axis c - 3 from 3 on; None where that is along
        the line between them, or neither can move so."""
        at = self.model.index(a), self.model.index(b)
        x = self.xyz[at[1]] - self.xyz[at[0]]
        length = float(np.linalg.norm(x))
        along = c < 3 and length > 0 and abs(x[c]) > ALONG * length
        own = 3 * (c // 3) + np.arange(3)
        rows = np.concatenate([6 * at[0] + own, 6 * at[1] + own])
        values = np.concatenate([-self.frames[at[0]][:, c % 3], self.frames[at[1]][:, c % 3]])
        moving = rows[(values != 0) & ~self.held[rows]]
        if along or not len(moving):
            return None
        keep = np.flatnonzero(values)
        label = f"between nodes {a} and {b}, {AXES[c]}"
        return Place("pair", (a, b), AXES[c], str(b), (rows[keep],), (values[keep],), label=label)

    def opening(self, nodes: Sequence[int], c: int) -> tuple[NDArray[np.int64], FloatArray]:
        """Rows of the g-set and values of the motion of one node along basic axis c, or of the second of two `nodes`
        against the first; none of what cannot move."""
        at = [self.model.index(node) for node in nodes[:2]]
        rows = np.concatenate([6 * i + np.arange(3) for i in at])
        values = np.concatenate([self.frames[i][:, c] for i in at])
        values[: 3 * (len(at) - 1)] *= -1.0
        keep = np.flatnonzero((values != 0) & ~self.held[rows])
        return rows[keep], values[keep]


def joint_pairs(
    model: Model, held: NDArray[np.bool_], joints: Sequence[int], joined: Iterable[frozenset[int]]
) -> list[Place]:
    """Pairs of the `joints` (node ids) of beams that no member joins directly, along their line, and of few joints
    along the axes too: what slides or rubs between two storeys. `held` (n_g,) are the DOFs that cannot move."""
    between, without = Between.of(model, held), set(joined)
    # along a member it is that member's own axial stiffness
    found = [between.along_line(a, b) for a, b in _near(between, joints) if frozenset((a, b)) not in without]
    if len(joints) <= MAX_PAIRED_ALONG_AXES:
        free = [j for j in joints if not between.fixed(j)]
        found += [between.along_axis(a, b, c) for a, b in combinations(free, 2) for c in range(3)]
    return [place for place in found if place is not None]


def _near(between: Between, joints: Sequence[int]) -> list[tuple[int, int]]:
    """All pairs of few joints; of many the nearest, in rising order of distance."""
    if len(joints) <= MAX_PAIRED_JOINTS:
        return list(combinations(joints, 2))
    from scipy.spatial import cKDTree

    xyz = between.xyz[[between.model.index(j) for j in joints]]
    distance, other = map(np.asarray, cKDTree(xyz).query(xyz, k=NEIGHBOURS))
    # rounded, so that pairs that are as far apart stand in the order of their joints
    size = float(np.linalg.norm(np.ptp(xyz, axis=0)))
    pairs = {
        (round(float(d) / size, 9), min(i, int(j)), max(i, int(j)))
        for i in range(len(joints))
        for d, j in zip(distance[i], other[i], strict=True)
        if i != j
    }
    return [(joints[i], joints[j]) for _, i, j in sorted(pairs)[:MAX_JOINT_PAIRS]]
