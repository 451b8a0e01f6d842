"""Sensors between nodes: a point on a shell, a solid's surface or a bar, which moves as the element does there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.sensor_point import SensorPoint
from femend.model.surfaces.faces import face_shape, outer_faces

__all__ = ["sensor_points"]

FloatArray = NDArray[np.float64]

BARS = frozenset({"CBAR", "CBEAM", "CROD", "CONROD", "CTUBE"})
# those that bend
BEAMS = frozenset({"CBAR", "CBEAM"})
# steps of the search for the nearest point of a face, in its own coordinates, and what is near enough
STEPS, CLOSE = 30, 1e-12
# of an element's size: what is nearer to it is on it
ROUNDING = 1e-6


def sensor_points(
    model: Model, places: Mapping[int, FloatArray], *, reach: float, at_node: float, first: int
) -> dict[int, SensorPoint]:
    """The points of `model` at which sensors are whose `places` (test node to (3,)) are further than `at_node` from all
    nodes and no further than `reach` from an element; the number of a point is `first` and that of its test node.

    On shells and the surface of solids the motion is that of the element's shape functions (Bathe, Finite Element
    Procedures, 2nd ed., section 5.3); off a shell it is that of a rigid normal, by the rotations of its nodes. Along
    bars it is Hermite's cubic (without shear), linear along the axis and in twist, and of a rigid section off the axis.
    Beside a solid the distance counts for nothing.
    """
    grid = np.flatnonzero(~model.is_scalar)
    xyz = model.xyz[grid]
    nearest = {n: float(np.linalg.norm(xyz - p, axis=1).min()) for n, p in places.items()}
    off = [n for n, distance in nearest.items() if distance > at_node]
    if not off or not len(grid):
        return {}
    parts = list(_parts(model))
    if not parts:
        return {}
    middles = np.array([p.x.mean(axis=0) for p in parts])
    radii = np.array([np.linalg.norm(p.x - m, axis=1).max() for p, m in zip(parts, middles, strict=True)])
    found = {}
    for n in off:
        at = _nearest(parts, middles, radii, places[n], min(reach, nearest[n]))
        if at is not None:
            part, N, foot = at
            node = grid[int(np.argmin(np.linalg.norm(xyz - places[n], axis=1)))]
            found[n] = _point(model, part, N, foot, places[n], first + n, int(node))
    return found


@dataclass(frozen=True, eq=False)
class _Part:
    """A face, or a bar, between nodes at positions `at` in the model, of coordinates `x` (n, 3), as `kind` says."""

    kind: str
    at: tuple[int, ...]
    x: FloatArray


def _parts(model: Model) -> Iterator[_Part]:
    xyz = model.xyz
    shells, solids = outer_faces(model)
    for kind, faces in (("shell", shells), ("solid", solids)):
        for _, nodes in faces:
            at = tuple(model.index(n) for n in nodes)
            yield _Part(kind, at, xyz[list(at)])
    for _, card, ends in model.fe.elements():
        if card in BARS:
            at = tuple(model.index(n) for n in ends[:2])
            yield _Part("beam" if card in BEAMS else "rod", at, xyz[list(at)])


def _nearest(
    parts: list[_Part], middles: FloatArray, radii: FloatArray, point: FloatArray, reach: float
) -> tuple[_Part, FloatArray, FloatArray] | None:
    """The part nearest to a `point` (3,), no further than `reach`, with its shape functions there and the foot (3,)."""
    least = np.linalg.norm(middles - point, axis=1) - radii
    best, within = None, reach
    for i in np.argsort(least):
        if least[i] > within:
            break
        N = _foot(parts[i].x, point)
        foot = N @ parts[i].x
        distance = float(np.linalg.norm(point - foot))
        if distance < within or (best is None and distance <= within):
            best, within = (parts[i], N, foot), distance
    return best


def _foot(x: FloatArray, point: FloatArray) -> FloatArray:
    """Shape functions (n,) at the point of a face or bar `x` (n, 3) that is nearest to `point` (3,)."""
    if len(x) == 2:
        along = x[1] - x[0]
        s = float(np.clip((point - x[0]) @ along / max(float(along @ along), 1e-300), 0.0, 1.0))
        return np.array([1.0 - s, s])
    triangle = len(x) in (3, 6)
    at = np.full(2, 1 / 3) if triangle else np.zeros(2)
    for _ in range(STEPS):
        N, dr, ds = face_shape(float(at[0]), float(at[1]), len(x))
        A = np.stack([dr @ x, ds @ x], axis=1)
        free = at + np.linalg.lstsq(A, point - N @ x, rcond=None)[0]
        new = _inside(A, at, free, triangle)
        moved = float(np.abs(new - at).max())
        at = new
        if moved < CLOSE:
            break
    return face_shape(float(at[0]), float(at[1]), len(x))[0]


def _inside(A: FloatArray, at: FloatArray, free: FloatArray, triangle: bool) -> FloatArray:
    """Of the points of an element the one nearest to `free` (2,), both in the element's coordinates, whose tangents at
    `at` are the columns of `A` (3, 2)."""
    corners = np.array([[0, 0], [1, 0], [0, 1]] if triangle else [[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=np.float64)
    inside = free.min() >= 0 and free.sum() <= 1 if triangle else np.abs(free).max() <= 1
    if inside:
        return free
    ends = np.roll(corners, -1, axis=0)
    best, least = at, np.inf
    for a, b in zip(corners, ends, strict=True):
        along = A @ (b - a)
        s = float(np.clip(A @ (free - a) @ along / max(float(along @ along), 1e-300), 0.0, 1.0))
        p = a + s * (b - a)
        away = float(np.linalg.norm(A @ (free - p)))
        if away < least:
            best, least = p, away
    return best


def _point(
    model: Model, part: _Part, N: FloatArray, foot: FloatArray, point: FloatArray, number: int, node: int
) -> SensorPoint:
    moves, turns = _motion(part, N)
    if part.kind != "solid":
        moves = moves + _across(point - foot) @ turns
    # from the frames of the nodes to that of the nearest one
    n = len(part.at)
    weights = np.einsum(
        "kab,kcb->kac", moves.reshape(3, 2 * n, 3).transpose(1, 0, 2), model.frames[np.repeat(part.at, 2)]
    )
    weights = np.einsum("ab,kbc->kac", model.frames[node], weights).transpose(1, 0, 2).reshape(3, 6 * n)
    rows = (6 * np.array(part.at)[:, None] + np.arange(6)).ravel()
    used = np.abs(weights).max(axis=0) > 0
    ids = tuple(int(model.node_ids[i]) for i in part.at)
    distance = float(np.linalg.norm(point - foot))
    distance = 0.0 if distance <= ROUNDING * float(np.ptp(part.x, axis=0).max()) else distance
    return SensorPoint(number, point, int(model.node_ids[node]), ids, distance, rows[used], weights[:, used])


def _motion(part: _Part, N: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Displacement and rotation (3, 6 n each), along basic axes, of the foot from those of the part's nodes."""
    n = len(part.at)
    moves, turns = np.zeros((3, n, 6)), np.zeros((3, n, 6))
    moves[:, :, :3] = N[:, None] * np.eye(3)[:, None, :]
    turns[:, :, 3:] = moves[:, :, :3]
    if part.kind == "beam":
        along = part.x[1] - part.x[0]
        length = max(float(np.linalg.norm(along)), 1e-300)
        e, s = along / length, float(N[1])
        axial = np.outer(e, e)
        level = np.array([1 - 3 * s**2 + 2 * s**3, 3 * s**2 - 2 * s**3])
        slope = length * np.array([s - 2 * s**2 + s**3, s**3 - s**2])
        d_level = np.array([6 * s**2 - 6 * s, 6 * s - 6 * s**2]) / length
        d_slope = np.array([1 - 4 * s + 3 * s**2, 3 * s**2 - 2 * s])
        # the slope of a section is its rotation across the axis
        tilt = -_across(e)  # e x u'
        for k in range(2):
            moves[:, k, :3] = N[k] * axial + level[k] * (np.eye(3) - axial)
            moves[:, k, 3:] = slope[k] * _across(e)
            turns[:, k, :3] = d_level[k] * tilt
            turns[:, k, 3:] = N[k] * axial + d_slope[k] * (np.eye(3) - axial)
    return moves.reshape(3, 6 * n), turns.reshape(3, 6 * n)


def _across(d: FloatArray) -> FloatArray:
    """The matrix (3, 3) that makes the displacement at `d` (3,) of a rotation about the origin: theta x d."""
    return np.array([[0.0, d[2], -d[1]], [-d[2], 0.0, d[0]], [d[1], -d[0], 0.0]])
