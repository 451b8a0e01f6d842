"""Linear terms a deck may lack: supports that give, springs that bend, springs and masses somewhere.

A term has unknowns and parts; a part is a matrix on the g-set that is multiplied by powers of the unknowns' values and
added to K, M or C. A term may free DOFs the deck holds, and may exist in some configurations only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csc_array

from femend.model.model import Model
from femend.model.parameter import Parameter
from femend.model.terms.bushes import BushGroup
from femend.model.terms.supports import SupportRegion
from femend.model.terms.unknowns import Unknown

__all__ = [
    "LinearTerm",
    "SpeedPower",
    "TermPart",
    "compliant_support",
    "diagonal",
    "end_masses",
    "g_matrix",
    "over_group",
    "point_dashpot",
    "point_mass",
    "point_spring",
    "spring_bending",
    "weaker_element",
]

FloatArray = NDArray[np.float64]
AXES = ("x", "y", "z")

# 1-sigma of a stiffness, mass or dashpot of which only the order of magnitude can be guessed: one decade
DECADE = float(np.log(10.0))
# a lateral spring stiffness k over a length L goes with an end moment of k L^2 / 12 at a beam's middle (both ends
# clamped): the scale of rotational stiffness; its elastic centre lies within a quarter of L of the middle (1-sigma)
BEAM, OFF_CENTRE = 1.0 / 12.0, 0.25


@dataclass(frozen=True, slots=True)
class SpeedPower:
    """A weight over the speed of rotation: (speed / reference) ** power of its size, with its sign where `signed`."""

    power: int
    reference: float
    signed: bool = False

    def at(self, speed: FloatArray) -> FloatArray:
        """Weights of the shape of `speed` (rad/s, signed)."""
        weight = (np.abs(speed) / self.reference) ** self.power
        return np.asarray(np.sign(speed) * weight if self.signed else weight)


@dataclass(frozen=True, eq=False)
class TermPart:
    """`matrix` (n_g, n_g), times the product of value ** power over (position of the unknown in the term, power), and
    times `over_speed` where the part acts with the speed of rotation; such a part has one unknown, to the power one."""

    kind: Literal["K", "M", "C"]
    matrix: csc_array
    powers: tuple[tuple[int, int], ...]
    over_speed: SpeedPower | None = None


@dataclass(frozen=True, eq=False)
class LinearTerm:
    """A term: what it is (`physics`, a name of the catalogue), where, its `unknowns` and `parts`.

    `nodes`, `to`, `direction` are the place as a finding states it; `releases` are rows of the free model's independent
    set that the term frees; `configurations` those it exists in, empty for all; `structural`: does the structure's own
    damping act on its stiffness too? A term that acts with the speed has the highest speed as `reference` (rad/s), and
    a stiffness over speed its `size` at rest (None where only a factor can be told). A support acts at its nodes by
    their `shares` of its area, or 1 each.
    """

    name: str
    physics: str
    nodes: tuple[int, ...]
    to: str
    direction: str
    unknowns: tuple[Unknown, ...]
    parts: tuple[TermPart, ...]
    releases: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    configurations: tuple[str, ...] = ()
    structural: bool = True
    property_id: int | None = None
    area: float = 0.0
    label: str = ""
    reference: float = 0.0
    size: float | None = None
    shares: tuple[float, ...] = ()

    def active(self, configuration: str) -> bool:
        """Does the term exist in that configuration?"""
        return not self.configurations or configuration in self.configurations

    def scale_of(self, part: TermPart) -> float:
        """What multiplies the matrix of one of its parts at the starting scales of the unknowns."""
        return float(np.prod([self.unknowns[i].scale ** e for i, e in part.powers]))

    def base_parameter(self, parameters: Sequence[Parameter]) -> str | None:
        """Name of the parameter that updates the one stiffness the term changes; None where there is none."""
        wanted = f"k{'XYZ'.index(self.direction) + 1}" if self.direction else ""
        return next(
            (p.name for p in parameters if p.property == wanted and p.target == "property_id"
             and self.property_id in p.ids),
            None,
        )  # fmt: skip

    def only_in(self, *configurations: str) -> LinearTerm:
        """The same term in some configurations only; its unknowns carry the first one's name."""
        tag = f" [{', '.join(configurations)}]"
        unknowns = tuple(replace(u, name=u.name + tag, owner=self.name + tag) for u in self.unknowns)
        return replace(self, name=self.name + tag, configurations=configurations, unknowns=unknowns)


