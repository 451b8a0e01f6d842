"""What is said of a test's geometry on the model's, with node ids, the unit of the file, and what to do."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.correlate import Alignment
from femend.numerals import plain

__all__ = ["shift_words", "told_of", "unit_words"]

# how a note of `align_points` ends that asks for what a study has no key for
MATES = "; give the `mate` of each"
# how a note ends whose turn makes no sensor's direction an axis of the model, and what to do then
SKEW = "about an axis of its own"
TURN_BACK = (
    ": its sensors look along no axes of the model, and are compared as if they did; write coordinates, shapes and "
    "functions in the model's axes, or give the nodes of the sensors displacement systems (CD) along the test's"
)
# points that are off of which each is named; more, or more than a third of all, say that the geometries do not fit
NAMED, MISPLACED = 6, 1 / 3
# length units by their size in m
LENGTHS = {1.0: "m", 1e-3: "mm", 0.01: "cm", 0.0254: "in", 0.3048: "ft"}
WHAT_TO_DO = (
    ", and it is left as it is; write the test's coordinates in the axes and from the origin of the model, or give its "
    "nodes the numbers of the model's"
)


def unit_words(scale: float, unit: float | None) -> str | None:
    """What a `scale` of the geometry says of the unit of its file, which was read in `unit` m as the file states, None
    where it states none and was taken for m; None where the scale is that of no unit."""
    read = 1.0 if unit is None else unit
    of, was = _length(scale * read), _length(read)
    if of is None:
        return None
    told = f"scale {plain(scale)}: its coordinates are in {of} but were read as {was or f'{plain(read)} m'}, "
    return told + ("as the file states no unit (data set 164)" if unit is None else "as data set 164 states")


def _length(size: float) -> str | None:
    return next((name for u, name in LENGTHS.items() if abs(size / u - 1) < 1e-6), None)


def told_of(
    found: Alignment,
    nodes: Sequence[int],
    ids: NDArray[np.int64],
    unit: float | None,
    passed: Collection[int] = (),
    *,
    applied: bool,
    decided: bool = False,
) -> tuple[str, ...]:
    """The notes of `align_points` with node ids of the test and of the model in the place of row numbers, and the unit
    of the file (`unit_words`); without those of nodes that are `passed` over, nor of others that fit as well where the
    geometry is `decided` as it is. Where too many nodes are off to name them it is said that nothing fits."""
    if len(found.off) > min(NAMED, max(1, MISPLACED * len(nodes))):
        return (
            f"test geometry: no one unit, turn of axes and shift brings it onto the model; {len(found.off)} of its "
            f"{len(nodes)} nodes stay off, by up to {plain(float(found.distance.max()))}",
        )
    told, points = [], []
    for note in found.notes:
        words = note.split()
        if words[:2] == ["test", "point"]:
            test, model = nodes[int(words[2])], int(ids[int(words[-1])])
            if not (test == model and test in passed):
                points.append(f"test node {test} is {words[4]} from node {model} of the model")
            continue
        if words[:2] == ["test", "points"]:
            note = f"test nodes {nodes[int(words[2])]} and {nodes[int(words[4])]} are exchanged"
        elif words[0] == "scale":
            note = unit_words(found.scale, unit) or note
        elif note.endswith(SKEW):
            note += TURN_BACK
        elif note.endswith(MATES):
            if decided:
                continue
            note = note.removesuffix(MATES) + WHAT_TO_DO
        elif (found.alike and note == found.notes[-1] and not applied) or (not found.decided and words[0] == "test"):
            continue  # what was preferred where nothing was applied; one turn of several
        told.append(note)
    return tuple(f"test geometry: {note}" for note in (*told, *points))


def shift_words(shift: NDArray[np.float64], tolerance: float) -> str:
    """Components of a `shift` (3,) in brackets, those below a thousandth of the pairing's `tolerance` as 0; nothing
    where all are."""
    v = np.where(np.abs(shift) > 1e-3 * tolerance, shift, 0.0)
    return f"({', '.join(plain(float(x)) for x in v)})" if v.any() else ""
