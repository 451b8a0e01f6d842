"""Members, patches and lumps of a model that are each off by themselves: what scatters from one to the next.

A group's factor moves all its members together; in the structure each differs by its tolerances, its welds and its
mesh. A member's section takes its stiffness and its mass along, so that they are one unknown; in a patch of shells or
solids mesh and joints put the stiffness off, which says nothing of the mass, and each is one of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from femend.model.model import Model
from femend.model.places.places import topology
from femend.model.terms.supports import connected

__all__ = ["SUPPORT_SD", "Unit", "units_of"]

FloatArray = NDArray[np.float64]

# relative standard deviations: stiffness and mass of a member or patch, a lumped mass
STIFFNESS_SD, MASS_SD, LUMP_SD = 0.01, 0.005, 0.02
# the same of the stiffness of shells and solids at a support: stresses are singular at a clamp, and the last half per
# cent of a frequency lies there however fine the mesh (quadratic bricks, 16 or 32 to a clamped bar, differ by as much)
SUPPORT_SD = 0.05
# supports beyond this number are idealisations of the deck (a plane model, a symmetry)
MAX_SUPPORTS = 60
# a lump given as a point has this radius of gyration, as a share of the model's diagonal
GYRATION = 0.025
# patches along the longest side of the elements of one property that are no beams
PATCHES = 4


@dataclass(frozen=True, slots=True)
class _Off:
    """Elements that are off together, by what standard deviations (relative) of their stiffness and of their mass;
    `radius` of gyration (a length) of a lump that has none in the deck."""

    elements: tuple[int, ...]
    stiffness: float = 0.0
    mass: float = 0.0
    radius: float = 0.0


@dataclass(frozen=True, eq=False)
class Unit:
    """Elements that are off together: one standard deviation of their stiffness and mass (m, m) on the rows (m,) of the
    g-set that they touch, and of their stiffness relative to itself (`sd`); `turns` where a lump was given an inertia
    that the deck has not."""

    elements: tuple[int, ...]
    rows: NDArray[np.int64]
    stiffness: csr_array
    mass: csr_array
    sd: float
    turns: bool = False


def units_of(model: Model) -> tuple[Unit, ...]:
    """Members, patches of other elements, and lumps."""
    top = topology(model)
    ones = np.ones(len(model.parameters))
    members = [*(tuple(chain) for _, _, chain in top.members), *((eid,) for eid in top.rods)]
    groups = [_Off(chain, STIFFNESS_SD, MASS_SD) for chain in members]
    diagonal = float(np.linalg.norm(np.ptp(model.xyz, axis=0)))
    others: dict[int, list[int]] = {}
    sections = {eid: pid for eid, _, pid, _ in model.deck.elements()}
    where: dict[int, FloatArray] = {}
    for eid, _, nodes in model.fe.elements():
        if eid == 0 or eid in top.beams:
            continue
        if len(nodes) > 2:
            others.setdefault(sections.get(eid) or 0, []).append(eid)
            where[eid] = np.mean([model.xyz[model.index(n)] for n in nodes], axis=0)
            continue
        rows, K, M = model.fe.element_matrices(eid, ones)
        if not K.any() and M.any():
            groups.append(_Off((eid,), mass=LUMP_SD, radius=0.0 if _turns(M, rows) else GYRATION * diagonal))
    for elements in others.values():
        for patch in _patches(elements, where):
            groups += [_Off(patch, STIFFNESS_SD), _Off(patch, mass=MASS_SD)]
    groups += [_Off(elements, SUPPORT_SD) for elements in _at_supports(model, top.held, set(where))]
    return tuple(_unit(model, group) for group in groups)


def _unit(model: Model, off: _Off) -> Unit:
    """The unit of elements that are off."""
    ones = np.ones(len(model.parameters))
    at: list[NDArray[np.int64]] = []
    values: list[FloatArray] = []
    for eid in off.elements:
        rows, K, M = model.fe.element_matrices(eid, ones)
        at.append(np.array([np.repeat(rows, len(rows)), np.tile(rows, len(rows))]))
        values.append(np.array([off.stiffness * K.ravel(), off.mass * M.ravel()]))
        if off.radius > 0:
            moving = rows % 6 < 3
            lump = float(np.trace(M[np.ix_(moving, moving)])) / 3
            turns = 6 * np.unique(rows // 6)[:1] + np.arange(3, 6)  # a point mass may have no rows for these
            at.append(np.array([turns, turns]))
            values.append(np.array([np.zeros(3), np.full(3, lump * off.radius**2)]))
    index, both = np.hstack(at), np.hstack(values)
    touched, local = np.unique(index, return_inverse=True)
    row, column = local.reshape(index.shape)
    shape = (len(touched), len(touched))
    stiffness, inertia = (_without_zeros(csr_array(coo_array((v, (row, column)), shape=shape))) for v in both)
    return Unit(off.elements, touched, stiffness, inertia, off.stiffness, off.radius > 0)


def _without_zeros(A: csr_array) -> csr_array:
    """The matrix, in place, without the entries that are zero: a unit that is off in its mass has no stiffness."""
    A.eliminate_zeros()
    return A


def _at_supports(model: Model, held: NDArray[np.bool_], among: set[int]) -> list[tuple[int, ...]]:
    """Elements of `among` at each region of nodes that cannot move; `held` (n_g,) are the DOFs that cannot."""
    at = {int(n) for n in model.node_ids[held.reshape(-1, 6)[:, :3].all(axis=1)]}
    own = [(eid, set(nodes)) for eid, _, nodes in model.fe.elements() if eid in among and at.intersection(nodes)]
    regions = connected(model, at.intersection(*[set().union(*(nodes for _, nodes in own))]))
    if len(regions) > MAX_SUPPORTS:
        return []
    return [tuple(eid for eid, nodes in own if nodes.intersection(region)) for region in regions]


def _turns(M: FloatArray, rows: NDArray[np.int64]) -> bool:
    """Whether an element's mass resists rotations."""
    turning = rows % 6 >= 3
    return bool(np.abs(M[np.ix_(turning, turning)]).max(initial=0.0) > 0)


def _patches(elements: Sequence[int], where: dict[int, FloatArray]) -> list[tuple[int, ...]]:
    """Elements cut into boxes of equal sides, `PATCHES` along the longest."""
    xyz = np.array([where[e] for e in elements])
    low, size = xyz.min(axis=0), float(np.ptp(xyz, axis=0).max())
    cells: dict[tuple[int, ...], list[int]] = {}
    for e, x in zip(elements, xyz, strict=True):
        cell = np.minimum((x - low) / max(size, 1e-300) * PATCHES, PATCHES - 1e-9).astype(int)
        cells.setdefault(tuple(cell.tolist()), []).append(e)
    return [tuple(c) for c in cells.values()]
