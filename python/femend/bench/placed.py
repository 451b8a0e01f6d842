"""Sensors at their places in the model: a test geometry that is turned or scaled is brought onto the model's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.bench.measured import MeasuredModes
from femend.bench.runs import MeasuredRun
from femend.correlate import Alignment, align_points
from femend.dof import Dof
from femend.errors import CorrelationError, PairingError
from femend.model import Model, Pair, Pairing, pair_sensors
from femend.model.pairing import PAIRING_TOLERANCE

__all__ = ["Placed", "placed_sensors"]

FloatArray = NDArray[np.float64]

# a frame is one of axes where no entry of the turn is further from 0, 1 or -1; as in `align_points`
AXES_NEAR = 0.05


@dataclass(frozen=True, eq=False)
class Placed:
    """The `pairing` of all sensors with DOFs of the model, the `alignment` of the geometries where the test has one of
    three nodes or more, whether it was `applied`, and `warnings` in words."""

    pairing: Pairing
    alignment: Alignment | None
    applied: bool
    warnings: tuple[str, ...]

    @property
    def places(self) -> dict[Dof, Dof]:
        """The model's DOF of every sensor, as `femend.correlate` takes it."""
        return {p.sensor: p.dof for p in self.pairing}


def placed_sensors(measured: Sequence[MeasuredModes | MeasuredRun], model: Model, *, align: bool = True) -> Placed:
    """Pairs every sensor of the `measured` modes and runs with a DOF of `model`, by node id or by the nearest node.

    Where the test has coordinates they are brought onto the model's (`femend.correlate.align_points`). A scale, a turn
    of axes or a shift that makes them agree is applied with `align`, to places and directions, and is told either way;
    one that does not make them agree, or that others would do as well, is told and left. Raises PairingError for a
    sensor that is far from every node, with what the alignment says.
    """
    sensors = tuple(dict.fromkeys(d for m in measured for d in m.dofs))
    places: dict[int, FloatArray] = {}
    for m in measured:
        if m.geometry is not None:
            places.update(zip(m.geometry.ids.tolist(), m.geometry.xyz, strict=True))
    grid = ~model.is_scalar
    ids, xyz = model.node_ids[grid], model.xyz[grid]
    nodes = [n for n in dict.fromkeys(d.node for d in sensors) if n in places]
    found = _alignment(nodes, places, ids, xyz)
    if found is None:
        pairing = pair_sensors(sensors, ids, xyz, sensor_xyz=places)
        return Placed(pairing, None, False, pairing.notes)
    told = tuple(f"test geometry: {_named(n, nodes, ids)}" for n in found.notes)
    reach = PAIRING_TOLERANCE * float(np.linalg.norm(np.ptp(xyz, axis=0)))
    if not (align and _helps(found, reach)):
        try:
            pairing = pair_sensors(sensors, ids, xyz, sensor_xyz=places)
        except PairingError as error:
            for note in told:
                error.add_note(note)
            raise PairingError("; ".join([str(error), *told])) from None
        return Placed(pairing, found, False, (*told, *pairing.notes))
    moved = {n: found.scale * found.R @ places[n] + found.offset for n in nodes}
    turned = {d: _turned(d, found.R) for d in sensors}
    pairs = pair_sensors(list(turned.values()), ids, xyz, sensor_xyz=moved)
    pairing = Pairing(tuple(Pair(d, pairs[t].dof, pairs[t].distance, pairs[t].by) for d, t in turned.items()))
    told = (
        *told,
        "test geometry: applied to the sensors' places and directions ([correlation] align = false leaves it)",
    )
    return Placed(pairing, found, True, (*told, *pairs.notes))


def _alignment(nodes: Sequence[int], places: dict[int, FloatArray], ids: NDArray, xyz: FloatArray) -> Alignment | None:
    """The test's nodes on the model's: by id where all are there and fit, else by nearest points."""
    at = {int(n): i for i, n in enumerate(ids)}
    test = np.array([places[n] for n in nodes]).reshape(-1, 3)
    try:
        by_id = align_points(test, xyz, [at[n] for n in nodes]) if all(n in at for n in nodes) else None
        if by_id is not None and len(by_id.off) <= len(nodes) // 3:
            return by_id
        return align_points(test, xyz)
    except CorrelationError:
        return None  # fewer than three points, or all in line: nothing to align


def _helps(found: Alignment, reach: float) -> bool:
    """Is there something to undo, more than the `reach` of pairing, undone by this alignment and no other, so that
    directions stay axes?"""
    R = found.R
    same = np.allclose(R, np.eye(3), atol=AXES_NEAR) and abs(found.scale - 1) < 1e-12
    shifted = float(np.linalg.norm(found.offset)) > reach
    plain = bool(np.abs(R - np.rint(R)).max() < AXES_NEAR)
    return (not same or shifted) and plain and not found.off and not found.alike


def _turned(dof: Dof, R: FloatArray) -> Dof:
    """A sensor's DOF with its direction in the model's frame; rotations turn as vectors do, mirrored the other way."""
    axis = np.zeros(3)
    axis[(dof.component - 1) % 3] = dof.sign
    v = R @ axis * (np.sign(np.linalg.det(R)) if dof.is_rotation else 1.0)
    k = int(np.argmax(np.abs(v)))
    return Dof(dof.node, k + 1 + (3 if dof.is_rotation else 0), 1 if v[k] > 0 else -1)


def _named(note: str, nodes: Sequence[int], ids: NDArray) -> str:
    """A note of `align_points` with node ids of the test and of the model in the place of row numbers."""
    words = note.split()
    if words[:2] == ["test", "point"]:
        return " ".join(["test node", str(nodes[int(words[2])]), *words[3:-1], str(ids[int(words[-1])])])
    if words[:2] == ["test", "points"]:
        return f"test nodes {nodes[int(words[2])]} and {nodes[int(words[4])]} are exchanged"
    return note
