"""Sensors to degrees of freedom of the model: by node id, else between nodes or by the nearest node."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.data import Channel
from femend.dof import Dof
from femend.errors import PairingError
from femend.model.cards.near_ids import near_ids
from femend.model.sensor_point import SensorPoint
from femend.numerals import listed, plain

__all__ = ["PAIRING_TOLERANCE", "Pair", "Pairing", "pair_sensors"]

# Of the diagonal of the model: a sensor glued a little beside its node, on a mesh of some fifty elements per side.
PAIRING_TOLERANCE = 0.02
# nodes that a sentence names at most
NAMED = 6
# sensors paired by place up to which each has a note of its own
EACH = 3
# of the diagonal: nearer than this is at the place, as coordinates of files have six digits
ROUND_OFF = 1e-5


@dataclass(frozen=True, slots=True)
class Pair:
    """A sensor and its place in the model: `dof` has the model's node and the sensor's direction and sign.

    `distance` in the model's length unit between sensor and node (0 where the id alone decided), `by` is "id" or
    "nearest"; or "between" nodes, at a `point` on an element that is the distance away, with `dof` at the nearest node.
    """

    sensor: Dof
    dof: Dof
    distance: float
    by: str
    point: SensorPoint | None = None

    @property
    def place(self) -> Dof:
        """The DOF whose motion the sensor shows: `dof`, or that of its point between nodes by the point's number."""
        return self.dof if self.point is None else Dof(self.point.id, self.dof.component, self.dof.sign)

    @property
    def text(self) -> str:
        """How a report names the pair."""
        if self.by == "id":
            return f"{self.sensor}"
        if self.point is not None:
            return f"{self.sensor} -> between nodes {listed(self.point.nodes, NAMED)} ({plain(self.distance)} away)"
        return f"{self.sensor} -> {self.dof} (nearest node, {plain(self.distance)} away)"


@dataclass(frozen=True, slots=True)
class Pairing:
    """Pairs of all sensors, with look-up by the sensor's DOF; `notes` say what is not by node id, `warnings` what
    coordinates contradict. `mesh` is the `Model.mesh_key` of the model they were made with, "" where that is not
    known."""

    pairs: tuple[Pair, ...]
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    mesh: str = ""

    def __iter__(self) -> Iterator[Pair]:
        return iter(self.pairs)

    def __len__(self) -> int:
        return len(self.pairs)

    def __getitem__(self, sensor: Dof | str) -> Pair:
        dof = Dof.parse(sensor) if isinstance(sensor, str) else sensor
        for pair in self.pairs:
            if pair.sensor == dof:
                return pair
        raise KeyError(f"no sensor {dof} is paired; there are {', '.join(str(p.sensor) for p in self.pairs[:12])}")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "pairs": [
                {"sensor": str(p.sensor), "dof": str(p.dof), "distance": p.distance, "by": p.by}
                | ({} if p.point is None else {"between": list(p.point.nodes)})
                for p in self.pairs
            ],
            "notes": list(self.notes),
            "warnings": list(self.warnings),
        }

    def __repr__(self) -> str:
        nearest = sum(p.by == "nearest" for p in self.pairs)
        told = "".join(f"\nwarning: {text}" for text in self.warnings)
        return f"Pairing({len(self)} sensors, {nearest} of them with the nearest node){told}"


def pair_sensors(
    sensors: Iterable[Channel | Dof],
    node_ids: ArrayLike,
    xyz: ArrayLike,
    *,
    sensor_xyz: Mapping[int, Sequence[float] | NDArray[np.float64]] | None = None,
    tolerance: float | None = None,
    points: Mapping[int, SensorPoint] | None = None,
) -> Pairing:
    """Pairs each of `sensors` with a DOF of the model whose nodes are `node_ids` (n,) at `xyz` (n, 3).

    A sensor whose node id is a node of the model is paired with it. Otherwise, and where the coordinates in
    `sensor_xyz` (test node id to x, y, z in the model's length unit and frame) show that the id means another place,
    it is paired with its point between nodes, where `points` has one for its test node (`sensor_points`; rotations go
    to nodes), else with the nearest node within `tolerance` times the model's diagonal (2 % without one). Where they
    show that and no node is near, the id is believed with a warning, or refused where a `tolerance` is given.
    Sensors without DOF (a tacho) are passed over; a sensor that occurs twice is paired once. Raises PairingError for a
    sensor far from every node (with distance and nearest node) and for one of unknown place.

    >>> pair_sensors([Dof(2, 3)], [1, 2], [[0, 0, 0], [1, 0, 0]])["2:+Z"].by
    'id'
    """
    ids = np.asarray(node_ids, dtype=np.int64)
    at = np.asarray(xyz, dtype=np.float64).reshape(-1, 3)
    if ids.size == 0 or ids.shape != (len(at),):
        raise PairingError(f"{ids.size} node ids and {len(at)} coordinates: the model has no nodes to pair with")
    share = PAIRING_TOLERANCE if tolerance is None else tolerance
    reach = share * float(np.linalg.norm(at.max(axis=0) - at.min(axis=0)))
    known = {int(n): i for i, n in enumerate(ids)}
    places = dict(sensor_xyz or {})
    pairs: dict[Dof, Pair] = {}
    for sensor in sensors:
        dof = sensor.dof if isinstance(sensor, Channel) else sensor
        if dof is None or dof in pairs:
            continue
        pair = _between(dof, known, at, places, reach, points or {}) or _pair(dof, ids, at, known, places, reach, share)
        if pair.by == "id" and pair.distance > reach and tolerance is not None:
            raise PairingError(_apart([pair], reach, share), sensor=str(dof))
        pairs[dof] = pair
    nearest = [p for p in pairs.values() if p.by == "nearest"]
    own = {
        p.sensor.node: float(np.linalg.norm(at[known[p.sensor.node]] - places[p.sensor.node]))
        for p in nearest if p.sensor.node in known
    }  # fmt: skip
    notes = _by_place(nearest, own, ROUND_OFF / share * reach)
    notes += _on_elements([p for p in pairs.values() if p.by == "between"], ROUND_OFF / share * reach)
    apart = [p for p in pairs.values() if p.by == "id" and p.distance > reach]
    warnings = (_apart(apart, reach, share),) if apart else ()
    return Pairing(tuple(pairs.values()), notes, warnings)


