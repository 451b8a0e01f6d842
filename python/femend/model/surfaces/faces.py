"""Surfaces of a model: shells and free faces of solids, with the nodal loads of a pressure on them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from femend.errors import ModelError
from femend.model.cards.near_ids import near_ids
from femend.model.model import Model

__all__ = ["Surface", "face_shape", "nodal_loads", "outer_faces", "surface_of"]

FloatArray = NDArray[np.float64]
# corners of a face, and all its nodes
Face = tuple[tuple[int, ...], tuple[int, ...]]

SHELLS = {"CQUAD4": 4, "CQUADR": 4, "CTRIA3": 3, "CTRIAR": 3}
# corners of the faces, outward by the right hand, and the middle node of each edge (Nastran's order)
_HEXA = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
_PENTA = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_TETRA = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
_EDGES = {
    "CHEXA": "01 12 23 30 04 15 26 37 45 56 67 74",
    "CPENTA": "01 12 20 03 14 25 34 45 53",
    "CTETRA": "01 12 20 03 13 23",
}
SOLIDS = {"CHEXA": (8, _HEXA), "CPENTA": (6, _PENTA), "CTETRA": (4, _TETRA)}

_GAUSS = (-np.sqrt(0.6), 0.0, np.sqrt(0.6)), (5 / 9, 8 / 9, 5 / 9)
# seven points on a triangle, exact to the fifth degree (Cowper, Int. J. Num. Meth. Eng. 7 (1973) 405-408, table I)
_A, _B = (6 - np.sqrt(15)) / 21, (6 + np.sqrt(15)) / 21
_WA, _WB = (155 - np.sqrt(15)) / 1200, (155 + np.sqrt(15)) / 1200
_TRIANGLE = (
    [(1 / 3, 1 / 3, 0.225)]
    + [(x, y, _WA) for x, y in ((_A, _A), (1 - 2 * _A, _A), (_A, 1 - 2 * _A))]
    + [(x, y, _WB) for x, y in ((_B, _B), (1 - 2 * _B, _B), (_B, 1 - 2 * _B))]
)


@dataclass(frozen=True, eq=False)
class Surface:
    """Faces, each the positions of its nodes in the model (corners in order, then the middles of the edges), and
    `into` (n_faces,), the sign of a positive pressure along a face's normal: 1 on shells (along their normal), -1 on
    solids (into the body), as on PLOAD4.

    `nodes` (n,) ids of all nodes of the faces, in ascending order.
    """

    model: Model
    faces: tuple[tuple[int, ...], ...]
    into: FloatArray

    @property
    def at(self) -> NDArray[np.int64]:
        """Positions (n,) of the nodes in the model."""
        return np.array(sorted(set(chain.from_iterable(self.faces))), dtype=np.int64)

    @property
    def nodes(self) -> tuple[int, ...]:
        """Ids (n,) of the nodes."""
        return tuple(int(self.model.node_ids[i]) for i in self.at)

    def normals(self) -> FloatArray:
        """Directions (n, 3) in which a positive pressure pushes the nodes: means over the faces, of unit length."""
        where = {int(i): k for k, i in enumerate(self.at)}
        total = np.zeros((len(where), 3))
        for face, sign in zip(self.faces, self.into, strict=True):
            for N, dA in _points(self.model.xyz[list(face)]):
                for i, share in zip(face, np.abs(N), strict=True):
                    total[where[i]] += sign * share * dA
        return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)

    def area(self) -> float:
        """Area in the model's unit."""
        return float(sum(np.linalg.norm(dA) for f in self.faces for _, dA in _points(self.model.xyz[list(f)])))


def surface_of(model: Model, nodes: Collection[int]) -> Surface:
    """The surface between `nodes` (ids): shells whose corners are all among them, else free faces of solids.

    A face of a solid is free when it belongs to no second one. Raises ModelError where nothing lies between the nodes.
    """
    index = {int(n): i for i, n in enumerate(model.node_ids)}
    wanted = {int(n) for n in nodes}
    unknown = sorted(wanted - set(index))
    if unknown:
        near = near_ids(unknown[0], model.node_ids)
        raise ModelError(
            f"the model has no node {unknown[0]} ({len(unknown)} such nodes; {near}); give nodes of the deck"
        )
    shells, free = (
        [tuple(index[n] for n in face) for corners, face in faces if wanted.issuperset(corners)]
        for faces in outer_faces(model)
    )
    if not shells and not free:
        raise ModelError(
            f"no shell and no free face of a solid lies between the {len(wanted)} nodes {sorted(wanted)[:6]}...; give "
            "all nodes of the surface"
        )
    into = np.array([1.0] * len(shells) + [-1.0] * len(free))
    return Surface(model, (*shells, *free), into)


def outer_faces(model: Model) -> tuple[list[Face], list[Face]]:
    """Shells, and the faces of solids that belong to no second one: the corners (ids) of each, for solids outward by
    the right hand, and all of its nodes as `Surface.faces` has them."""
    shells: list[Face] = []
    solids: list[Face] = []
    for _, card, own in model.fe.elements():
        if card in SHELLS:
            corners = tuple(own[: SHELLS[card]])
            shells.append((corners, corners))
        elif card in SOLIDS:
            solids += _solid_faces(card, own)
    seen = Counter(frozenset(corners) for corners, _ in solids)
    return shells, [face for face in solids if seen[frozenset(face[0])] == 1]


