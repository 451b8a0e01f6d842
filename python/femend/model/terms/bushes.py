"""Springs of one property (CBUSH/PBUSH) as a group, with the motion at their elastic centres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model

__all__ = ["BushGroup", "bush_groups"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BushGroup:
    """All two-node bushes of one property between distinct nodes whose stiffness is translational only.

    `k` (3,) translational stiffnesses along x, y, z of the deck; `elements` and `ends` (node pairs); for every element
    `g_rows` (12,) and the map `B` (6, 12) from the ends' motion in g to relative displacement and rotation at the
    middle; `length` the mean distance of the ends.
    """

    property_id: int
    elements: tuple[int, ...]
    ends: tuple[tuple[int, int], ...]
    g_rows: tuple[NDArray[np.int64], ...]
    B: tuple[FloatArray, ...]
    k: FloatArray
    length: float
    axis: int

    @property
    def upper_nodes(self) -> tuple[int, ...]:
        """One end of every spring (the second node of its card)."""
        return tuple(b for _, b in self.ends)


def bush_groups(model: Model) -> tuple[BushGroup, ...]:
    """The groups of `model`; properties with rotational stiffness, springs of zero length and turned frames are no
    candidates for bending that is missing."""
    by_property: dict[int, list[tuple[int, tuple[int, int]]]] = {}
    for eid, card, pid, nodes in model.deck.elements():
        if card == "CBUSH" and pid is not None and len(nodes) == 2:
            by_property.setdefault(int(pid), []).append((int(eid), (int(nodes[0]), int(nodes[1]))))
    found = []
    for pid, members in sorted(by_property.items()):
        group = _group(model, pid, members)
        if group is not None:
            found.append(group)
    return tuple(found)


def _group(model: Model, pid: int, members: list[tuple[int, tuple[int, int]]]) -> BushGroup | None:
    xyz = model.xyz_of
    rows, maps, lengths, axes = [], [], [], []
    stiffness = None
    for eid, (a, b) in members:
        g_rows, K, _ = model.fe.element_matrices(eid)
        middle, arms = 0.5 * (xyz[a] + xyz[b]), (xyz[a], xyz[b])
        length = float(np.linalg.norm(xyz[b] - xyz[a]))
        if length == 0.0:
            return None
        B = np.hstack([-_rigid(middle - arms[0]), _rigid(middle - arms[1])])
        B = B[:, _order(model, g_rows, a, b)]
        own = _translational(B, np.asarray(K))
        if own is None or (stiffness is not None and not np.allclose(own, stiffness, rtol=1e-6)):
            return None
        stiffness = own
        rows.append(np.asarray(g_rows, dtype=np.int64))
        maps.append(B)
        lengths.append(length)
        axes.append(int(np.argmax(np.abs(xyz[b] - xyz[a]))))
    if stiffness is None or len(set(axes)) != 1:
        return None
    elements, ends = zip(*members)
    return BushGroup(
        pid, tuple(elements), tuple(ends), tuple(rows), tuple(maps), stiffness, float(np.mean(lengths)), axes[0]
    )


def _order(model: Model, g_rows: NDArray[np.int64], a: int, b: int) -> NDArray[np.int64]:
    """Columns of a map over (a: 6, b: 6) in the order of the element's g rows."""
    full = [6 * model.index(n) + c for n in (a, b) for c in range(6)]
    return np.array([full.index(int(r)) for r in g_rows], dtype=np.int64)


def _rigid(arm: FloatArray) -> FloatArray:
    """Motion (6, 6) at a point `arm` away from a node that moves rigidly with it: u + rotation x arm."""
    x, y, z = arm
    T = np.eye(6)
    T[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return T


def _translational(B: FloatArray, K: FloatArray) -> FloatArray | None:
    """Diagonal stiffness (3,) of K = B' diag(k, 0) B in the model's axes; None where K is not of that form."""
    k6 = np.linalg.lstsq(_columns(B), K.ravel(), rcond=None)[0]
    left = (_columns(B) @ k6 - K.ravel()).reshape(K.shape)
    if np.abs(left).max() > 1e-8 * np.abs(K).max() or np.abs(k6[3:]).max() > 1e-9 * np.abs(k6[:3]).max():
        return None
    return np.asarray(k6[:3])


def _columns(B: FloatArray) -> FloatArray:
    return np.column_stack([np.outer(B[i], B[i]).ravel() for i in range(6)])
