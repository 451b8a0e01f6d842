"""Sensors at their places in the model: a test geometry that is turned or scaled is brought onto the model's."""

from __future__ import annotations

from collections.abc import Collection, Sequence
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
from femend.numerals import plain

__all__ = ["Placed", "placed_sensors"]

FloatArray = NDArray[np.float64]

# a frame is one of axes where no entry of the turn is further from 0, 1 or -1; as in `align_points`
AXES_NEAR = 0.05
# how a note of `align_points` ends that asks for what a study has no key for
MATES = "; give the `mate` of each"


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
        pairing = _paired(measured, sensors, ids, xyz, places)
        return Placed(pairing, None, False, (*pairing.warnings, *pairing.notes))
    reach = PAIRING_TOLERANCE * float(np.linalg.norm(np.ptp(xyz, axis=0)))
    if not (align and _helps(found, reach)):
        try:
            pairing = _paired(measured, sensors, ids, xyz, places)
        except PairingError as error:
            raise PairingError("; ".join([str(error), *_told(found, nodes, ids)]), sensor=error.sensor) from None
        # of nodes that are off from those of their own numbers the pairing tells
        apart = {p.dof.node for p in pairing if p.by == "id" and p.distance > reach}
        told = _told(found, nodes, ids, apart, decided=_same(found, reach) and not found.off)
        return Placed(pairing, found, False, (*told, *pairing.warnings, *pairing.notes))
    moved = {n: found.scale * found.R @ places[n] + found.offset for n in nodes}
    turned = {d: _turned(d, found.R) for d in sensors}
    pairs = pair_sensors(list(turned.values()), ids, xyz, sensor_xyz=moved)
    pairing = Pairing(tuple(Pair(d, pairs[t].dof, pairs[t].distance, pairs[t].by) for d, t in turned.items()))
    shift = ", ".join(plain(float(v) + 0.0) for v in np.where(np.abs(found.offset) > 1e-3 * reach, found.offset, 0.0))
    told = (
        *_told(found, nodes, ids),
        f"test geometry: applied to the sensors' places and directions, shifted by ({shift}) after it; [correlation] "
        "align = false leaves it",
    )
    return Placed(pairing, found, True, (*told, *pairs.warnings, *pairs.notes))


def _paired(
    measured: Sequence[MeasuredModes | MeasuredRun],
    sensors: Sequence[Dof],
    ids: NDArray[np.int64],
    xyz: FloatArray,
    places: dict[int, FloatArray],
) -> Pairing:
    """`pair_sensors`, whose error names the recording."""
    try:
        return pair_sensors(sensors, ids, xyz, sensor_xyz=places)
    except PairingError as error:
        whose = next((m.name for m in measured if error.sensor in {str(d) for d in m.dofs}), None)
        if whose is None:
            raise
        raise PairingError(f"recording {whose!r}: {error}", sensor=error.sensor) from None


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
    plain_axes = bool(np.abs(found.R - np.rint(found.R)).max() < AXES_NEAR)
    return not _same(found, reach) and plain_axes and not found.off and not found.alike


def _same(found: Alignment, reach: float) -> bool:
    """Is the test's frame the model's, but for the `reach` of pairing?"""
    turned = not np.allclose(found.R, np.eye(3), atol=AXES_NEAR) or abs(found.scale - 1) >= 1e-12
    return not turned and float(np.linalg.norm(found.offset)) <= reach


def _turned(dof: Dof, R: FloatArray) -> Dof:
    """A sensor's DOF with its direction in the model's frame; rotations turn as vectors do, mirrored the other way."""
    axis = np.zeros(3)
    axis[(dof.component - 1) % 3] = dof.sign
    v = R @ axis * (np.sign(np.linalg.det(R)) if dof.is_rotation else 1.0)
    k = int(np.argmax(np.abs(v)))
    return Dof(dof.node, k + 1 + (3 if dof.is_rotation else 0), 1 if v[k] > 0 else -1)


def _told(
    found: Alignment,
    nodes: Sequence[int],
    ids: NDArray[np.int64],
    passed: Collection[int] = (),
    *,
    decided: bool = False,
) -> tuple[str, ...]:
    """The notes of `align_points` with node ids of the test and of the model in the place of row numbers; without those
    of nodes that are `passed` over, nor, where the geometry is `decided` as it is, of other turns that fit as well."""
    told = []
    for note in found.notes:
        words = note.split()
        if words[:2] == ["test", "point"]:
            test, model = nodes[int(words[2])], int(ids[int(words[-1])])
            if test == model and test in passed:
                continue
            note = f"test node {test} is {words[4]} from node {model} of the model"
        elif words[:2] == ["test", "points"]:
            note = f"test nodes {nodes[int(words[2])]} and {nodes[int(words[4])]} are exchanged"
        elif note.endswith(MATES):
            if decided:
                continue
            note = note.removesuffix(MATES) + (
                ", and it is left as it is; give the sensors the numbers of the model's nodes, or add a sensor that is "
                "off the symmetry, so that one turn alone fits"
            )
        told.append(f"test geometry: {note}")
    return tuple(told)
