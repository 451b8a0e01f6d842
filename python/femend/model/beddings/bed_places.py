"""Elastic beddings as places: lines and areas of nodes that may stand on something the model does not have.

A bedding (Winkler, Die Lehre von der Elasticitaet und Festigkeit, Prague 1867, § 195) holds every node of a straight
line of beams, of a straight free edge of shells or of an area of shells or of the skin of solids by a spring to ground
along a basic axis, as stiff as the length or area is large that the node stands for. It has one unknown, its stiffness
in all, sought around a share of what the modes themselves have there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.model.beddings.bed_stretches import FEWEST, Stretch, stretches
from femend.model.free_body import is_elastic
from femend.model.mesh.form_errors import basis_modes
from femend.model.places.place import AXES, Place
from femend.model.places.places import held_rows
from femend.model.reduced.reduction import ReducedModel

__all__ = ["Beds", "bed_places"]

FloatArray = NDArray[np.float64]

# share of the least stiffness that a mode of the band has in what a bedding holds, around which the bedding is sought
SOUGHT = 0.1
# places at most
MAX_BEDS = 300
# share of a mode's motion below which a bedding that moves no more is not moved by it
ROUNDING = 1e-9


def bed_places(reduced: ReducedModel, f_max: float) -> list[Place]:
    """Beddings under the straight lines and areas of the deck, single members, and parts of lines and areas, at
    most `MAX_BEDS`, that something moves in modes up to `f_max` (Hz)."""
    beds = Beds(reduced, f_max)
    places: list[Place] = []
    taken: set[tuple[str, frozenset[int]]] = set()
    for stretch in stretches(reduced.model.as_drawn):
        for axis in stretch.axes:
            place = beds.under(stretch, axis)
            if place is None:
                continue
            key = place.direction, frozenset(place.bed_nodes)
            if key in taken:
                continue
            taken.add(key)
            places.append(place)
            if len(places) == MAX_BEDS:
                return places
    return places


class Beds:
    """Makes places of stretches of a reduced model's deck, sought by what they do to modes up to `f_max` (Hz)."""

    def __init__(self, reduced: ReducedModel, f_max: float) -> None:
        omega, Q = basis_modes(reduced)
        elastic = is_elastic(omega)
        band = elastic & (omega <= max(2 * np.pi * f_max, omega[elastic].min()))
        self.model = reduced.model
        self._held = held_rows(reduced.model)
        self._shapes, self._stiffness = reduced.V @ Q[:, band], omega[band] ** 2

    def under(self, stretch: Stretch, axis: int) -> Place | None:
        """The stretch on a bedding along a basic axis; None where too little of it can move, or nothing moves it."""
        bed = []
        for node, share in zip(stretch.nodes, stretch.shares.tolist(), strict=True):
            i = self.model.index(node)
            along = self.model.frames[i][:, axis]
            rows = 6 * i + np.flatnonzero((np.abs(along) > 1e-12) & ~self._held[6 * i : 6 * i + 3])
            if len(rows) and share > 0:
                bed.append((node, rows, np.sqrt(share) * along[rows - 6 * i]))
        if len(bed) < FEWEST:
            return None
        # of stiffness 1 in all
        whole = np.sqrt(sum(float(x @ x) for _, _, x in bed))
        moved = sum(((x / whole) @ self._shapes[rows]) ** 2 for _, rows, x in bed)
        if np.max(moved) <= ROUNDING * float((self._shapes**2).max()):
            return None
        scale = np.sqrt(SOUGHT * float((self._stiffness / np.maximum(moved, 1e-300)).min())) / whole
        ends = ", ".join(map(str, stretch.ends))
        return Place(
            "bed", stretch.ends, AXES[axis], "ground", label=f"{stretch.what} {ends} to ground, {AXES[axis]}",
            bed=tuple((n, rows, scale * x) for n, rows, x in bed),
        )  # fmt: skip
