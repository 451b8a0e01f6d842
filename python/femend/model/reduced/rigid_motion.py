"""How a model moves without stiffness: as a rigid body that nothing holds, or as a mechanism, part against part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.model.free_body import FREE
from femend.model.model import Model

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["ZeroModes", "count_zero", "rigid_motions", "zero_modes"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# share of a motion that is none of a rigid body's, up to which it is round-off of the modes of 0 Hz
ROUND_OFF = 1e-3
# units in the last place by which sums of that many terms, as a row of K has in a mesh of solids, are off at most
ULPS = 64
# elements of which the motion of the greatest part is sought, at most
TRIED = 200
# nodes and elements that are named, at most
SHOWN = 8


@dataclass(frozen=True, slots=True)
class ZeroModes:
    """Ways in which a model moves without stiffness: `rigid` of a rigid body, and `mechanism` in which parts move
    against each other; then `nodes` and `elements` are those that move where a part is held, or else those that move
    otherwise than the greatest part, and elements all of whose nodes do."""

    rigid: int
    mechanism: int
    nodes: tuple[int, ...] = ()
    elements: tuple[int, ...] = ()

    @property
    def text(self) -> str:
        """What to look for in the deck; empty where the model is held, or free in all six ways of a body.

        >>> ZeroModes(1, 0).text[:74]
        'the model moves freely in 1 way (1 mode of 0 Hz, of the 6 of a free body):'
        """
        n = self.rigid + self.mechanism
        if n == 0 or (self.rigid == FREE and not self.mechanism):
            return ""
        ways = f"the model moves freely in {n} way{'s' * (n > 1)} ({n} mode{'s' * (n > 1)} of 0 Hz"
        if not self.mechanism:
            return (
                f"{ways}, of the {FREE} of a free body): if the structure is held there, a support or the stiffness of "
                "a spring is missing in the deck"
            )
        who = f"; it is {_named('node', self.nodes)} that move{'s' * (len(self.nodes) == 1)}" if self.nodes else ""
        of = f" ({_named('element', self.elements)})" if self.elements else ""
        return (
            f"{ways}, {self.mechanism} of them a mechanism, in which parts move against each other{who}{of}): if the "
            "structure is held there, a support, a connection or the stiffness of a spring is missing in the deck, or "
            "pins (PA, PB of CBAR and CBEAM) release more than they should"
        )


def rigid_motions(model: Model) -> FloatArray:
    """Motions (6 n_nodes, 6) of all GRIDs, in their own systems, as of a rigid body: along X, Y, Z by 1 (the model's
    unit of length), and about them, through the middle of the nodes, by 1 at their mean distance (root of squares);
    GRIDs that are held and that no element connects have no part in the middle and the distance."""
    return _rigid_motions(model, _part_of_it(model, _free(model)))


def _rigid_motions(model: Model, part: BoolArray) -> FloatArray:
    """`rigid_motions` about the middle of the GRIDs `part` (n_nodes,)."""
    grid = ~model.is_scalar
    xyz, size = _about_middle(model, part)
    R = np.zeros((len(xyz), 6, 6))
    R[:, :3, :3] = np.eye(3)
    for axis in range(3):
        R[:, :3, 3 + axis] = np.cross(np.eye(3)[axis], xyz) / size
        R[:, 3 + axis, 3 + axis] = 1 / size
    frames = model.frames[grid]
    R[:, :3], R[:, 3:] = frames @ R[:, :3], frames @ R[:, 3:]
    return R.reshape(-1, 6)


def _about_middle(model: Model, part: BoolArray) -> tuple[FloatArray, float]:
    """Coordinates (n, 3) of the GRIDs about the middle of those in `part` (n,), and the mean distance of these from it
    (1 where there is none)."""
    xyz = model.xyz[~model.is_scalar]
    if not part.any():
        return xyz, 1.0
    xyz = xyz - xyz[part].mean(axis=0)
    return xyz, float(np.sqrt((xyz[part] ** 2).sum(axis=1).mean())) or 1.0


def _free(model: Model) -> BoolArray:
    """Which DOFs (n_nodes, 6) of the GRIDs are not held: free, or tied to one that is."""
    reach = np.asarray(abs(model.transformation()).sum(axis=1)).reshape(-1, 6)
    return np.asarray(reach[~model.is_scalar] > 0)


def _part_of_it(model: Model, free: BoolArray) -> BoolArray:
    """Which GRIDs (n_nodes,) are part of the structure: those that are not held, and held ones that an element connects
    with others. One that is held and that nothing connects, as an orientation's, says nothing of how the rest moves."""
    joined = {node for _, _, nodes in model.fe.elements() if len(nodes) > 1 for node in nodes}
    ids = model.node_ids[~model.is_scalar].tolist()
    return np.asarray(free.any(axis=1) | np.array([node in joined for node in ids], dtype=np.bool_))