def _between(
    dof: Dof,
    known: Mapping[int, int],
    at: NDArray[np.float64],
    places: Mapping[int, Any],
    reach: float,
    points: Mapping[int, SensorPoint],
) -> Pair | None:
    """The pair of a sensor whose test node has a point between nodes and is not the model's node of its number."""
    point = points.get(dof.node)
    if point is None or dof.is_rotation:
        return None
    if dof.node in known and np.linalg.norm(at[known[dof.node]] - places[dof.node]) <= reach:
        return None
    return Pair(dof, Dof(point.node, dof.component, dof.sign), point.distance, "between", point)


def _on_elements(pairs: Sequence[Pair], round_off: float) -> tuple[str, ...]:
    """What is said of `pairs` between nodes."""
    nodes = {p.sensor.node: p for p in pairs}
    if not nodes:
        return ()
    far = max(pairs, key=lambda p: p.distance)
    named = listed((f"{n} on {_element(p)}" for n, p in nodes.items() if p.point is not None), EACH, "; ")
    one = len(nodes) == 1
    said = f"sensors at test node {named}" if one else f"sensors at {len(nodes)} test nodes lie between nodes: {named}"
    said = said.replace(" on the element", " lie on the element", 1) if one else said
    if far.distance > round_off:
        said += f"; {far.sensor.node} is {'' if one else 'the farthest from its element, '}{plain(far.distance)} away"
    return (f"{said}: their motion is taken there, not at the nearest node",)


def _element(pair: Pair) -> str:
    assert pair.point is not None
    return f"the element between {listed(pair.point.nodes, 8)}"


def _by_place(pairs: Sequence[Pair], own: Mapping[int, float], round_off: float) -> tuple[str, ...]:
    """What is said of `pairs` with the nearest node; `own` are distances to the nodes of the sensors' numbers."""

    def away(pair: Pair) -> str:
        return " at its place" if pair.distance <= round_off else f", {plain(pair.distance)} away"

    if len(pairs) <= EACH:
        since = {n: f", since node {n} of the model lies {plain(d)} away" for n, d in own.items()}
        return tuple(
            f"sensor {p.sensor} is paired with node {p.dof.node}{away(p)}{since.get(p.sensor.node, '')}" for p in pairs
        )
    nodes = {p.sensor.node: p for p in pairs}
    far = max(pairs, key=lambda p: p.distance)
    named = listed((f"{n} with {p.dof.node}" for n, p in nodes.items()), NAMED)
    said = f"sensors at {len(nodes)} test nodes are paired with the nearest nodes of the model: {named}"
    said += ", each at its place" if far.distance <= round_off else f"; {far.sensor.node} is the farthest{away(far)}"
    if own:
        first = listed((f"{n} by {plain(d)}" for n, d in own.items()), NAMED)
        said += f"; nodes of these numbers are in the model, but elsewhere: {first}"
    return (said,)


def _apart(pairs: Sequence[Pair], reach: float, share: float) -> str:
    """What is said of `pairs` by id whose test node lies elsewhere."""
    far = {p.dof.node: p.distance for p in sorted(pairs, key=lambda p: -p.distance)}
    named = listed((f"node {n} by {plain(d)}" for n, d in far.items()), NAMED)
    return (
        "sensors are paired with the model's nodes of their numbers though the test's coordinates lie elsewhere: "
        f"{named} (the tolerance is {plain(reach)}, {100 * share:g} % of the model's diagonal): check "
        "the units and the frame of the test geometry, and these node numbers"
    )


def _pair(
    dof: Dof,
    ids: NDArray[np.int64],
    points: NDArray[np.float64],
    known: dict[int, int],
    places: dict[int, Any],
    reach: float,
    tolerance: float,
) -> Pair:
    at = places.get(dof.node)
    if at is None:
        if dof.node in known:
            return Pair(dof, dof, 0.0, "id")
        raise PairingError(
            f"sensor {dof}: node {dof.node} is not among the {ids.size} nodes of the model (ids {ids.min()} to "
            f"{ids.max()}; {near_ids(dof.node, ids)}) and the recording has no coordinates for it; correct the node "
            "number, or add the sensor's coordinates (data set 15 or 2411 of a universal file)",
            sensor=str(dof),
        )
    distance = np.linalg.norm(points - np.asarray(at, dtype=np.float64), axis=1)
    nearest = int(np.argmin(distance))
    if dof.node in known and (distance[known[dof.node]] <= reach or distance[nearest] > reach):
        return Pair(dof, dof, float(distance[known[dof.node]]), "id")
    if distance[nearest] > reach:
        raise PairingError(
            f"sensor {dof} at {tuple(float(f'{v:.4g}') for v in at)} is {plain(distance[nearest])} from the nearest "
            f"node {ids[nearest]}; the tolerance is {plain(reach)} ({100 * tolerance:g} % of the model's diagonal). "
            "Check the units and the frame of the test geometry, or add a node to the model",
            sensor=str(dof),
        )
    return Pair(dof, Dof(int(ids[nearest]), dof.component, dof.sign), float(distance[nearest]), "nearest")
