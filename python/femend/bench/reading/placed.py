"""Sensors at their places in the model: a test geometry that is turned or scaled is brought onto the model's."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.bench.reading.measured import MeasuredModes
from femend.bench.reading.placed_by_shapes import by_shapes
from femend.bench.reading.placed_in_unit import in_unit_alone
from femend.bench.reading.placed_words import MISPLACED, shift_words, told_of, unit_words
from femend.bench.reading.runs import MeasuredRun
from femend.correlate import Alignment, align_points
from femend.data.geometry import stated
from femend.dof import Dof
from femend.errors import CorrelationError, PairingError
from femend.model import Model, Pairing, pair_sensors
from femend.model.pairing import PAIRING_TOLERANCE, ROUND_OFF
from femend.model.sensor_frames import other_frames
from femend.model.sensor_point import SensorPoint
from femend.model.surfaces.sensor_points import sensor_points

__all__ = ["Placed", "placed_sensors"]

FloatArray = NDArray[np.float64]
# how well the shapes of recordings suit the model's with these DOFs of it for sensors, as their mean MAC; None where
# they tell nothing
Suits = Callable[[Sequence[MeasuredModes | MeasuredRun], Mapping[Dof, Dof]], float | None]

# a frame is one of axes where no entry of the turn is further from 0, 1 or -1; as in `align_points`
AXES_NEAR = 0.05
# of the model's diagonal: nearer to an element than this is on it
ON_ELEMENT = 1e-3


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
        """The model's DOF of every sensor, as `femend.correlate` takes it; of those between nodes by their points."""
        return {p.sensor: p.place for p in self.pairing}

    @property
    def points(self) -> tuple[SensorPoint, ...]:
        """The points between nodes that have sensors, each once."""
        return tuple({p.point.id: p.point for p in self.pairing if p.point is not None}.values())


def placed_sensors(
    measured: Sequence[MeasuredModes | MeasuredRun], model: Model, *, align: bool = True, suits: Suits | None = None
) -> Placed:
    """Pairs every sensor of the `measured` modes and runs with a DOF of `model`, by node id, with the element
    there where it lies between nodes, or by the nearest node.

    Where the test has coordinates that are not on the model's nodes as they are, they are brought there
    (`femend.correlate.align_points`), in the unit that the file states where that fits. A scale, a turn of axes or a
    shift that makes them agree is applied with `align`, to places and directions, and is told either way; one that
    does not make them agree, or that others would do as well with nothing to prefer it, is told and left. Of turns and
    shifts that do as well the one is taken that shapes suit clearly better, where `suits` tells. A unit is
    applied though some sensors (a third at most) stand off the model, as they may in the right unit. Recordings
    whose geometries do not fit by one alignment are placed one by one where that fits. Raises PairingError for a
    sensor that is far from every node, with what the alignment says.
    """
    sensors = tuple(dict.fromkeys(d for m in measured for d in m.dofs))
    places, systems = stated(m.geometry for m in measured)
    ids, xyz, reach = _grid(model)
    nodes = [n for n in dict.fromkeys(d.node for d in sensors) if n in places]
    on = ON_ELEMENT / PAIRING_TOLERANCE * reach
    points = _points(model, {n: places[n] for n in nodes}, reach)
    found = _alignment(nodes, places, ids, xyz, (unit := _unit(measured)) is not None)
    if found is None or _on_the_elements(found, points, nodes, places, xyz, on):
        pairing = _with_frames(_paired(measured, sensors, ids, xyz, places, points), model, systems)
        return Placed(pairing, None, False, (*pairing.warnings, *pairing.notes))
    found = in_unit_alone(found, nodes, places, xyz, on, lambda at: _points(model, at, reach)) or found
    if align and suits is not None:
        found = by_shapes(found, lambda one: _suited(one, measured, sensors, places, model, suits))
    apart = None if _fits(found) else _one_by_one(measured, model, align, suits)
    if apart is not None:
        return apart
    if not (align and (_helps(found, reach) or _in_another_unit(found, unit))):
        try:
            pairing = _with_frames(_paired(measured, sensors, ids, xyz, places, points), model, systems)
        except PairingError as error:
            told = told_of(found, nodes, ids, unit, applied=False)
            raise PairingError("; ".join([str(error), *told]), sensor=error.sensor) from None
        # of nodes that are off from those of their own numbers the pairing tells
        passed = {p.dof.node for p in pairing if p.by == "id" and p.distance > reach}
        decided = _same(found, reach) and not found.off
        told = told_of(found, nodes, ids, unit, passed, applied=False, decided=decided)
        return Placed(pairing, found, False, (*told, *pairing.warnings, *pairing.notes))
    turned = {d: _turned(d, found.R) for d in sensors}
    try:
        pairs = _moved_pairs(found, list(turned.values()), places, model)
    except PairingError as error:
        whose = next(
            (f"recording {m.name!r}: " for m in measured for d in m.dofs if str(turned[d]) == error.sensor), ""
        )
        told = told_of(found, nodes, ids, unit, applied=True)
        raise PairingError("; ".join([f"{whose}{error}", *told]), sensor=error.sensor) from None
    pairing = Pairing(tuple(replace(pairs[t], sensor=d) for d, t in turned.items()))
    shift = shift_words(found.offset, reach)
    told = (
        *told_of(found, nodes, ids, unit, applied=True),
        f"test geometry: applied to the sensors' places and directions{shift and f', shifted by {shift} after it'}; "
        "[correlation] align = false leaves it",
    )
    frames = other_frames(pairing, model, systems)
    return Placed(pairing, found, True, (*told, *frames, *pairs.warnings, *pairs.notes))