def g_matrix(model: Model, rows: Sequence[int], block: FloatArray) -> csc_array:
    """`block` (n, n) on g-set `rows` (n,) of a matrix (n_g, n_g)."""
    index = np.asarray(rows, dtype=np.int64)
    at, to = np.meshgrid(index, index, indexing="ij")
    n = int(model.fe.n_g)
    return csc_array(coo_array((np.asarray(block).ravel(), (at.ravel(), to.ravel())), shape=(n, n)))


def diagonal(n: int, rows: ArrayLike, values: ArrayLike) -> csc_array:
    """`values` (m,) on the diagonal at `rows` (m,) of a matrix (n, n)."""
    index = np.asarray(rows, dtype=np.int64)
    return csc_array(coo_array((np.asarray(values, dtype=np.float64), (index, index)), shape=(n, n)))


def _diagonal(model: Model, rows: Sequence[int], values: Sequence[float]) -> csc_array:
    return diagonal(int(model.fe.n_g), rows, values)


def compliant_support(model: Model, region: SupportRegion, omega: float, zeta: float) -> LinearTerm:
    """An elastic support under a region the deck holds: springs and dashpots to ground in x, y, z.

    Under shells it is a Winkler layer, stiffness and damping per area (k_x, k_y, k_z in force per length and area);
    elsewhere k_x, k_y, k_z act at every node of the region, with rotational springs k_rx, k_ry, k_rz. The starting
    scale lets the whole structure move on it at `omega` rad/s with damping `zeta`; priors are a decade and a half wide.
    """
    mass = model.total_mass
    share = region.areas if region.area > 0 else np.ones(len(region.nodes))
    total = float(share.sum())
    k = mass * omega**2 / total
    per = "/area" if region.area > 0 else ""
    name = f"support of {region.name}"
    unknowns, parts = [], []
    names = [f"k_{a}" for a in AXES] + ([] if region.area > 0 else [f"k_r{a}" for a in AXES])
    size = float(np.ptp(model.xyz, axis=0).max())
    for i, quantity in enumerate(names):
        turning = i >= 3
        rows = [6 * model.index(n) + i for n in region.nodes]
        matrix = _diagonal(model, rows, share.tolist())
        scale = k * (0.05 * size) ** 2 if turning else k
        unit = f"k{'_rot' if turning else ''}{per}"
        unknowns.append(Unknown(f"{name}: {quantity}", scale, sd=1.5 * DECADE, unit=unit, owner=name))
        parts.append(TermPart("K", matrix, ((2 * i, 1),)))
        c = quantity.replace("k_", "c_")
        unit = f"c{'_rot' if turning else ''}{per}"
        unknowns.append(Unknown(f"{name}: {c}", 2 * zeta * scale / omega, sd=DECADE, unit=unit, owner=name))
        parts.append(TermPart("C", matrix, ((2 * i + 1, 1),)))
    return LinearTerm(
        name, "compliant_support", region.nodes, "ground", "", tuple(unknowns), tuple(parts), region.rows,
        structural=False, area=region.area, label=f"elastic support under {region.name}", shares=tuple(share.tolist()),
    )  # fmt: skip


def spring_bending(model: Model, group: BushGroup) -> LinearTerm:
    """Moments in springs that the deck gives translational stiffness alone, the same in all springs of a property.

    About the middle of the spring's length: rotational stiffnesses k_rot_x, k_rot_y, k_rot_z, and where the elastic
    centre is not in the middle, a coupling between lateral translation and rotation, +k_c between u_x and r_y and -k_c
    between u_y and r_x for a spring along z (both bending planes alike). A symmetric beam or helical spring has k_c = 0
    there; the moments at its ends that come with a lateral displacement (6EI/L^2 of a beam) are those of the lateral
    spring force over half the length, which the bush has already.
    """
    axis = group.axis
    lateral = [i for i in range(3) if i != axis]
    L, k_lat = group.length, float(np.mean(group.k[lateral]))
    name = f"bending of springs {group.property_id}"
    unknowns = [Unknown(f"{name}: k_rot_{a}", k_lat * L**2 * BEAM, sd=DECADE, unit="k_rot", owner=name) for a in AXES]
    unknowns.append(
        Unknown(f"{name}: coupling", k_lat * L, positive=False, sd=OFF_CENTRE * 0.5, unit="coupling", owner=name)
    )
    parts = []
    for i in range(3):
        local = np.zeros((6, 6))
        local[3 + i, 3 + i] = 1.0
        parts.append(TermPart("K", over_group(model, group, local), ((i, 1),)))
    local = np.zeros((6, 6))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    local[first, 3 + second] = local[3 + second, first] = 1.0
    local[second, 3 + first] = local[3 + first, second] = -1.0
    parts.append(TermPart("K", over_group(model, group, local), ((3, 1),)))
    nodes = tuple(n for pair in group.ends for n in pair)
    return LinearTerm(
        name, "spring_bending", nodes, "", "R", tuple(unknowns), tuple(parts), property_id=group.property_id,
        label=f"moments in the springs of property {group.property_id}",
    )  # fmt: skip


