"""Straight lines and areas of a deck that an elastic bedding may hold: whole ones, and parts of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.places.places import topology
from femend.model.places.region_places import Group, boxes, pieces
from femend.model.surfaces.faces import outer_faces

__all__ = ["FEWEST", "Drawn", "Stretch", "Surface", "lines_and_surfaces", "of_area", "of_line", "stretches"]

FloatArray = NDArray[np.float64]

# cosine of the angle between elements from which a line of them is straight; between a face's normal, or a line, and
# an axis from which the one is along the other
STRAIGHT, ALONG = 0.999, 0.9
# nodes that can move which a line or an area has at least
FEWEST = 3
# parts side by side, which overlap by half, of a line, and of the longer and the shorter side of an area
LINE_PARTS, AREA_PARTS = (2, 3, 5), ((2, 1), (1, 2), (2, 2), (3, 2))
# nodes of the deck up to which areas are taken in parts too
PARTED = 5000


@dataclass(frozen=True, eq=False)
class Stretch:
    """Nodes with the shares (n,) that each stands for, those at the ends or corners, the axes a bedding may act in, and
    what it is in words."""

    nodes: tuple[int, ...]
    shares: FloatArray
    ends: tuple[int, ...]
    axes: tuple[int, ...]
    what: str


def stretches(model: Model) -> Iterator[Stretch]:
    """Lines and areas of the deck, whole ones before parts."""
    drawn = lines_and_surfaces(model)
    xyz, top = drawn.xyz, topology(model)
    for line in drawn.lines:
        yield from _parts(line, xyz)
    yield from (of_area(s, range(len(s.corners)), xyz) for s in drawn.surfaces)
    for *_, chain in top.members:
        yield from (s for line in _straight([top.beams[e] for e in chain], xyz) for s in _parts(line, xyz))
    for parts in LINE_PARTS:
        for line in drawn.lines:
            yield from _parts(line, xyz, parts)
    if len(xyz) > PARTED:
        return
    for long, short in AREA_PARTS:
        for surface in drawn.surfaces:
            group = Group(tuple(range(len(surface.corners))), surface.corners, surface.middles(xyz))
            sides = np.ptp(group.at, axis=0)
            per_side = np.where(np.arange(3) == surface.axis, 1, np.where(sides == sides.max(), long, short))
            for box in boxes(group, per_side):
                yield of_area(surface, box, xyz)


@dataclass(frozen=True, eq=False)
class Drawn:
    """The nodes' coordinates (3,) by id, straight lines of beams and of free edges of shells, each as its nodes in
    order, and surfaces."""

    xyz: dict[int, FloatArray]
    lines: list[list[int]]
    surfaces: list[Surface]


def lines_and_surfaces(model: Model) -> Drawn:
    """What of a deck a bedding may hold."""
    xyz = {int(n): x for n, x in zip(model.node_ids, model.xyz, strict=True)}
    shells, skin = ([corners for corners, _ in faces] for faces in outer_faces(model))
    surfaces = [*_surfaces(shells, xyz, shell=True), *_surfaces(skin, xyz, shell=False)]
    edges = [edge for faces in surfaces if faces.shell for edge in _free_edges(faces.corners)]
    lines = [*_straight(list(topology(model).beams.values()), xyz), *_straight(edges, xyz)]
    return Drawn(xyz, lines, surfaces)


@dataclass(frozen=True, eq=False)
class Surface:
    """Faces that hang together and look along one axis, by the ids of their corners."""

    corners: tuple[tuple[int, ...], ...]
    axis: int
    shell: bool

    def middles(self, xyz: dict[int, FloatArray]) -> FloatArray:
        """Middles (n, 3) of the faces; `xyz` (3,) of every node."""
        return np.array([np.mean([xyz[n] for n in face], axis=0) for face in self.corners])


def _surfaces(faces: Sequence[tuple[int, ...]], xyz: dict[int, FloatArray], *, shell: bool) -> list[Surface]:
    """Faces that look along one axis, on one side of a body, and hang together."""
    found = []
    normals = np.array([_normal([xyz[n] for n in face]) for face in faces]).reshape(-1, 3)
    lengths = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    for axis in range(3):
        along = normals[:, axis] / lengths
        for side in [np.abs(along) > ALONG] if shell else [along > ALONG, along < -ALONG]:
            own = [faces[i] for i in np.flatnonzero(side).tolist()]
            group = Group(tuple(range(len(own))), tuple(own), np.zeros((len(own), 3)))
            found += [Surface(tuple(own[i] for i in piece), axis, shell) for piece in (pieces(group) if own else [])]
    return found


def _normal(corners: Sequence[FloatArray]) -> FloatArray:
    """Normal (3,) of a face, as long as its area."""
    x = np.array(corners) - corners[0]
    return np.asarray(0.5 * np.cross(x, np.roll(x, -1, axis=0)).sum(axis=0))


def of_area(surface: Surface, faces: Sequence[int], xyz: dict[int, FloatArray]) -> Stretch:
    """Some of a surface's faces, every node with its share of their area; `xyz` (3,) of every node."""
    share: dict[int, float] = {}
    for face in (surface.corners[i] for i in faces):
        area = float(np.linalg.norm(_normal([xyz[n] for n in face])))
        for n in face:
            share[n] = share.get(n, 0.0) + area / len(face)
    nodes = tuple(sorted(share))
    at = np.array([xyz[n] for n in nodes])
    flat = [k for k in range(3) if k != surface.axis]
    signs = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))  # around
    middle = at.mean(axis=0)
    ends = [nodes[int(np.argmax(np.round((at - middle)[:, flat] @ np.array(sign), 9)))] for sign in signs]
    return Stretch(nodes, np.array([share[n] for n in nodes]), tuple(dict.fromkeys(ends)), (surface.axis,),
                    "bedding of the area between nodes")  # fmt: skip


