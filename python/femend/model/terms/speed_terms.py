"""Terms that act with the speed of a rotor: gyroscopic moments, and stiffnesses that change with the speed.

At rest they do nothing, so that modal tests and ambient recordings say what the structure is without them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from femend.errors import ModelError
from femend.model.model import Model
from femend.model.terms.bushes import BushGroup
from femend.model.terms.linear_terms import DECADE, LinearTerm, SpeedPower, TermPart, g_matrix, over_group
from femend.model.terms.unknowns import Unknown

__all__ = ["disc_at_node", "member_over_speed", "rotor_between", "springs_over_speed"]

FloatArray = NDArray[np.float64]

# a stiffness over speed is a polynomial without constant in the share of the highest speed; each coefficient as a
# share of the stiffness (1-sigma)
DEGREE, BEND = 3, 0.3
# radius of gyration of a rotor of which nothing is known, as a share of the structure's size
RADIUS = 0.05


def rotor_between(model: Model, nodes: Sequence[int], axis: int, reference: float) -> LinearTerm:
    """Gyroscopic moments of a rotor in the bearings `nodes`, tilting as the line from the first to the last does.

    `axis` (0, 1, 2 for X, Y, Z) is the shaft's; the polar inertia Ip couples the tilts theta_u, theta_v about the two
    axes that follow it: moments Ip Omega theta_v' and -Ip Omega theta_u' (Genta, Dynamics of Rotating Systems, 2005,
    eq. 2.24). Omega counts positive about +axis by the right hand; `reference` rad/s is the highest speed. Raises
    ModelError where the bearings do not lie apart along the shaft.
    """
    xyz = model.xyz_of
    ordered = sorted(nodes, key=lambda n: float(xyz[n][axis]))
    first, last = ordered[0], ordered[-1]
    length = float(xyz[last][axis] - xyz[first][axis])
    if length <= 0.0:
        raise ModelError(f"bearings {first} and {last} do not lie apart along {'XYZ'[axis]}; name two that do")
    u, v = (axis + 1) % 3, (axis + 2) % 3
    rows = [6 * model.index(n) + c for n in (first, last) for c in (u, v)]
    # a turn about e_v moves the far end along e_u, one about e_u against e_v (right hand)
    tilt_u = np.array([0.0, 1.0, 0.0, -1.0]) / length
    tilt_v = np.array([-1.0, 0.0, 1.0, 0.0]) / length
    name = f"rotor between {first} and {last}"
    return _gyroscopic(model, name, tuple(nodes), rows, tilt_u, tilt_v, axis, reference)


def disc_at_node(model: Model, node: int, axis: int, reference: float) -> LinearTerm:
    """Gyroscopic moments of a disc that tilts as `node` turns; `axis`, `reference` as for `rotor_between`."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    rows = [6 * model.index(node) + 3 + u, 6 * model.index(node) + 3 + v]
    name = f"disc at {node}"
    return _gyroscopic(model, name, (node,), rows, np.array([1.0, 0.0]), np.array([0.0, 1.0]), axis, reference)


def _gyroscopic(
    model: Model,
    name: str,
    nodes: tuple[int, ...],
    rows: Sequence[int],
    tilt_u: FloatArray,
    tilt_v: FloatArray,
    axis: int,
    reference: float,
) -> LinearTerm:
    matrix = g_matrix(model, rows, np.outer(tilt_u, tilt_v) - np.outer(tilt_v, tilt_u))
    size = RADIUS * float(np.ptp(model.xyz, axis=0).max())
    unknown = Unknown(f"{name}: Ip", model.total_mass * size**2, sd=1.5 * DECADE, unit="Ip", owner=name)
    part = TermPart("C", matrix, ((0, 1),), SpeedPower(1, 1.0, signed=True))
    return LinearTerm(
        name, "gyroscopic", nodes, "", f"R{'XYZ'[axis]}", (unknown,), (part,), structural=False,
        label=f"gyroscopic moments of a {name}", reference=reference,
    )  # fmt: skip


def springs_over_speed(model: Model, group: BushGroup, axis: int | None, reference: float) -> LinearTerm:
    """The springs of a property along one of their axes (0, 1, 2), or all three alike (None), change with speed."""
    local = np.zeros((6, 6))
    for i in range(3) if axis is None else (axis,):
        local[i, i] = group.k[i]
    along = "" if axis is None else f" k{axis + 1}"
    nodes = tuple(n for pair in group.ends for n in pair)
    k = None if axis is None else float(group.k[axis])
    return _over_speed(
        f"springs of property {group.property_id}{along} over speed", nodes, "" if axis is None else "XYZ"[axis],
        over_group(model, group, local), reference, k, group.property_id,
    )  # fmt: skip


def member_over_speed(model: Model, eid: int, reference: float) -> LinearTerm:
    """The whole stiffness of one element changes with speed."""
    rows, K, _ = model.fe.element_matrices(eid)
    nodes = next((tuple(int(n) for n in own) for e, _, own in model.fe.elements() if e == eid), ())
    matrix = g_matrix(model, np.asarray(rows).tolist(), np.asarray(K))
    return _over_speed(f"element {eid} over speed", nodes, "", matrix, reference, None, None)


def _over_speed(
    name: str,
    nodes: tuple[int, ...],
    direction: str,
    matrix: csc_array,
    reference: float,
    k: float | None,
    property_id: int | None,
) -> LinearTerm:
    unknowns = tuple(
        Unknown(f"{name}: a{n}", 1.0, positive=False, sd=BEND, unit="", owner=name) for n in range(1, DEGREE + 1)
    )
    parts = tuple(TermPart("K", matrix, ((n - 1, 1),), SpeedPower(n, reference)) for n in range(1, DEGREE + 1))
    return LinearTerm(
        name, "speed_stiffness", nodes, "", direction, unknowns, parts, structural=False, property_id=property_id,
        label=f"stiffness of {name}", reference=reference, size=k,
    )  # fmt: skip