def over_group(model: Model, group: BushGroup, local: FloatArray) -> csc_array:
    """B' local B summed over the bushes of a group (n_g, n_g); `local` (6, 6) acts on relative motion and turn."""
    total = csc_array((int(model.fe.n_g), int(model.fe.n_g)))
    for rows, B in zip(group.g_rows, group.B, strict=True):
        total = total + g_matrix(model, rows.tolist(), B.T @ local @ B)
    return csc_array(total)


def end_masses(model: Model, group: BushGroup, m: float, sd: float) -> LinearTerm:
    """The springs' own mass, which a bush does not have: `m` (median) at every end, prior `sd` of its logarithm.

    A third of a uniform spring's mass moves with each end (Rayleigh, The Theory of Sound, 2nd ed., vol. 1, art. 156).
    """
    name = f"own mass of springs {group.property_id}"
    nodes = sorted({n for pair in group.ends for n in pair})
    count = [sum(pair.count(n) for pair in group.ends) for n in nodes]
    rows = [6 * model.index(n) + i for n in nodes for i in range(3)]
    matrix = _diagonal(model, rows, [float(c) for c in count for _ in range(3)])
    unknown = Unknown(f"{name}: m", m, sd=sd, unit="m", owner=name)
    return LinearTerm(name, "added_mass", tuple(nodes), "", "", (unknown,), (TermPart("M", matrix, ((0, 1),)),))


def point_mass(model: Model, node: int, m: float) -> LinearTerm:
    """A mass at a node, moving in x, y and z; `m` is the starting scale."""
    name = f"mass at {node}"
    matrix = _diagonal(model, [6 * model.index(node) + i for i in range(3)], [1.0] * 3)
    unknown = Unknown(f"{name}: m", m, sd=1.5 * DECADE, unit="m", owner=name)
    return LinearTerm(name, "added_mass", (node,), "", "", (unknown,), (TermPart("M", matrix, ((0, 1),)),))


def point_spring(model: Model, node: int, component: int, k: float) -> LinearTerm:
    """A spring from a node to ground along `component` 1..3; `k` is the starting scale."""
    return _to_ground(model, node, component, ("spring", "support_stiffness", "K"), ("k", k))


def point_dashpot(model: Model, node: int, component: int, c: float) -> LinearTerm:
    """A dashpot from a node to ground along `component` 1..3; `c` (force over velocity) is the starting scale."""
    return _to_ground(model, node, component, ("dashpot", "viscous_damper", "C"), ("c", c))


def _to_ground(
    model: Model,
    node: int,
    component: int,
    what: tuple[str, str, Literal["K", "C"]],
    size: tuple[str, float],
) -> LinearTerm:
    """What acts from a node to ground, by its word, physics and matrix; `size` is its parameter with the scale."""
    (word, physics, kind), (symbol, scale) = what, size
    direction = "XYZ"[component - 1]
    name = f"{word} at {node} {direction} to ground"
    matrix = _diagonal(model, [6 * model.index(node) + component - 1], [1.0])
    unknown = Unknown(f"{name}: {symbol}", scale, sd=1.5 * DECADE, unit=symbol, owner=name)
    part = TermPart(kind, matrix, ((0, 1),))
    return LinearTerm(name, physics, (node,), "ground", direction, (unknown,), (part,))


def weaker_element(model: Model, eid: int, sd: float = 0.7) -> LinearTerm:
    """One element with another stiffness than the deck's: factor 1 + d on all of it, as `joint_stiffness`."""
    rows, K, _ = model.fe.element_matrices(eid)
    name = f"stiffness of element {eid}"
    matrix = g_matrix(model, np.asarray(rows).tolist(), np.asarray(K))
    negative = -1.0 * matrix
    unknown = Unknown(f"{name}: factor", 1.0, sd=sd, unit="", owner=name)
    nodes = next((tuple(int(n) for n in own) for e, _, own in model.fe.elements() if e == eid), ())
    parts = (TermPart("K", matrix, ((0, 1),)), TermPart("K", csc_array(negative), ()))
    return LinearTerm(name, "joint_stiffness", nodes, "", "", (unknown,), parts)
