"""Supports of shells and solids as places: what the deck holds, point by point or region by region, may give way.

A region of held nodes that share elements gives way along one rigid motion of the region, t on its held DOFs. With K_e
the sum of the elements around it, B = K_e t on the free DOFs and S = tᵀ K_e t, a spring k between the region and what
holds it leaves K - B Bᵀ/(k + S): along w = B/S the model loses S²/(k + S). That keeps the modes of the model as it is,
with all that is known of their frequencies and damping, where the support hardly gives way. The inertia of the region
itself in that motion is left out. That is for looking: whether it is a spring, and how stiff, is told with the region
set free in all of its motions and springs against them (`freed`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.places.held_motion import HeldMotion
from femend.model.places.place import AXES, Place
from femend.model.terms.supports import connected
from femend.numerals import listed

__all__ = ["support_places"]

FloatArray = NDArray[np.float64]

# regions beyond this number are idealisations of the deck (a plane model, a symmetry), not supports
MAX_REGIONS = 60
# elements around a region beyond which it is left out: the matrices would outgrow what a place is worth
MAX_ELEMENTS = 1000


def support_places(model: Model, held: NDArray[np.bool_], without: Sequence[int]) -> list[Place]:
    """Places where held nodes of shells and solids give way: each region of nodes held along an axis as a whole, in
    that direction, and each clamped region in rotation about its middle; nodes `without` are left out (ends of beams,
    which have places of their own). `held` (n_g,) are the DOFs of the g-set that cannot move."""
    at = {int(n): i for i, n in enumerate(model.node_ids)}
    around = _around(model, set(without))
    found: list[tuple[int, dict[int, int]]] = []
    for c in range(6):
        nodes = {n for n in around if _holds(held, at[n], c)}
        regions = sorted(sorted(group) for group in connected(model, nodes))
        if len(regions) <= MAX_REGIONS:
            found += [(c, {n: at[n] for n in region}) for region in regions]
    if not found:
        return []
    loose = frozenset(model.unsupported.g_rows().tolist())
    places = [_place(model, held, region, around, c, loose) for c, region in found]
    return [place for place in places if place is not None]


def _holds(held: NDArray[np.bool_], at: int, c: int) -> bool:
    """Whether the node at a position is held against translation along axis c, or against all for rotation."""
    return all(held[6 * at + k] for k in ([c] if c < 3 else [0, 1, 2]))


def _around(model: Model, without: set[int]) -> dict[int, list[int]]:
    """Elements at every node that shells and solids alone share."""
    around: dict[int, list[int]] = {}
    for eid, card, nodes in model.fe.elements():
        if len(nodes) < 3 or not card.startswith(("CQUAD", "CTRIA", "CHEXA", "CPENTA", "CTETRA", "CPYRAM")):
            without = without | set(nodes)
            continue
        for n in nodes:
            around.setdefault(n, []).append(eid)
    return {n: elements for n, elements in around.items() if n not in without}


def _place(
    model: Model,
    held: NDArray[np.bool_],
    region: dict[int, int],
    around: dict[int, list[int]],
    c: int,
    loose: frozenset[int],
) -> Place | None:
    """The region (nodes with their positions) cut loose in one rigid motion; None where nothing resists that, or no one
    parameter scales it all. `loose` are the rows of the g-set that nothing but SPC sets holds."""
    elements = sorted({eid for n in region for eid in around[n]})
    if len(elements) > MAX_ELEMENTS:
        return None
    motion = _rigid(model, held, list(region.values()), c)
    if not motion:
        return None
    ones = np.ones(len(model.parameters))
    scaled = {_scaling(model, eid) for eid in elements}
    if len(scaled) > 1 or -1 in scaled:
        return None
    force: dict[int, float] = {}
    size = 0.0
    for eid in elements:
        rows, K, _ = model.fe.element_matrices(eid, ones)
        pattern = K @ np.array([motion.get(int(r), 0.0) for r in rows])
        size = max(size, float(np.abs(pattern).max()))
        for row, value in zip(rows.tolist(), pattern.tolist(), strict=True):
            force[row] = force.get(row, 0.0) + value
    S = sum(force.get(row, 0.0) * value for row, value in motion.items())
    free = np.array([force[row] for row in force if not held[row]])
    if S <= 0 or np.abs(free).max(initial=0.0) < 1e-9 * size:
        return None
    keep = np.array(sorted(row for row, value in force.items() if value != 0.0), dtype=np.int64)
    w = np.array([force[int(row)] for row in keep]) / S
    own = model.drawn(region)
    label = f"support at node{'s' if len(own) > 1 else ''} {listed(own, 4)}, {AXES[c]}"
    (parameter,) = scaled
    return Place(
        "support", own, AXES[c], "ground", (keep,), (w,), None, parameter, tuple(elements), label, support=S,
        motions=_motions(model, held, list(region.values()), loose),
    )  # fmt: skip


def _motions(model: Model, held: NDArray[np.bool_], at: list[int], loose: frozenset[int]) -> tuple[HeldMotion, ...]:
    """Every translation along which, and rotation about the middle in which, all nodes at the positions `at` are held,
    and by nothing but SPC sets (`loose`). Rotations of nodes that nothing resists, as those of solids, are no part of
    it; none where a frame is turned against the axes and its node is not held in all of its directions."""
    if not all(np.array_equal(model.frames[i], np.eye(3)) or _holds(held, i, 3) for i in at):
        return ()
    found = []
    for c in range(6):
        motion = _rigid(model, held, at, c) if all(_holds(held, i, c) for i in at) else {}
        there = {row: value for row, value in motion.items() if row in loose}
        if there and all(row % 6 > 2 for row in motion if row not in loose):
            found.append(HeldMotion(c, tuple(there), tuple(there.values())))
    return tuple(found)


def _rigid(model: Model, held: NDArray[np.bool_], at: list[int], c: int) -> dict[int, float]:
    """Held DOFs of a region, nodes at the positions `at`, in a unit translation along basic axis c, or rotation about
    its middle by axis c - 3; the same about a line of nodes or a single node is none but where rotations are held."""
    xyz, frames = model.xyz, model.frames
    middle = xyz[at].mean(axis=0)
    axis = np.eye(3)[c % 3]
    motion: dict[int, float] = {}
    for i in at:
        frame = frames[i]
        shift = axis if c < 3 else np.cross(axis, xyz[i] - middle)
        turn = np.zeros(3) if c < 3 else axis
        for k, value in enumerate([*(frame @ shift), *(frame @ turn)]):
            if held[6 * i + k] and abs(value) > 1e-12:
                motion[6 * i + k] = float(value)
    return motion


def _scaling(model: Model, eid: int) -> int | None:
    """The parameter whose factor multiplies an element's whole stiffness, None where no parameter changes it, -1 where
    one changes it otherwise."""
    ones = np.ones(len(model.parameters))
    K = np.asarray(model.fe.element_matrices(eid, ones)[1])
    scaled: int | None = None
    for i in range(len(ones)):
        factors = ones.copy()
        factors[i] = 2.0
        changed = np.asarray(model.fe.element_matrices(eid, factors)[1])
        if np.allclose(changed, K, rtol=1e-9, atol=1e-12 * np.abs(K).max()):
            continue
        if scaled is not None or not np.allclose(changed, 2 * K, rtol=1e-9, atol=1e-12 * np.abs(K).max()):
            return -1
        scaled = i
    return scaled
