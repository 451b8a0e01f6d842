"""Elastic beddings as places: lines and areas of nodes that may stand on something the model does not have.

A bedding (Winkler, Die Lehre von der Elasticitaet und Festigkeit, Prague 1867, § 195) holds every node of a straight
line of beams, of a straight free edge of shells or of an area of shells or of the skin of solids by a spring to ground
along a basic axis, as stiff as the length or area is large that the node stands for. It has one unknown, its stiffness
in all, sought around a share of what the modes themselves have there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.model.faces import outer_faces
from femend.model.form_errors import basis_modes
from femend.model.free_body import is_elastic
from femend.model.model import Model
from femend.model.place import AXES, Place
from femend.model.places import held_rows, topology
from femend.model.reduction import ReducedModel
from femend.model.region_places import Group, boxes, pieces

__all__ = ["bed_places"]

FloatArray = NDArray[np.float64]

# share of the least stiffness that a mode of the band has in what a bedding holds, around which the bedding is sought
SOUGHT = 0.1
# cosine of the angle between elements from which a line of them is straight; between a face's normal, or a line, and
# an axis from which the one is along the other
STRAIGHT, ALONG = 0.999, 0.9
# nodes that can move which a line or an area has at least
FEWEST = 3
# parts side by side, which overlap by half, of a line, and of the longer and the shorter side of an area
LINE_PARTS, AREA_PARTS = (2, 3, 5), ((2, 1), (1, 2), (2, 2), (3, 2))
# nodes of the deck up to which areas are taken in parts too, and places at most
PARTED, MAX_BEDS = 5000, 300
# share of a mode's motion below which a bedding that moves no more is not moved by it
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class _Stretch:
    """Nodes with the shares (n,) that each stands for, those at the ends or corners, the axes a bedding may act in, and
    what it is in words."""

    nodes: tuple[int, ...]
    shares: FloatArray
    ends: tuple[int, ...]
    axes: tuple[int, ...]
    what: str


def bed_places(reduced: ReducedModel, f_max: float) -> list[Place]:
    """Beddings under the straight lines and areas of the deck, single members, and parts of lines and areas, at
    most `MAX_BEDS`, that something moves in modes up to `f_max` (Hz)."""
    model = reduced.model
    omega, Q = basis_modes(reduced)
    elastic = is_elastic(omega)
    band = elastic & (omega <= max(2 * np.pi * f_max, omega[elastic].min()))
    shapes, stiffness = reduced.V @ Q[:, band], omega[band] ** 2
    held = held_rows(model)
    places: list[Place] = []
    taken: set[tuple[int, frozenset[int]]] = set()
    for stretch in _stretches(model.as_drawn):
        for axis in stretch.axes:
            place = _place(model, stretch, axis, held)
            if place is None:
                continue
            key = axis, frozenset(n for n, _, _ in place.bed)
            moved = sum((x @ shapes[rows]) ** 2 for _, rows, x in place.bed)
            if key in taken or np.max(moved) <= ROUNDING * float((shapes**2).max()):
                continue
            taken.add(key)
            scale = np.sqrt(SOUGHT * float((stiffness / np.maximum(moved, 1e-300)).min()))
            places.append(replace(place, bed=tuple((n, rows, scale * x) for n, rows, x in place.bed)))
            if len(places) == MAX_BEDS:
                return places
    return places


def _place(model: Model, stretch: _Stretch, axis: int, held: NDArray[np.bool_]) -> Place | None:
    """The stretch on a bedding of stiffness 1 in all along a basic axis; None where too little of it can move."""
    bed = []
    for node, share in zip(stretch.nodes, stretch.shares.tolist(), strict=True):
        i = model.index(node)
        along = model.frames[i][:, axis]
        rows = 6 * i + np.flatnonzero((np.abs(along) > 1e-12) & ~held[6 * i : 6 * i + 3])
        if len(rows) and share > 0:
            bed.append((node, rows, np.sqrt(share) * along[rows - 6 * i]))
    if len(bed) < FEWEST:
        return None
    whole = sum(float(x @ x) for _, _, x in bed)
    ends = ", ".join(map(str, stretch.ends))
    return Place(
        "bed", stretch.ends, AXES[axis], "ground", label=f"{stretch.what} {ends} to ground, {AXES[axis]}",
        bed=tuple((n, rows, x / np.sqrt(whole)) for n, rows, x in bed),
    )  # fmt: skip


def _stretches(model: Model) -> Iterator[_Stretch]:
    """Lines and areas of the deck, whole ones before parts."""
    xyz = {int(n): x for n, x in zip(model.node_ids, model.xyz, strict=True)}
    top = topology(model)
    shells, skin = ([corners for corners, _ in faces] for faces in outer_faces(model))
    surfaces = [*_surfaces(shells, xyz, shell=True), *_surfaces(skin, xyz, shell=False)]
    edges = [edge for faces in surfaces if faces.shell for edge in _free_edges(faces.corners)]
    lines = [*_straight(list(top.beams.values()), xyz), *_straight(edges, xyz)]
    for line in lines:
        yield from _of_line(line, xyz)
    yield from (_of_area(s, range(len(s.corners)), xyz) for s in surfaces)
    for *_, chain in top.members:
        yield from (s for line in _straight([top.beams[e] for e in chain], xyz) for s in _of_line(line, xyz))
    for parts in LINE_PARTS:
        for line in lines:
            yield from _of_line(line, xyz, parts)
    if len(xyz) > PARTED:
        return
    for long, short in AREA_PARTS:
        for surface in surfaces:
            group = Group(tuple(range(len(surface.corners))), surface.corners, surface.middles(xyz))
            sides = np.ptp(group.at, axis=0)
            per_side = np.where(np.arange(3) == surface.axis, 1, np.where(sides == sides.max(), long, short))
            for box in boxes(group, per_side):
                yield _of_area(surface, box, xyz)


@dataclass(frozen=True, eq=False)
class _Surface:
    """Faces that hang together and look along one axis, by the ids of their corners."""

    corners: tuple[tuple[int, ...], ...]
    axis: int
    shell: bool

    def middles(self, xyz: dict[int, FloatArray]) -> FloatArray:
        """Middles (n, 3) of the faces; `xyz` (3,) of every node."""
        return np.array([np.mean([xyz[n] for n in face], axis=0) for face in self.corners])


def _surfaces(faces: Sequence[tuple[int, ...]], xyz: dict[int, FloatArray], *, shell: bool) -> list[_Surface]:
    """Faces that look along one axis, on one side of a body, and hang together."""
    found = []
    normals = np.array([_normal([xyz[n] for n in face]) for face in faces]).reshape(-1, 3)
    lengths = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    for axis in range(3):
        along = normals[:, axis] / lengths
        for side in [np.abs(along) > ALONG] if shell else [along > ALONG, along < -ALONG]:
            own = [faces[i] for i in np.flatnonzero(side).tolist()]
            group = Group(tuple(range(len(own))), tuple(own), np.zeros((len(own), 3)))
            found += [_Surface(tuple(own[i] for i in piece), axis, shell) for piece in (pieces(group) if own else [])]
    return found


def _normal(corners: Sequence[FloatArray]) -> FloatArray:
    """Normal (3,) of a face, as long as its area."""
    x = np.array(corners) - corners[0]
    return np.asarray(0.5 * np.cross(x, np.roll(x, -1, axis=0)).sum(axis=0))


def _of_area(surface: _Surface, faces: Sequence[int], xyz: dict[int, FloatArray]) -> _Stretch:
    """Some of a surface's faces, every node with its share of their area."""
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
    return _Stretch(nodes, np.array([share[n] for n in nodes]), tuple(dict.fromkeys(ends)), (surface.axis,),
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


def _of_line(line: Sequence[int], xyz: dict[int, FloatArray], parts: int = 1) -> Iterator[_Stretch]:
    """A line, or parts of it as `LINE_PARTS`, every node with the length that it stands for, along the axes across."""
    x = np.array([xyz[n] for n in line])
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
    along = np.abs(x[-1] - x[0]) / max(float(s[-1]), 1e-300)
    axes = tuple(k for k in range(3) if along[k] <= ALONG)
    for start in np.arange(2 * parts - 1) / (2 * parts):
        inside = (s >= s[-1] * (start - 1e-9)) & (s <= s[-1] * (start + 1 / parts + 1e-9))
        own, nodes = s[inside], tuple(np.array(line)[inside].tolist())
        if len(own) >= FEWEST:
            share = np.gradient(own)
            share[[0, -1]] *= 0.5
            yield _Stretch(nodes, share, (nodes[0], nodes[-1]), axes, "bedding of the line between nodes")