def _free_edges(faces: Sequence[tuple[int, ...]]) -> list[tuple[int, int]]:
    """Edges that belong to one face alone."""
    edges = [tuple(sorted((face[i - 1], face[i]))) for face in faces for i in range(len(face))]
    seen = Counter(edges)
    return [(a, b) for a, b in dict.fromkeys(edges) if seen[a, b] == 1]


def _straight(edges: Sequence[tuple[int, int]], xyz: dict[int, FloatArray]) -> list[list[int]]:
    """Straight lines of edges that meet, each as its nodes in order."""
    at: dict[int, list[int]] = {}
    for i, (a, b) in enumerate(edges):
        at.setdefault(a, []).append(i)
        at.setdefault(b, []).append(i)
    left, lines = dict.fromkeys(range(len(edges))), []
    while left:
        first = next(iter(left))
        del left[first]
        line = list(edges[first])
        for end in (0, -1):
            while (further := _next(line, end, at, edges, left, xyz)) is not None:
                line.insert(0 if end == 0 else len(line), further)
        lines.append(line)
    return lines


def _next(
    line: list[int], end: int, at: dict[int, list[int]], edges: Sequence[tuple[int, int]], left: dict[int, None],
    xyz: dict[int, FloatArray],
) -> int | None:  # fmt: skip
    """The node by which a line goes straight on at its first (`end` 0) or last node, whose edge is taken from `left`;
    None where it ends."""
    node, before = line[end], line[1] if end == 0 else line[-2]
    along = xyz[node] - xyz[before]
    for i in at[node]:
        if i not in left:
            continue
        other = edges[i][0] if edges[i][1] == node else edges[i][1]
        onward = xyz[other] - xyz[node]
        if along @ onward > STRAIGHT * np.linalg.norm(along) * np.linalg.norm(onward):
            del left[i]
            return other
    return None


def _parts(line: Sequence[int], xyz: dict[int, FloatArray], parts: int = 1) -> Iterator[Stretch]:
    """A line, or parts of it as `LINE_PARTS`."""
    s = _lengths(line, xyz)
    for start in np.arange(2 * parts - 1) / (2 * parts):
        inside = np.flatnonzero((s >= s[-1] * (start - 1e-9)) & (s <= s[-1] * (start + 1 / parts + 1e-9)))
        if len(inside) >= FEWEST:
            yield of_line(line, xyz, int(inside[0]), int(inside[-1]))


def _lengths(line: Sequence[int], xyz: dict[int, FloatArray]) -> FloatArray:
    """Lengths (n,) along a line up to its nodes."""
    x = np.array([xyz[n] for n in line])
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])


def of_line(line: Sequence[int], xyz: dict[int, FloatArray], first: int, last: int) -> Stretch:
    """Nodes `first` to `last` (positions) of a line, each with the length that it stands for, along the axes across;
    `xyz` (3,) of every node."""
    s = _lengths(line, xyz)
    along = np.abs(xyz[line[-1]] - xyz[line[0]]) / max(float(s[-1]), 1e-300)
    axes = tuple(k for k in range(3) if along[k] <= ALONG)
    share = np.gradient(s[first : last + 1])
    share[[0, -1]] *= 0.5
    nodes = tuple(line[first : last + 1])
    return Stretch(nodes, share, (nodes[0], nodes[-1]), axes, "bedding of the line between nodes")
