"""Laws that follow what a place was read to do, where none can be followed by simulation.

Motion through a play, and under other impacts, depends on its past so much that no simulation stays with it, at the
right law and values neither; in the beginning of a record, where one does, the place may hardly have moved. What the
place did is read off the recordings all the same, at the right place with the model near its priors. A law is asked for
the force that it makes of the motion read there, of a recording that it was not fitted to: nothing is fed back, so that
nothing grows (the restoring force surface, Masri and Caughey 1979, by its laws).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate, Start, laws_for, left_of, stacked, starts
from femend.diagnose.fitting.synchronised import judge_synchronised, synchronised
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.recovered import Recovered, recover
from femend.diagnose.locating.split import Split
from femend.estimate import Fit, Problem
from femend.model import Place

__all__ = ["AsRead", "Followed", "There", "followed_there", "held_near", "held_to_all"]

FloatArray = NDArray[np.float64]

# starts of a law that are asked
STARTS = 3


@dataclass(frozen=True, eq=False)
class Followed:
    """A law by its reported name, the values at which it follows the force that was read, and the share of that force
    it leaves (of the root of its power) on recordings it was not fitted to."""

    name: str
    start: Start
    left: float


@dataclass(frozen=True, eq=False)
class AsRead:
    """The fit of the model beside a free force at a `place` that explains the recordings, and the law that follows that
    force, if one clearly does.

    `held` is the law fitted while its motion is held near the one that was read, where it could be (`chosen` of a
    recording that it was not fitted to), `springs` the share of the force that a spring and dashpot leave, `as_well`
    are the names of laws that follow it about as well.
    """

    place: Place
    fit: Fit
    law: Followed | None
    held: Candidate | None = None
    springs: float = np.inf
    as_well: tuple[str, ...] = ()

    @property
    def p(self) -> FloatArray:
        """Unknowns (n_p,) of the model."""
        return self.fit.p if self.held is None else self.held.p


@dataclass(frozen=True, eq=False)
class There:
    """A joint, and what it did in the parts of a split of the recordings, each read once; `p` (n_p,) are the model's
    unknowns beside a free force there."""

    split: Split
    joint: Joint
    p: FloatArray

    @cached_property
    def read(self) -> Recovered | None:
        """What laws begin from."""
        return self._on(self.split.reading)

    @cached_property
    def fitted(self) -> Recovered | None:
        """What laws are fitted beside."""
        return self.read if self.split.fitting is self.split.reading else self._on(self.split.fitting)

    @cached_property
    def seen(self) -> Recovered | None:
        """What laws are judged on."""
        return self._on(self.split.choosing)

    def _on(self, problem: Problem) -> Recovered | None:
        return recover(problem, self.joint, self.p, densely=True)


def followed_there(there: There) -> tuple[list[Followed], float]:
    """Nonlinear laws at a joint, each at its best, by rising share of the force that they leave, and the share that a
    spring and dashpot leave. None, and infinite, where nothing could be read."""
    joint, read, seen = there.joint, there.read, there.seen
    if read is None or seen is None:
        return [], np.inf
    found: dict[str, Followed] = {}
    for name, entry in laws_for(joint.place.kind):
        for start in starts(entry, joint, read, STARTS) if entry.kind == "nonlinear" else ():
            left = np.inf if np.isnan(start.left) else left_of(start, seen)
            if np.isfinite(left) and (name not in found or left < found[name].left):
                found[name] = Followed(name, start, left)
    return sorted(found.values(), key=lambda f: f.left), _of_springs(read, seen)


def held_near(there: There, laws: Sequence[Followed]) -> list[tuple[Followed, Candidate]]:
    """The laws fitted while their motion is held near the one that was read, in rising order of what they leave of the
    recordings that they were not fitted to."""
    split, fitted, seen = there.split, there.fitted, there.seen
    if fitted is None or seen is None:
        return []
    found = []
    for law in laws:
        made = synchronised(split.fitting, there.joint, fitted, law.name, law.start)
        if made is not None:
            chosen = judge_synchronised(split.choosing, made, seen)
            found.append((law, replace(made, chosen=chosen)))
    return sorted(found, key=lambda one: one[1].chosen)


def held_to_all(split: Split, joint: Joint, law: Followed, held: Candidate) -> Candidate:
    """A law that was `held` near the motion of some recordings, fitted so to all of them; as it is where it could not
    be."""
    if split.fitting is split.whole:
        return held
    read = recover(split.whole, joint, held.p, densely=True)
    if read is None:
        return held
    begun = Start(law.start.physics, held.values, held.k, held.c, law.left)
    made = synchronised(split.whole, joint, read, law.name, begun)
    return held if made is None else replace(made, chosen=held.chosen)


def _of_springs(read: Recovered, seen: Recovered) -> float:
    """Share of the force `seen` that the spring and dashpot leave which follow the force `read` best."""

    def columns(of: Recovered) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        velocity = [s[:, None] * D for D, s in zip(of.D, of.s, strict=True)]
        return np.array([stacked(of.D, of), stacked(velocity, of)]).T, stacked(of.F, of)

    A, b = columns(read)
    factors = np.linalg.lstsq(np.concatenate([A.real, A.imag]), np.concatenate([b.real, b.imag]), rcond=None)[0]
    A, b = columns(seen)
    return float(np.linalg.norm(b - A @ factors) / np.linalg.norm(b))
