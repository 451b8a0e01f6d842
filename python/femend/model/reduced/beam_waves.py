"""What a beam of the deck leaves out of its own waves: those of bending in two planes, of twisting and of stretching.

Stiffnesses and masses are read off the element's matrices, so that it does not matter on which cards they stand.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.reduced.wider import Basis

__all__ = ["BEAMS", "Beam", "beam_errors", "beam_of"]

FloatArray = NDArray[np.float64]

BEAMS = ("CBAR", "CBEAM", "CROD", "CONROD")
# those of them that have no axes across them
_RODS = ("CROD", "CONROD")
# a stiffness or mass below this share of the largest of its kind is none
NONE = 1e-9


@dataclass(frozen=True, eq=False)
class Beam:
    """A beam: `rows` (n,) of the g-set, `K`, `M` (n, n) there, local `axes` (3, 3), one per row, in basic coordinates,
    `length`, and what takes translations and rotations (6,) of each end, in basic coordinates, to the rows (n, 6)."""

    rows: NDArray[np.int64]
    K: FloatArray
    M: FloatArray
    axes: FloatArray
    length: float
    ends: tuple[FloatArray, FloatArray]

    def along(self, vector: FloatArray, turning: bool, signs: tuple[float, float]) -> FloatArray:
        """Motion (n,) of both ends along a vector, or about it, each with its sign."""
        six = np.concatenate([np.zeros(3), vector] if turning else [vector, np.zeros(3)])
        return np.asarray(signs[0] * (self.ends[0] @ six) + signs[1] * (self.ends[1] @ six))

    def stiffness(self, vector: FloatArray, turning: bool) -> float:
        """E I or G J over the length where the ends are turned about a vector against each other, E A over it where
        they are moved along it; what they do otherwise is free, so that offsets take no part. 0 where there is none."""
        moving = np.abs(np.vstack([self.ends[0][:, :3].T, self.ends[1][:, :3].T])).max(axis=0) > 0
        held = ~moving if turning else moving
        own, other = np.flatnonzero(held), np.flatnonzero(~held)
        s = self.along(vector, turning, (-1.0, 1.0))[own]
        rest = self.K[np.ix_(own, other)]
        S = self.K[np.ix_(own, own)] - rest @ np.linalg.pinv(self.K[np.ix_(other, other)], hermitian=True) @ rest.T
        value = float(s @ S @ s) / 4
        return value if value > NONE * float(np.abs(np.diag(self.K)[own]).max(initial=0.0)) else 0.0

    def errors(self, omega: FloatArray, phi: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Relative errors (m,) of modes' frequencies `omega` (m,) rad/s with mass-normalised shapes `phi` (n, m), and
        the radians k h (m,) of the wave in the beam, for each kind of wave: (k h)^4/1440 and (k h)^2/24 times its share
        of the kinetic energy, and what lumping the mass of bending adds, from below.

        Stretching, whose waves are long, counts in rods, which have no other.
        """
        x, y, z = self.axes
        mass, bends = self._inertia(x, False), False
        for moves, turns in ((y, z), (z, y)):
            stiffness = self.stiffness(turns, True)
            if stiffness > 0 and mass > 0:
                bends = True
                kh = np.sqrt(omega * self.length * np.sqrt(mass / stiffness))
                share, lumped = self._bending(moves, turns, mass, phi)
                yield (-1.0 if self._lumped else 1.0) * share * kh**4 / 1440 + lumped, kh
        twisting = (self._inertia(x, True), self.stiffness(x, True))
        for inertia, stiffness, basis in (
            (*twisting, self._basis((x, True))),
            (0.0 if bends else mass, 0.0 if bends else self.stiffness(x, False), self._basis((x, False))),
        ):
            if stiffness > 0 and inertia > 0:
                kh = omega * np.sqrt(inertia / stiffness)
                part = basis @ (np.linalg.pinv(basis) @ phi)
                yield (-1.0 if self._lumped else 1.0) * (part * (self.M @ part)).sum(axis=0) * kh**2 / 24, kh

    def _bending(
        self, moves: FloatArray, turns: FloatArray, mass: float, phi: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Share (m,) of the kinetic energy that bending along and about two axes has, and by how much lumping its mass
        lowers the frequency (relative, signed): what it adds to the kinetic energy of the cubic shape."""
        basis = self._basis((moves, False), (turns, True))
        own = np.linalg.pinv(basis) @ phi
        part = basis @ own
        share = (part * (self.M @ part)).sum(axis=0)
        if not self._lumped:
            return share, np.zeros(len(share))
        h = self.length
        # about the axis that is turned the cubic's slope may be of either sign
        h = h * float(np.sign(np.cross(turns, self.axes[0]) @ moves))
        cubic = (mass / 420) * np.array(
            [[156, 54, 22 * h, -13 * h], [54, 156, 13 * h, -22 * h],
             [22 * h, 13 * h, 4 * h**2, -3 * h**2], [-13 * h, -22 * h, -3 * h**2, 4 * h**2]]
        )  # fmt: skip
        followed = (own * (cubic @ own)).sum(axis=0)
        return followed, (followed - share) / 2

    @property
    def _lumped(self) -> bool:
        """Whether the mass of each end is its own."""
        first, second = (np.flatnonzero(end.any(axis=1)) for end in self.ends)
        return float(np.abs(self.M[np.ix_(first, second)]).max()) <= NONE * float(np.abs(self.M).max())

    def _basis(self, *both: tuple[FloatArray, bool]) -> FloatArray:
        """Motions (n, 2 or 4) of either end along axes, or about those that are turned."""
        return np.array([self.along(v, turning, s) for v, turning in both for s in ((1.0, 0.0), (0.0, 1.0))]).T

    def _inertia(self, vector: FloatArray, turning: bool) -> float:
        whole = self.along(vector, turning, (1.0, 1.0))
        value = float(whole @ self.M @ whole)
        return value if value > NONE * float(np.abs(self.M).max()) else 0.0


def beam_errors(
    model: Model, V: Basis, Q: FloatArray, omega: FloatArray
) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """What each beam adds to the relative errors (m,) of modes of circular frequencies `omega` (m,) rad/s with
    mass-normalised shapes `Q` (r, m) in the basis `V` (n_g, r): its id, the error, positive where it makes a mode
    too high, and the radians k h (m,) of its wave, once for each kind of wave, at the deck's values."""
    for eid, card, nodes in model.fe.elements():
        beam = beam_of(model, eid, card, nodes) if eid and card in BEAMS else None
        for error, kh in () if beam is None else beam.errors(omega, V[beam.rows] @ Q):
            yield eid, error, kh


def beam_of(model: Model, eid: int, card: str, nodes: Sequence[int]) -> Beam | None:
    """The beam `eid`, on a `card` of `BEAMS`, between the first two of `nodes` at the deck's values; None where it has
    no length or its ends no DOFs of their own."""
    rows, K, M = model.fe.element_matrices(eid, np.ones(len(model.parameters)))
    axes, length = _rod_frame(model, nodes) if card in _RODS else model.fe.element_frame(eid)
    first, second = (_end(model, rows, node) for node in nodes[:2])
    if length <= 0 or not first.any() or not second.any():
        return None
    return Beam(rows, K, M, np.asarray(axes), length, (first, second))


def _rod_frame(model: Model, nodes: Sequence[int]) -> tuple[FloatArray, float]:
    """Axes (3, 3) and length of a rod; those across it are any."""
    a, b = (model.xyz[model.index(node)] for node in nodes[:2])
    length = float(np.linalg.norm(b - a))
    if length == 0:
        return np.eye(3), 0.0
    x = (b - a) / length
    y = np.cross(x, np.eye(3)[int(np.argmin(np.abs(x)))])
    y /= np.linalg.norm(y)
    return np.array([x, y, np.cross(x, y)]), length


def _end(model: Model, rows: NDArray[np.int64], node: int) -> FloatArray:
    """What takes translations and rotations (6,) of a node in basic coordinates to an element's rows (n, 6)."""
    index = model.index(node)
    whole = np.zeros((6, 6))
    whole[:3, :3] = whole[3:, 3:] = model.frames[index].T
    return np.asarray(np.where((rows // 6 == index)[:, None], whole[rows % 6], 0.0))