def count_zero(model: Model, K: csc_array, freq: FloatArray, phi: FloatArray) -> int:
    """How many of the lowest modes of a `model` are of 0 Hz as far as the rounding of its stiffness `K` (n_a, n_a)
    tells: `freq` (n,) in Hz ascending, `phi` (6 n_nodes, n) their mass-normalised shapes at all GRIDs.

    K is off by some units in the last place of what is summed in it, and omega^2 of a mode then by as much of
    phi^T |K| phi. What is summed at a node counts with its stiffest direction, for translations and for rotations: a
    part condensed to its ends, or drawn askew to the axes, has the rounding of that one in all. Products of both kinds
    are bounded by those of each (Cauchy-Schwarz), so that the model's units play no part.
    """
    terms = abs(K).tocoo()
    at = model.g_rows()
    # three translations or three rotations of one node
    triple = at // 3
    row, column = terms.coords
    alike = triple[row] % 2 == triple[column] % 2
    stiff = np.zeros(2 * len(model.node_ids))
    np.maximum.at(stiff, triple, np.bincount(row[alike], terms.data[alike], minlength=len(at)))
    off = (phi.reshape(-1, 3, phi.shape[1]) ** 2).sum(axis=1)
    off = ULPS * np.finfo(np.float64).eps * stiff[np.repeat(~model.is_scalar, 2)] @ off
    return int(np.cumprod((2 * np.pi * freq) ** 2 <= off).sum())


def zero_modes(model: Model, phi: FloatArray) -> ZeroModes:
    """What the modes of 0 Hz of a `model` are, whose shapes at all GRIDs are `phi` (6 n_nodes, n)."""
    free = _free(model)
    part = _part_of_it(model, free)
    R = _rigid_motions(model, part)
    # a rotation that is held, since no element resists it, stands still in a body that turns; others count by what
    # they move at the nodes' mean distance
    counts = free.copy()
    counts[:, :3] = part[:, None]
    weight = (counts * np.repeat([1.0, _about_middle(model, part)[1]], 3)).reshape(-1, 1)
    U, R = weight * phi, weight * R
    U = np.linalg.qr(U)[0]
    vectors, size, _ = np.linalg.svd(R, full_matrices=False)
    P = vectors[:, size > ROUND_OFF * size[0]]
    _, share, into = np.linalg.svd(U - P @ (P.T @ U), full_matrices=False)
    n = int((share > ROUND_OFF).sum())
    if n == 0:
        return ZeroModes(phi.shape[1], 0)
    nodes = _movers(model, U @ into[:n].T, R, bool((part & ~free.any(axis=1)).any()))
    inside = set(nodes)
    elements = tuple(eid for eid, _, at in model.fe.elements() if at and inside.issuperset(at))
    return ZeroModes(phi.shape[1] - n, n, nodes, elements)


def _named(what: str, ids: Sequence[int]) -> str:
    """The first of nodes or elements by number."""
    return f"{what}{'s' * (len(ids) > 1)} {', '.join(map(str, ids[:SHOWN]))}{', ...' * (len(ids) > SHOWN)}"


def _movers(model: Model, U: FloatArray, R: FloatArray, clamped: bool) -> tuple[int, ...]:
    """Nodes that move in `U` (6 n_nodes, n) where a node of the structure is `clamped` or an element stands still, as
    what a support holds does; else those that do not move as the greatest part does, which is what some element would
    do as a rigid body. `R` (6 n_nodes, 6) are the motions of such."""
    ids = model.node_ids[~model.is_scalar]
    at = {int(node): i for i, node in enumerate(ids)}
    U, R = U.reshape(len(ids), 6, -1), R.reshape(len(ids), 6, 6)
    least = ROUND_OFF * np.abs(U).max()
    apart = np.abs(U).max(axis=(1, 2)) > least
    every = [[at[n] for n in nodes if n in at] for _, _, nodes in model.fe.elements()]
    if clamped or any(len(rows) > 1 and not apart[rows].any() for rows in every):
        return tuple(int(n) for n in np.sort(ids[apart]))
    for rows in every[:: -(-len(every) // TRIED)]:
        own = np.linalg.lstsq(R[rows].reshape(-1, 6), U[rows].reshape(6 * len(rows), -1), rcond=ROUND_OFF)[0]
        other = np.abs(U - R @ own).max(axis=(1, 2)) > least
        apart = other if other.sum() < apart.sum() else apart
    return tuple(int(n) for n in np.sort(ids[apart]))