def _solid_faces(card: str, nodes: list[int]) -> Iterator[Face]:
    """Corners of every face and all of its nodes; a face with a middle node missing counts as linear."""
    n_corners, faces = SOLIDS[card]
    middle = {}
    for edge, node in zip(_EDGES[card].split(), nodes[n_corners:], strict=False):
        if node:
            middle[frozenset((int(edge[0]), int(edge[1])))] = node
    for face in faces:
        corners = tuple(nodes[i] for i in face)
        edges = [frozenset((face[k], face[(k + 1) % len(face)])) for k in range(len(face))]
        more = tuple(middle[e] for e in edges) if all(e in middle for e in edges) else ()
        yield corners, (*corners, *more)


def _points(x: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Shape functions (n,) and directed area (3,) with its weight at the integration points of a face `x` (n, 3)."""
    if len(x) in (3, 6):
        for r, s, weight in _TRIANGLE:
            N, dr, ds = _triangle(r, s, len(x))
            yield N, 0.5 * weight * np.cross(dr @ x, ds @ x)
        return
    for r, a in zip(*_GAUSS, strict=True):
        for s, b in zip(*_GAUSS, strict=True):
            N, dr, ds = _quadrangle(r, s, len(x))
            yield N, a * b * np.cross(dr @ x, ds @ x)


def face_shape(r: float, s: float, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """N, dN/dr, dN/ds (n,) of a face of `n` nodes (3, 6: a triangle; 4, 8) at its coordinates `r`, `s`."""
    return _triangle(r, s, n) if n in (3, 6) else _quadrangle(r, s, n)


def _triangle(r: float, s: float, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """N, dN/dr, dN/ds of 3 or 6 nodes (Bathe, Finite Element Procedures, 2nd ed., figure 5.11)."""
    L = np.array([1 - r - s, r, s])
    dL = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    if n == 3:
        return L, dL[0], dL[1]
    pairs = ((0, 1), (1, 2), (2, 0))
    N = np.array([*(L * (2 * L - 1)), *(4 * L[i] * L[j] for i, j in pairs)])
    dN = [[*((4 * L - 1) * d), *(4 * (d[i] * L[j] + L[i] * d[j]) for i, j in pairs)] for d in dL]
    return N, np.array(dN[0]), np.array(dN[1])


def _quadrangle(r: float, s: float, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """N, dN/dr, dN/ds of 4 or 8 nodes (Bathe, Finite Element Procedures, 2nd ed., figure 5.4)."""
    R, S = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])
    a, b = 1 + R * r, 1 + S * s
    if n == 4:
        return 0.25 * a * b, 0.25 * R * b, 0.25 * S * a
    k = R * r + S * s - 1
    corner = 0.25 * a * b * k
    dr, ds = 0.25 * R * b * (k + a), 0.25 * S * a * (k + b)
    middle = [0.5 * (1 - r * r) * (1 - s), 0.5 * (1 + r) * (1 - s * s), 0.5 * (1 - r * r) * (1 + s),
              0.5 * (1 - r) * (1 - s * s)]  # fmt: skip
    mr = [-r * (1 - s), 0.5 * (1 - s * s), -r * (1 + s), -0.5 * (1 - s * s)]
    ms = [-0.5 * (1 - r * r), -s * (1 + r), 0.5 * (1 - r * r), -s * (1 - r)]
    return np.array([*corner, *middle]), np.array([*dr, *mr]), np.array([*ds, *ms])


def nodal_loads(surface: Surface, pressure: FloatArray) -> FloatArray:
    """Forces (n_g, m) of m pressures on a `surface`, `pressure` (n, m) being their values at its nodes.

    Consistent with the elements' shape functions: F_i = int N_i p n dA, p = sum N_j p_j (Bathe, Finite Element
    Procedures, 2nd ed., eq. 4.19 with section 4.2.1), in the displacement frames of the g-set. No moments. Raises
    ModelError for a pressure of another length.
    """
    at, p = surface.at, np.asarray(pressure, dtype=np.float64)
    if p.ndim != 2 or len(p) != len(at):
        raise ModelError(f"pressures of shape {p.shape} on a surface of {len(at)} nodes; they must be (n_nodes, n)")
    model = surface.model
    where = {int(i): k for k, i in enumerate(at)}
    forces = np.zeros((len(model.node_ids), 3, p.shape[1]))
    for face, sign in zip(surface.faces, surface.into, strict=True):
        rows = [where[i] for i in face]
        for N, dA in _points(model.xyz[list(face)]):
            local = sign * np.outer(dA, N @ p[rows])
            for i, share in zip(face, N, strict=True):
                forces[i] += share * local
    found = np.zeros((len(model.node_ids), 6, p.shape[1]))
    found[:, :3] = np.einsum("nij,njm->nim", model.frames, forces)
    return np.asarray(found.reshape(-1, p.shape[1]))