def _grid(model: Model) -> tuple[NDArray[np.int64], FloatArray, float]:
    """Ids (n,) and places (n, 3) of the model's nodes that have one, and how far a sensor may be from its node."""
    grid = ~model.is_scalar
    xyz = model.xyz[grid]
    return model.node_ids[grid], xyz, PAIRING_TOLERANCE * float(np.linalg.norm(np.ptp(xyz, axis=0)))


def _moved_pairs(found: Alignment, turned: Sequence[Dof], places: Mapping[int, FloatArray], model: Model) -> Pairing:
    """Sensors, `turned` by an alignment, paired at their places moved by it."""
    ids, xyz, reach = _grid(model)
    nodes = dict.fromkeys(d.node for d in turned if d.node in places)
    moved = {n: found.scale * found.R @ places[n] + found.offset for n in nodes}
    return pair_sensors(turned, ids, xyz, sensor_xyz=moved, points=_points(model, moved, reach))


def _suited(
    found: Alignment,
    measured: Sequence[MeasuredModes | MeasuredRun],
    sensors: Sequence[Dof],
    places: Mapping[int, FloatArray],
    model: Model,
    suits: Suits,
) -> float | None:
    """How well shapes suit the model with the geometry so `found`; None where that tells nothing."""
    turned = {d: _turned(d, found.R) for d in sensors}
    try:
        pairs = _moved_pairs(found, list(turned.values()), places, model)
    except PairingError:
        return None
    return suits(measured, {d: pairs[t].dof for d, t in turned.items()})


def _one_by_one(
    measured: Sequence[MeasuredModes | MeasuredRun], model: Model, align: bool, suits: Suits | None
) -> Placed | None:
    """Recordings placed each by its own geometry; None where they share nodes, or where that does not fit either."""
    if len(measured) < 2:
        return None
    nodes = [{d.node for d in m.dofs} for m in measured]
    if sum(map(len, nodes)) > len(set().union(*nodes)):
        return None
    try:
        parts = [placed_sensors([m], model, align=align, suits=suits) for m in measured]
    except PairingError:
        return None
    if not all(p.alignment is None or _fits(p.alignment) for p in parts):
        return None
    pairing = Pairing(
        tuple(p for part in parts for p in part.pairing),
        tuple(n for part in parts for n in part.pairing.notes),
        tuple(w for part in parts for w in part.pairing.warnings),
    )
    first = next((p for p in parts if p.applied), parts[0])
    told = tuple(f"recording {m.name!r}: {w}" for m, part in zip(measured, parts, strict=True) for w in part.warnings)
    return Placed(pairing, first.alignment, first.applied, told)


