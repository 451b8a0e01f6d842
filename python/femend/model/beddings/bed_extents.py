"""Beddings that begin and end elsewhere than one at hand, by a node of its line or a row of faces of its area."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from femend.model.beddings.bed_places import Beds
from femend.model.beddings.bed_stretches import FEWEST, Drawn, Stretch, Surface, lines_and_surfaces, of_area, of_line
from femend.model.places.place import AXES, Place
from femend.model.places.region_places import Group, pieces

__all__ = ["BedExtents"]

FloatArray = NDArray[np.float64]

# nodes of a line, and faces across an area, on either side of a node, with which a bedding about it begins
ABOUT = (1, 2, 4)
# how far the ends of a line, and the sides of an area along each axis, are moved out at once
STEPS = [step for step in product((-1, 0, 1), repeat=2) if any(step)]
# cosine between a node's axis and a basic one from which they are one
SAME = 0.999


class BedExtents:
    """Beddings of a reduced model with any ends, of which `beds` makes places."""

    def __init__(self, beds: Beds) -> None:
        self._beds = beds

    @cached_property
    def _drawn(self) -> Drawn:
        return lines_and_surfaces(self._beds.model.as_drawn)

    def about(self, place: Place) -> list[Place]:
        """Beddings of a few nodes or faces about the node of a place on the ground; none where it turns, or acts along
        no basic axis."""
        (node,), xyz = place.nodes, self._drawn.xyz
        axis = self._axis(place)
        if axis is None or node not in xyz:
            return []
        made: list[tuple[Stretch, int]] = []
        for line in (line for line in self._drawn.lines if node in line):
            at, last = line.index(node), len(line) - 1
            made += [(of_line(line, xyz, max(at - n, 0), min(at + n, last)), axis) for n in ABOUT]
        for surface in (s for s in self._drawn.surfaces if s.axis == axis):
            if any(node in face for face in surface.corners):
                grid = _Faces(surface, xyz)
                around = [i for i, face in enumerate(surface.corners) if node in face]
                made += [(one, axis) for n in ABOUT for one in grid.moved(around, (1 - n,) * 2, (n - 1,) * 2)]
        return self._places(made)

    def next_to(self, bed: Place) -> list[Place]:
        """The bedding with its ends or sides moved by a node or a row of faces, out, in, or to one side."""
        nodes, xyz = set(bed.bed_nodes), self._drawn.xyz
        axis = AXES.index(bed.direction)
        made: list[tuple[Stretch, int]] = []
        for line in (line for line in self._drawn.lines if nodes <= set(line)):
            at = [i for i, n in enumerate(line) if n in nodes]
            for left, right in STEPS:
                first, last = max(at[0] - left, 0), min(at[-1] + right, len(line) - 1)
                made += [(of_line(line, xyz, first, last), axis)] if last - first + 1 >= FEWEST else []
        for surface in (s for s in self._drawn.surfaces if s.axis == axis):
            own = [i for i, face in enumerate(surface.corners) if nodes.issuperset(face)]
            if nodes <= {n for i in own for n in surface.corners[i]}:
                grid = _Faces(surface, xyz)
                sides = [((low, 0), (high, 0)) for low, high in STEPS] + [((0, low), (0, high)) for low, high in STEPS]
                made += [(one, axis) for low, high in sides for one in grid.moved(own, low, high)]
        return self._places(made)

    def _axis(self, place: Place) -> int | None:
        """The basic axis along which a place on the ground acts; None for another direction, or a rotation."""
        if place.direction not in AXES[:3]:
            return None
        model = self._beds.model
        along = np.abs(model.frames[model.index(place.nodes[0])][AXES.index(place.direction)])
        return int(np.argmax(along)) if along.max() > SAME else None

    def _places(self, made: Sequence[tuple[Stretch, int]]) -> list[Place]:
        """Places of the stretches along their axes, each once."""
        found: dict[frozenset[int], Place] = {}
        for stretch, axis in made:
            place = self._beds.under(stretch, axis) if axis in stretch.axes else None
            if place is not None:
                found.setdefault(frozenset(place.bed_nodes), place)
        return list(found.values())


class _Faces:
    """Faces of a surface by where their middles are along the two axes it lies in; `xyz` (3,) of every node."""

    def __init__(self, surface: Surface, xyz: dict[int, FloatArray]) -> None:
        self._surface, self._xyz = surface, xyz
        flat = [k for k in range(3) if k != surface.axis]
        corners = [np.array([xyz[n] for n in face])[:, flat] for face in surface.corners]
        self._at = np.array([c.mean(axis=0) for c in corners])
        self._width = np.median([np.ptp(c, axis=0) for c in corners], axis=0)

    def moved(self, own: Sequence[int], low: tuple[int, int], high: tuple[int, int]) -> Iterator[Stretch]:
        """The box of the faces `own` with its lower and upper sides moved by so many faces along the two axes; nothing
        where no face is left, or they do not hang together."""
        at, reach = self._at[list(own)], 0.01 * self._width
        first = at.min(axis=0) + np.array(low) * self._width - reach
        last = at.max(axis=0) + np.array(high) * self._width + reach
        inside = np.flatnonzero(((self._at >= first) & (self._at <= last)).all(axis=1)).tolist()
        corners = tuple(self._surface.corners[i] for i in inside)
        if inside and len(pieces(Group(tuple(range(len(inside))), corners, self._at[inside]))) == 1:
            yield of_area(self._surface, inside, self._xyz)
