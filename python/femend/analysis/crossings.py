"""Speeds at which followed branches meet a condition: orders of the speed, growth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from femend.analysis.follow import State, follow
from femend.analysis.whirl import WhirlMeter
from femend.data.campbell import CriticalSpeed, StabilityLimit

__all__ = ["DEPTH", "SURE", "Finder", "Walk"]

SURE = 0.75  # bi-orthogonality with the mode before from which a branch is taken to go on
DEPTH = 7  # halvings of a speed step at most
ROOT = 1e-9  # accuracy of critical speeds and limits, relative
GROWTH = 1e-9  # real part beside the pole from which motion grows
RESONANT = 2**-0.5  # damping fraction from which a response has no peak
STEPS = 80  # of a bracketed root: more than halving alone takes from the widest bracket to ROOT

Ints = NDArray[np.int64]
# a state, one of its columns and what is to vanish there
Point = tuple[State, int, float]


@dataclass
class Walk:
    """States in the order of speeds, and for each the column of every branch (-1: not there)."""

    states: list[State]
    columns: list[Ints]
    sure: list[NDArray[np.float64]]
    asked: list[bool]


@dataclass
class Finder:
    """Critical speeds and limits of stability of a `walk`; `at` gives the modes at a speed (rad/s).

    `others` are critical speeds of modes that are not among those followed.
    """

    at: Callable[[float], State]
    meter: WhirlMeter
    walk: Walk
    others: list[float] = field(default_factory=list)

    def critical(self, orders: tuple[float, ...]) -> tuple[CriticalSpeed, ...]:
        """Where Im pole = order x speed."""
        found = []
        for order in orders:
            for i in range(len(self.walk.states) - 1):
                for branch, state, column in self._critical_between(i, order):
                    pole = state.poles[column]
                    whirl = float(self.meter.of(state.right, state.poles)[column])
                    zeta = float(-pole.real / abs(pole))
                    freq = float(pole.imag / (2 * np.pi))
                    found.append(
                        CriticalSpeed(order, branch, state.speed, freq, whirl, zeta, float(state.residual[column]))
                    )
        return tuple(sorted(found, key=lambda c: (c.speed, c.order)))

    def limits(self) -> tuple[StabilityLimit, ...]:
        """Where Re pole changes sign."""
        found = []
        first, columns = self.walk.states[0], self.walk.columns[0]
        for branch, column in enumerate(columns):
            if column >= 0 and _growth(first, int(column)) > 0:
                freq = float(first.poles[column].imag / (2 * np.pi))
                found.append(StabilityLimit(branch, first.speed, freq, True))
        for i in range(len(self.walk.states) - 1):
            for branch, (left, right) in self._changes(i, _growth).items():
                root = self._followed_root(_growth, left, right)
                if root is not None:
                    freq = float(root[0].poles[root[1]].imag / (2 * np.pi))
                    found.append(StabilityLimit(branch, root[0].speed, freq, left[2] < 0))
        return tuple(sorted(found, key=lambda limit: limit.speed))

    def _changes(self, i: int, value: Callable[[State, int], float]) -> dict[int, tuple[Point, Point]]:
        """Branches whose `value` changes sign between the states `i` and `i` + 1, with both ends."""
        (left, right), out = self.walk.states[i : i + 2], {}
        for branch, (a, b) in enumerate(zip(self.walk.columns[i], self.walk.columns[i + 1], strict=True)):
            if a < 0 or b < 0 or (left.poles[a] == 0 and right.poles[b] == 0):
                continue
            ends = value(left, int(a)), value(right, int(b))
            if _changed(*ends):
                out[branch] = ((left, int(a), ends[0]), (right, int(b), ends[1]))
        return out

    def _critical_between(self, i: int, order: float) -> list[tuple[int, State, int]]:
        """Branch, state and column of the critical speeds between the states `i` and `i` + 1."""

        def over(state: State, column: int) -> float:
            return float(state.poles[column].imag - order * state.speed)

        left, right = self.walk.states[i : i + 2]
        changes = self._changes(i, over)
        roots = self._ordered_roots(left, right, order)
        out, taken = [], set()
        for root, branch in self._branches_of(roots, i, sorted(changes)):
            if branch is None:
                pole = root[0].poles[root[1]]
                if -pole.real < RESONANT * abs(pole):
                    self.others.append(root[0].speed)
            else:
                out.append((branch, *root))
                taken.add(branch)
        # a mode that became overdamped on the way shifts the order of the others: the branch itself is followed
        for branch in sorted(changes.keys() - taken):
            found = self._followed_root(over, *changes[branch])
            same = [s for s, c in roots if found is not None and abs(s.speed - found[0].speed) <= 1e-6 * s.speed]
            if found is not None and not same:
                out.append((branch, *found))
        return out

    def _ordered_roots(self, left: State, right: State, order: float) -> list[tuple[State, int]]:
        """Crossings of the j-th lowest frequency with the line, for every j.

        In order of size frequencies are continuous functions of the speed, whatever modes they belong to: a change of
        sign brackets a crossing without anything being followed. With K positive definite, and without damping and
        circulatory terms, crossings are eigenvalues of the pencil K - W^2 (n^2 M - i n G - S), whose inertia falls by
        one at each: all go the same way, and the ends tell how many there are.
        """
        known = {s.speed: s for s in (left, right)}

        def gap(state: State, j: int) -> float:
            return float(np.sort(state.poles.imag)[j] - order * state.speed)

        roots = []
        for j in range(min(left.poles.size, right.poles.size)):
            if not _changed(gap(left, j), gap(right, j)):
                continue
            below, above = left, right
            for state in sorted(known.values(), key=lambda s: s.speed):  # those solved for other roots narrow it
                if state.poles.size > j and left.speed < state.speed < right.speed:
                    if _changed(gap(below, j), gap(state, j)):
                        above = state
                        break
                    below = state
            root = self._ordered_root(gap, j, below, above, known)
            if root is not None:
                roots.append((root, int(np.argsort(root.poles.imag, kind="stable")[j])))
        return roots

    def _ordered_root(
        self, gap: Callable[[State, int], float], j: int, left: State, right: State, known: dict[float, State]
    ) -> State | None:
        """The state at which the `gap` of the j-th frequency vanishes; None where it jumps instead."""
        bracket = _Bracket(left.speed, gap(left, j), right.speed, gap(right, j))
        best = right
        for _ in range(STEPS):
            if abs(gap(best, j)) <= ROOT * float(np.sort(best.poles.imag)[j]):
                return best
            if bracket.closed:
                return None
            speed = bracket.next()
            best = known[speed] = known[speed] if speed in known else self.at(speed)
            if best.poles.size <= j:
                return None
            bracket.narrow(speed, gap(best, j))
        return None

    def _branches_of(
        self, roots: list[tuple[State, int]], i: int, changed: list[int]
    ) -> list[tuple[tuple[State, int], int | None]]:
        """Each root with its branch: of the branches that `changed` sides between the states `i` and `i` + 1 every one
        has a root as far as there are any, those first that are followed there from both ends; None for further
        modes, and for what no branch is followed to."""
        from scipy.optimize import linear_sum_assignment

        if not roots:
            return []
        like = np.zeros((len(roots), self.walk.columns[i].size))
        for end in (i, i + 1):
            if self.walk.states[end].speed != 0:  # at rest planes that coincide mix at will
                for r, (state, column) in enumerate(roots):
                    like[r] += self._carried(end, state) == column
        out: dict[int, int] = {}
        if changed:
            rows, columns = linear_sum_assignment(-like[:, changed])
            out = {int(r): changed[int(c)] for r, c in zip(rows, columns, strict=True)}
        lost = np.flatnonzero((self.walk.columns[i] < 0) != (self.walk.columns[i + 1] < 0))
        for r in range(len(roots)):
            for branch in lost:
                if r not in out and like[r, branch] and branch not in out.values():
                    out[r] = int(branch)
        return [(root, out.get(r)) for r, root in enumerate(roots)]

    def _carried(self, end: int, target: State) -> Ints:
        """Columns in `target` of all branches, followed from a state of the walk."""
        state, columns = self.walk.states[end], self.walk.columns[end]
        return self._followed(state, columns, target, DEPTH)

    def _followed(self, state: State, columns: Ints, target: State, depth: int) -> Ints:
        """Columns in `target` of modes in `columns` of `state` (-1: lost), with halved steps where that is not
        clear."""
        quality, order = follow(state, target)
        here = columns >= 0
        if depth > 0 and np.any(quality[columns[here]] < SURE):
            middle = self.at(0.5 * (state.speed + target.speed))
            return self._followed(middle, self._followed(state, columns, middle, depth - 1), target, depth - 1)
        return np.where(here, order[columns], -1)

    def _followed_root(
        self, value: Callable[[State, int], float], left: Point, right: Point
    ) -> tuple[State, int] | None:
        """Bracketed root of a branch, which is followed from the nearer end; None where it is lost or what is found
        is none."""
        bracket = _Bracket(left[0].speed, left[2], right[0].speed, right[2])
        for _ in range(STEPS):
            if bracket.closed:
                break
            speed = bracket.next()
            near = left if left[0].speed > 0 and speed - left[0].speed < right[0].speed - speed else right
            state = self.at(speed)
            column = int(self._followed(near[0], np.array([near[1]]), state, DEPTH)[0])
            if column < 0:
                return None
            f = value(state, column)
            if abs(f) <= ROOT * abs(state.poles[column]):
                return state, column
            if bracket.narrow(speed, f):
                left = (state, column, f)
            else:
                right = (state, column, f)
        # the value jumps where the branch was mistaken on the way
        end = min(left, right, key=lambda p: abs(p[2]))
        return (end[0], end[1]) if abs(end[2]) <= 1e3 * ROOT * abs(end[0].poles[end[1]]) else None


@dataclass
class _Bracket:
    """A root between two places by the rule of Illinois: at `a` the value is `fa`, at `b` it is `fb` of the other
    sign."""

    a: float
    fa: float
    b: float
    fb: float
    side: int = 0

    @property
    def closed(self) -> bool:
        return self.fb == 0 or self.b - self.a <= 1e-3 * ROOT * abs(self.b)

    def next(self) -> float:
        x = (self.a * self.fb - self.b * self.fa) / (self.fb - self.fa)
        margin = 1e-4 * ROOT * self.b
        return float(min(max(x, self.a + margin), self.b - margin))

    def narrow(self, x: float, f: float) -> bool:
        """Takes the value `f` at `x` in; True where it becomes the left end."""
        if f * self.fa > 0:
            if self.side == 1:
                self.fb *= 0.5
            self.a, self.fa, self.side = x, f, 1
            return True
        if self.side == -1:
            self.fa *= 0.5
        self.b, self.fb, self.side = x, f, -1
        return False


def _changed(left: float, right: float) -> bool:
    """A change of sign; a root at the left end belongs to what lies before it."""
    return left != 0 and left * right <= 0


def _growth(state: State, column: int) -> float:
    """Real part of a pole beyond what is known of it: poles are as good as the residual of their vector."""
    pole = state.poles[column]
    return float(pole.real - max(GROWTH, float(state.doubt[column])) * abs(pole))