def _unit(measured: Sequence[MeasuredModes | MeasuredRun]) -> float | None:
    """The length unit that the files of all geometries state; None without one."""
    units = {m.geometry.unit for m in measured if m.geometry is not None}
    return units.pop() if len(units) == 1 else None


def _with_frames(pairing: Pairing, model: Model, systems: Mapping[int, int]) -> Pairing:
    """With what is to be told of nodes with displacement systems of their own."""
    return replace(pairing, warnings=(*pairing.warnings, *other_frames(pairing, model, systems)))


def _paired(
    measured: Sequence[MeasuredModes | MeasuredRun],
    sensors: Sequence[Dof],
    ids: NDArray[np.int64],
    xyz: FloatArray,
    places: dict[int, FloatArray],
    points: Mapping[int, SensorPoint],
) -> Pairing:
    """`pair_sensors`, whose error names the recording."""
    try:
        return pair_sensors(sensors, ids, xyz, sensor_xyz=places, points=points)
    except PairingError as error:
        whose = next((m.name for m in measured if error.sensor in {str(d) for d in m.dofs}), None)
        if whose is None:
            raise
        raise PairingError(f"recording {whose!r}: {error}", sensor=error.sensor) from None


def _points(model: Model, places: Mapping[int, FloatArray], reach: float) -> dict[int, SensorPoint]:
    """Where test nodes at their `places` lie between nodes of `model`."""
    free = int(model.node_ids.max()) + 1
    at_node = ROUND_OFF / PAIRING_TOLERANCE * reach
    return sensor_points(model, places, reach=reach, at_node=at_node, first=free)


def _on_the_elements(
    found: Alignment,
    points: Mapping[int, SensorPoint],
    nodes: Sequence[int],
    places: Mapping[int, FloatArray],
    xyz: FloatArray,
    on: float,
) -> bool:
    """Are all test nodes where they are on elements of the model, if not on its nodes, and those at nodes there too?
    Within `on` of them. Then a shift alone is none: it would move them from between nodes onto nodes."""
    if not points or not np.allclose(found.R, np.eye(3), atol=AXES_NEAR) or abs(found.scale - 1) > AXES_NEAR:
        return False
    rest = [n for n in nodes if n not in points]
    at_nodes = all(float(np.linalg.norm(xyz - places[n], axis=1).min()) <= on for n in rest)
    return at_nodes and all(p.distance <= on for p in points.values())


def _alignment(
    nodes: Sequence[int], places: dict[int, FloatArray], ids: NDArray[np.int64], xyz: FloatArray, stated: bool
) -> Alignment | None:
    """The test's nodes on the model's: by id where all are there and fit, else by nearest points, in the unit that is
    `stated` where that fits."""
    at = {int(n): i for i, n in enumerate(ids)}
    test = np.array([places[n] for n in nodes]).reshape(-1, 3)
    try:
        by_id = align_points(test, xyz, [at[n] for n in nodes]) if all(n in at for n in nodes) else None
        if by_id is not None and len(by_id.off) <= len(nodes) // 3:
            return by_id
        if stated:
            in_unit = align_points(test, xyz, scale="none")
            if not in_unit.off:
                return in_unit
        return align_points(test, xyz)
    except CorrelationError:
        return None  # fewer than three points, or all in line: nothing to align


def _fits(found: Alignment) -> bool:
    """Does it bring all nodes onto the model, as no other would as well?"""
    return not found.off and found.decided


def _helps(found: Alignment, reach: float) -> bool:
    """Is there something to undo, more than the `reach` of pairing, undone by this alignment and no other, so that
    directions stay axes?"""
    plain_axes = bool(np.abs(found.R - np.rint(found.R)).max() < AXES_NEAR)
    return not _same(found, reach) and plain_axes and _fits(found)


def _in_another_unit(found: Alignment, unit: float | None) -> bool:
    """Is it the unit of the test's coordinates alone (`unit` m as stated) that was wrong, with most nodes where they
    should be? A sensor that stands off the model is off in any unit, and is told in the model's."""
    turned = not np.allclose(found.R, np.eye(3), atol=AXES_NEAR)
    scaled = abs(found.scale - 1) > AXES_NEAR and unit_words(found.scale, unit) is not None
    return scaled and not turned and found.decided and len(found.off) <= MISPLACED * len(found.mate)


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
