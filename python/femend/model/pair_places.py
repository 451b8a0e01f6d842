"""Pairs of nodes as places: what pushes, slides or rubs between two of them, along their line or along an axis."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.place import AXES, Place

__all__ = ["along_axis", "along_line", "joint_pairs"]

# two nodes on a line as near to an axis as this have one place along both
ALONG = 0.99
# up to this number all joints are paired with each other; beyond it the nearest ones are, with so many neighbours each
# and so many pairs in all: the pairs would outnumber everything else
MAX_PAIRED_JOINTS, NEIGHBOURS, MAX_JOINT_PAIRS = 40, 16, 400
# and beyond this number not along the axes either, only along the line between them
MAX_PAIRED_ALONG_AXES = 16


def joint_pairs(
    model: Model, held: NDArray[np.bool_], joints: Sequence[int], joined: Iterable[frozenset[int]]
) -> list[Place]:
    """Pairs of the `joints` (node ids) of beams that no member joins directly, along their line, and of few joints
    along the axes too: what slides or rubs between two storeys. `held` (n_g,) are the DOFs that cannot move."""
    without = set(joined)
    places = []
    for a, b in _near(model, joints):
        if frozenset((a, b)) in without:
            continue  # along a member it is that member's own axial stiffness
        place = along_line(model, held, a, b)
        places += [] if place is None else [place]
    if len(joints) > MAX_PAIRED_ALONG_AXES:
        return places
    free = [j for j in joints if not _is_held(model, held, j)]
    for a, b in combinations(free, 2):
        found = [along_axis(model, held, a, b, c) for c in range(3)]
        places += [place for place in found if place is not None]
    return places


def _near(model: Model, joints: Sequence[int]) -> list[tuple[int, int]]:
    """All pairs of few joints; of many the nearest, in rising order of distance."""
    if len(joints) <= MAX_PAIRED_JOINTS:
        return list(combinations(joints, 2))
    from scipy.spatial import cKDTree

    xyz = model.xyz[[model.index(j) for j in joints]]
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


def along_line(model: Model, held: NDArray[np.bool_], a: int, b: int) -> Place | None:
    """Two nodes moving apart along the line between them; None where both are held or they are at one point."""
    at = model.index(a), model.index(b)
    x = model.xyz[at[1]] - model.xyz[at[0]]
    length = float(np.linalg.norm(x))
    if (_is_held(model, held, a) and _is_held(model, held, b)) or length == 0:
        return None
    frame_a, frame_b = model.fe.frames[at[0]], model.fe.frames[at[1]]
    rows = np.concatenate([6 * at[0] + np.arange(3), 6 * at[1] + np.arange(3)])
    values = np.concatenate([-(frame_a @ x), frame_b @ x]) / length
    return Place("pair", (a, b), "", str(b), (rows,), (values,), label=f"between nodes {a} and {b}")


def along_axis(model: Model, held: NDArray[np.bool_], a: int, b: int, c: int) -> Place | None:
    """Motion of node b against node a along basic axis c, or about axis c - 3 from 3 on; None where that is along the
    line between them, or neither can move so."""
    at = model.index(a), model.index(b)
    x = model.xyz[at[1]] - model.xyz[at[0]]
    length = float(np.linalg.norm(x))
    along = c < 3 and length > 0 and abs(x[c]) > ALONG * length
    own = 3 * (c // 3) + np.arange(3)
    rows = np.concatenate([6 * at[0] + own, 6 * at[1] + own])
    values = np.concatenate([-model.fe.frames[at[0]][:, c % 3], model.fe.frames[at[1]][:, c % 3]])
    moving = rows[(values != 0) & ~held[rows]]
    if along or not len(moving):
        return None
    keep = np.flatnonzero(values)
    label = f"between nodes {a} and {b}, {AXES[c]}"
    return Place("pair", (a, b), AXES[c], str(b), (rows[keep],), (values[keep],), label=label)


def _is_held(model: Model, held: NDArray[np.bool_], node: int) -> bool:
    """Whether a node cannot move in any direction."""
    first = 6 * model.index(node)
    return bool(held[first : first + 3].all())
