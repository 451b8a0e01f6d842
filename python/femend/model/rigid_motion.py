"""How a model moves without stiffness: as a rigid body that nothing holds, or as a mechanism, part against part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.free_body import FREE
from femend.model.model import Model

__all__ = ["ZeroModes", "rigid_motions", "zero_modes"]

FloatArray = NDArray[np.float64]

# share of a motion that is none of a rigid body's, up to which it is round-off of the modes of 0 Hz
ROUND_OFF = 1e-3
# elements of which the motion of the greatest part is sought, at most
TRIED = 200
# nodes and elements that are named, at most
SHOWN = 8


@dataclass(frozen=True, slots=True)
class ZeroModes:
    """Ways in which a model moves without stiffness: `rigid` of a rigid body, and `mechanism` in which parts move
    against each other; then `nodes` and `elements` are those that move otherwise than the greatest part, and elements
    all of whose nodes do."""

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
    unit of length), and about them, through the middle of the nodes, by 1 at their mean distance (root of squares)."""
    grid = ~model.is_scalar
    xyz, size = _about_middle(model)
    R = np.zeros((len(xyz), 6, 6))
    R[:, :3, :3] = np.eye(3)
    for axis in range(3):
        R[:, :3, 3 + axis] = np.cross(np.eye(3)[axis], xyz) / size
        R[:, 3 + axis, 3 + axis] = 1 / size
    frames = model.frames[grid]
    R[:, :3], R[:, 3:] = frames @ R[:, :3], frames @ R[:, 3:]
    return R.reshape(-1, 6)


def _about_middle(model: Model) -> tuple[FloatArray, float]:
    """Coordinates (n, 3) of the GRIDs about their middle, and their mean distance from it (1 where there is none)."""
    xyz = model.xyz[~model.is_scalar]
    xyz = xyz - xyz.mean(axis=0)
    return xyz, float(np.sqrt((xyz**2).sum(axis=1).mean())) or 1.0


def zero_modes(model: Model, phi: FloatArray) -> ZeroModes:
    """What the modes of 0 Hz of a `model` are, whose shapes at all GRIDs are `phi` (6 n_nodes, n)."""
    R = rigid_motions(model)
    # a rotation that no element resists stands still; others count by what they move at the nodes' mean distance
    counts = np.any(np.abs(phi) > ROUND_OFF * np.abs(phi).max(axis=0, initial=0.0), axis=1).reshape(-1, 6)
    counts[:, :3] = True
    weight = (counts * np.repeat([1.0, _about_middle(model)[1]], 3)).reshape(-1, 1)
    U, R = weight * phi, weight * R
    U = np.linalg.qr(U)[0]
    vectors, size, _ = np.linalg.svd(R, full_matrices=False)
    P = vectors[:, size > ROUND_OFF * size[0]]
    _, share, into = np.linalg.svd(U - P @ (P.T @ U), full_matrices=False)
    n = int((share > ROUND_OFF).sum())
    if n == 0:
        return ZeroModes(phi.shape[1], 0)
    nodes = _movers(model, U @ into[:n].T, R)
    inside = set(nodes)
    elements = tuple(eid for eid, _, at in model.fe.elements() if at and inside.issuperset(at))
    return ZeroModes(phi.shape[1] - n, n, nodes, elements)


def _named(what: str, ids: Sequence[int]) -> str:
    """The first of nodes or elements by number."""
    return f"{what}{'s' * (len(ids) > 1)} {', '.join(map(str, ids[:SHOWN]))}{', ...' * (len(ids) > SHOWN)}"


def _movers(model: Model, U: FloatArray, R: FloatArray) -> tuple[int, ...]:
    """Nodes that do not move in `U` (6 n_nodes, n) as the greatest part does, which stands still or moves as some
    element would as a rigid body; `R` (6 n_nodes, 6) are the motions of such."""
    ids = model.node_ids[~model.is_scalar]
    at = {int(node): i for i, node in enumerate(ids)}
    U, R = U.reshape(len(ids), 6, -1), R.reshape(len(ids), 6, 6)
    least = ROUND_OFF * np.abs(U).max()
    apart = np.abs(U).max(axis=(1, 2)) > least
    every = [[at[n] for n in nodes if n in at] for _, _, nodes in model.fe.elements()]
    for rows in every[:: -(-len(every) // TRIED)]:
        own = np.linalg.lstsq(R[rows].reshape(-1, 6), U[rows].reshape(6 * len(rows), -1), rcond=ROUND_OFF)[0]
        other = np.abs(U - R @ own).max(axis=(1, 2)) > least
        apart = other if other.sum() < apart.sum() else apart
    return tuple(int(n) for n in np.sort(ids[apart]))
