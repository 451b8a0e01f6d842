"""The mesh, sensors and shakers as the report draws them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from femend.data import Channel, Test
from femend.model import Model, Pairing
from femend.model.places.places import held_rows
from femend.numerals import plain
from femend.report.content import Marker, MeshPicture
from femend.units import unit_system

__all__ = ["markers", "mesh_picture"]

# number of corners of a solid, and the corners of its sides in the order of the card
_SIDES: dict[str, tuple[int, tuple[tuple[int, ...], ...]]] = {
    "CTETRA": (4, ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3))),
    "CPYRAM": (5, ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))),
    "CPENTA": (6, ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))),
    "CHEXA": (8, ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))),
}
# corners of the shells whose further nodes lie in the middle of their edges
_SHELL_CORNERS = {"CTRIA3": 3, "CTRIA6": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUAD8": 4, "CQUADR": 4, "CSHEAR": 4}


def mesh_picture(model: Model) -> MeshPicture:
    """Lines, faces (of solids the outer skin alone) and supports of a model; coordinates in its length unit.

    Scalar points have no place in it.
    """
    grid = ~model.is_scalar
    at = {int(node): i for i, node in enumerate(model.node_ids[grid])}
    lines: list[tuple[int, int]] = []
    faces: list[list[int]] = []
    sides: list[tuple[int, ...]] = []
    for _, card, nodes in model.fe.elements():
        index = [at[n] for n in nodes if n in at]
        solid = _SIDES.get(card)
        if solid is not None and len(index) >= solid[0]:
            sides += [tuple(index[k] for k in side) for side in solid[1]]
        elif card in _SHELL_CORNERS and len(index) >= _SHELL_CORNERS[card]:
            faces.append(index[: _SHELL_CORNERS[card]])
        elif len(index) > 1:  # bars, springs, dashpots, and what ties several nodes to its first
            lines += [(index[0], other) for other in index[1:] if other != index[0]]
    times = Counter(frozenset(side) for side in sides)
    faces += [list(side) for side in sides if times[frozenset(side)] == 1]
    quads = [[*face, *face[-1:] * (4 - len(face))] for face in faces]
    held = np.array([rows[:3].all() for rows in held_rows(model).reshape(-1, 6)[grid]], dtype=np.bool_)
    used = np.zeros(len(held), dtype=np.bool_)
    used[[k for part in (*lines, *faces) for k in part]] = True
    return MeshPicture(
        np.asarray(model.node_ids[grid]),
        np.asarray(model.xyz[grid]),
        np.array(lines, dtype=np.int64).reshape(-1, 2),
        np.array(quads, dtype=np.int64).reshape(-1, 4),
        tuple(int(n) for n in model.node_ids[grid][held & used]),
        unit_system(model.units).length_text,
    )


def markers(test: Test, model: Model, pairing: Pairing) -> tuple[tuple[Marker, ...], tuple[Marker, ...]]:
    """Sensors and shakers of the fit recordings at their nodes of the model, with the distance to where they stood."""
    fit = test.role("fit")
    return (
        _markers(fit.sensors, model, pairing),
        _markers((c for recording in fit for c in recording.inputs), model, pairing),
    )


def _markers(channels: Iterable[Channel], model: Model, pairing: Pairing) -> tuple[Marker, ...]:
    found: dict[str, Marker] = {}
    for channel in channels:
        if channel.dof is None or str(channel.dof) in found:
            continue
        pair = pairing[channel.dof]
        axis = model.frames[model.index(pair.dof.node)][(pair.dof.component - 1) % 3] * pair.dof.sign
        found[str(channel.dof)] = Marker(
            str(pair.dof), pair.dof.node, _label(channel, pair.distance), pair.distance, _vector(axis)
        )
    return tuple(found.values())


def _label(channel: Channel, distance: float) -> str:
    name = channel.name or str(channel.dof)
    return f"{name}, {plain(distance, 3)} away" if distance > 0 else name


def _vector(axis: Sequence[float] | np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in axis)
    return x, y, z
