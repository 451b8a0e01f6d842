"""Turns of axes, units and shifts that bring points without numbers onto others, and which of them to take."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

__all__ = ["Fit", "Fits", "best_fits"]

FloatArray = NDArray[np.float64]

# of the distance to the next model point: nearer than this a point belongs to one model point, which on a surface mesh
# one of five would do by chance (pi/16), and several together do not
NEAR_PITCH = 0.25
# two model points nearer to each other, of the model's diagonal, are one place: ends of a spring without length
COINCIDENT = 1e-6
# neighbours looked at for the next place; more model points than this at one place are rare
NEIGHBOURS = 9
# fits whose rms distances differ by less than this of the tolerance (or of the pitch, where that is less), or by this
# factor, are as good: the factor is what chance makes of the rms of ten points
AS_GOOD, AS_GOOD_FACTOR = 0.1, 1.25
# a fit replaces the frames as they are, where these fit within the tolerance, if its rms is less by this factor
CLEARLY = 3.0
# of the points that have to be near for the frames to be the same with a few misplaced; as of points by number
MOST = 2 / 3
# one shift is the smaller, which tells a turn from one as far, where the next is larger by this factor
SMALLER = 2.0
# points count no further than so many tolerances, so that one misplaced point does not decide
CAPPED = 5.0
# shifts that put one point on each model point are looked at up to so many, and so many of those that last are refined
PINNED, REFINED = 20000, 40
STEPS = 8


@dataclass(frozen=True, eq=False)
class Fit:
    """A turn `R` of axes, a `scale` and a `shift`, the `mate` (n,) and `distance` (n,) of each point, their `rms`."""

    R: FloatArray
    scale: float
    shift: FloatArray
    mate: NDArray[np.int64]
    distance: FloatArray
    rms: float

    @property
    def angle(self) -> float:
        """Of the turn in degrees; that of the turn after the mirror for a left-handed one."""
        R = self.R * np.sign(np.linalg.det(self.R))
        return float(np.degrees(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))))

    @property
    def size(self) -> float:
        """Of the shift."""
        return float(np.linalg.norm(self.shift))

    def same_turn(self, other: Fit) -> bool:
        """Are scale and turn the same?"""
        return self.scale == other.scale and bool((self.R == other.R).all())


@dataclass(frozen=True, eq=False)
class Fits:
    """The fit `taken`, the `others` that fit as well, nearest to it first, and whether something `prefers` it."""

    taken: Fit
    others: tuple[Fit, ...] = ()
    prefers: bool = True


class Search:
    """Points `a` (n, 3) to be laid on points `b` (m, 3) within `reach`."""

    def __init__(self, a: FloatArray, b: FloatArray, reach: float) -> None:
        from scipy.spatial import cKDTree

        self.a, self.b, self.reach = a, b, reach
        self.tree: cKDTree = cKDTree(b)
        apart = np.array(self.tree.query(b, k=min(NEIGHBOURS, len(b)))[0]).reshape(len(b), -1)
        apart[apart <= COINCIDENT * float(np.linalg.norm(np.ptp(b, axis=0)))] = np.inf
        self.near = np.minimum(NEAR_PITCH * apart.min(axis=1), reach)
        self.low, self.high = b.min(axis=0) - reach, b.max(axis=0) + reach
        # the outermost point first: it tells most of a shift, and each next is far from those before
        self.order = _spread(a)

    def fit(self, R: FloatArray, scale: float, shift: FloatArray, steps: int = 0) -> Fit:
        """With nearest points, the shift refined `steps` times (iterated closest points)."""
        x, moved = scale * self.a @ R.T + shift, np.array(shift)
        for _ in range(steps):
            step = np.mean(self.b[self.tree.query(x)[1]] - x, axis=0)
            x, moved = x + step, moved + step
            if np.abs(step).max() < 1e-3 * self.reach:
                break
        found, mate = self.tree.query(x)
        distance = np.asarray(found, dtype=np.float64)
        rms = float(np.sqrt(np.mean(np.minimum(distance, CAPPED * self.reach) ** 2)))
        return Fit(R, scale, moved, np.asarray(mate, dtype=np.int64), distance, rms)

    def is_near(self, fit: Fit) -> NDArray[np.bool_]:
        """Which points lie near one model point, (n,)."""
        return np.asarray(fit.distance <= self.near[fit.mate])

    def fits(self, R: FloatArray, scale: float) -> Iterator[Fit]:
        """Fits of one turn and scale: without a shift, box on box, and with the outermost point on model points."""
        moved = scale * self.a @ R.T
        low, high = moved.min(axis=0), moved.max(axis=0)
        starts = [np.zeros(3), 0.5 * (self.b.max(0) + self.b.min(0) - low - high), self.b.min(0) - low]
        for shift in (*starts, *self._pinned(moved, low, high)):
            yield self.fit(R, scale, shift, STEPS)

    def _pinned(self, moved: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
        """Shifts (k, 3) that put every point near a model point, its outermost on one; the smallest of them."""
        shifts = self.b - moved[self.order[0]]
        shifts = shifts[((low + shifts >= self.low) & (high + shifts <= self.high)).all(axis=1)]
        if len(shifts) > PINNED:
            shifts = shifts[np.random.default_rng(0).choice(len(shifts), PINNED, replace=False)]
        for i in self.order[1:]:
            if not len(shifts):
                break
            distance, mate = self.tree.query(moved[i] + shifts)
            shifts = shifts[distance <= self.near[mate]]
        return np.asarray(shifts[np.argsort(np.linalg.norm(shifts, axis=1), kind="stable")[:REFINED]])


def best_fits(a: FloatArray, b: FloatArray, scales: Sequence[float], reach: float) -> Fits:
    """Points `a` (n, 3) on the nearest of `b` (m, 3) within `reach`, by a turn of axes, one of `scales` and a shift.

    As they are, where each point is near a model point already; by a fit that is clearly better otherwise. Of fits
    that are as good the one nearest to none is preferred: no turn and no shift; no turn; no shift; the least turn. One
    that slides along the mesh is preferred to none of its kind.
    """
    search = Search(a, b, reach)
    as_is = search.fit(np.eye(3), 1.0, np.zeros(3))
    near = search.is_near(as_is)
    if near.all():
        return Fits(as_is)
    found = [f for s in scales for R in _turns() for f in search.fits(R, s)]
    best = min(found, key=lambda f: f.rms)
    clean = bool(search.is_near(best).all())
    if (as_is.distance <= reach).all() and not (clean and CLEARLY * best.rms < as_is.rms):
        return Fits(as_is)
    pitch = float(search.near.min()) / NEAR_PITCH
    limit = AS_GOOD_FACTOR * best.rms + AS_GOOD * min(reach, pitch)
    alike = _distinct(sorted((f for f in found if f.rms <= limit), key=lambda f: f.rms), reach)
    if any(np.linalg.det(f.R) > 0 for f in alike):  # a mirror that does no better is none
        alike = [f for f in alike if np.linalg.det(f.R) > 0]
    taken, prefers = _preferred(alike, reach)
    # most points are where they should be, and no shift or turn alone mends the others
    if near.sum() >= max(3, MOST * len(a)) and not (prefers and (taken.distance <= reach).all()):
        return Fits(as_is)
    # on a mesh finer than the tolerance anything smaller fits somewhere
    loose = not search.is_near(taken).all() and not np.isclose(taken.scale, 1.0)
    prefers = prefers and not (loose and (taken.angle > 0 or taken.size > reach))
    others = sorted(
        (f for f in alike if f is not taken),
        key=lambda f: (not f.same_turn(taken), round(f.angle), float(np.linalg.norm(f.shift - taken.shift))),
    )
    return Fits(taken, tuple(others), prefers)


def _turns() -> Iterator[FloatArray]:
    """The 48 turns of axes onto axes, half of them mirrored; none first."""
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        R = np.zeros((3, 3))
        R[range(3), order] = signs
        yield R


def _spread(a: FloatArray) -> list[int]:
    """The points, each the farthest from those before; the outermost first."""
    order = [int(np.argmax(np.linalg.norm(a - a.mean(axis=0), axis=1)))]
    apart = np.linalg.norm(a - a[order[0]], axis=1)
    while len(order) < len(a):
        apart[order] = -1.0
        order.append(int(np.argmax(apart)))
        apart = np.minimum(apart, np.linalg.norm(a - a[order[-1]], axis=1))
    return order


def _distinct(fits: Sequence[Fit], reach: float) -> list[Fit]:
    """Of `fits` with one turn and shifts within `reach` of each other the first."""
    kept: list[Fit] = []
    shifts: dict[tuple[float, bytes], list[FloatArray]] = {}
    for fit in fits:
        there = shifts.setdefault((fit.scale, fit.R.tobytes()), [])
        if not there or np.linalg.norm(np.array(there) - fit.shift, axis=1).min() > reach:
            there.append(fit.shift)
            kept.append(fit)
    return kept


def _preferred(alike: Sequence[Fit], reach: float) -> tuple[Fit, bool]:
    """The fit that is nearest to none of those `alike`, and whether it is so for a reason."""
    if len(alike) == 1:
        return alike[0], True
    still = [f for f in alike if f.size <= reach]
    straight = [f for f in alike if not (f.R - np.eye(3)).any()]
    both = [f for f in straight if f.size <= reach]
    if both:
        return both[0], len(both) == 1
    # units as they were read come before others
    kind = straight or still or list(alike)
    kind = [f for f in kind if np.isclose(f.scale, 1.0)] or kind
    least = min(f.angle for f in kind)
    kind = sorted((f for f in kind if f.angle < least + 1.0), key=lambda f: f.size)
    if len(kind) == 1:
        return kind[0], True
    slides = len({(f.scale, f.R.tobytes()) for f in kind}) < len(kind)
    return kind[0], not slides and SMALLER * kind[0].size < kind[1].size
