"""Campbell diagram: modes followed over the speed, their whirl, critical speeds and limits of stability."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.analysis.complex_modes import ComplexSolver
from femend.analysis.follow import State, follow
from femend.analysis.turning import TurningSystem, as_turning_system
from femend.analysis.whirl import WhirlMeter
from femend.data.campbell import Campbell, CriticalSpeed, StabilityLimit
from femend.dof import Dof
from femend.model import Model
from femend.model.spinning import SpinningPart

__all__ = ["campbell"]

SURE = 0.75  # bi-orthogonality with the mode before from which a branch is taken to go on
GUARD = 0.5  # modes beyond the wanted ones, as a share, so that branches may change places
DEPTH = 7  # halvings of a speed step at most
ROOT = 1e-9  # accuracy of critical speeds and limits, relative
GROWTH = 1e-9  # real part beside the pole from which motion grows


@dataclass
class _Walk:
    """States in the order of speeds, and for each the column of every branch (-1: not there)."""

    states: list[State]
    columns: list[NDArray[np.int64]]
    sure: list[NDArray[np.float64]]
    asked: list[bool]


def campbell(
    system: Model | TurningSystem,
    speeds: ArrayLike,
    *,
    n_modes: int | None = None,
    f_max: float | None = None,
    parts: Sequence[SpinningPart] = (),
    orders: Sequence[float] = (1.0,),
    preload: Mapping[Dof, float] | None = None,
    factors: Mapping[str, float] | None = None,
    tolerance: float = 1e-8,
) -> Campbell:
    """The lowest `n_modes` (10 by default) or those up to `f_max` in Hz at the first of `speeds` (rad/s, rising),
    followed.

    `system`, `parts`, `preload`, `factors` and `tolerance` as in `complex_modes`. Modes of neighbouring speeds are
    paired by bi-orthogonality, |y_i^T ((p_i + p_j) M + C + W G) psi_j| / |modal a|, with an assignment over all of
    them; where the pairing is not clear the step is halved. Whirl is told forward or backward by the orbits of the
    parts. Critical speeds are where the damped frequency is an order of `orders` times the speed; they and the
    limits of stability are solved for at the very speed by bracketed root finding. One factorisation and one space
    serve all speeds.

    Genta, Dynamics of Rotating Systems, 2005 (Campbell diagram, stability); bi-orthogonality as in Meirovitch,
    Computational Methods in Structural Dynamics, 1980, in the form that the quadratic problem gives it: from
    y_i^T D(p_i) = 0 and D(p_j) psi_j = 0 the difference of both, over p_i - p_j, is 0. Raises ValueError for speeds
    that do not rise or are fewer than two, and what `complex_modes` raises.

    A disc of Id = 3, Ip = 2 on springs of 400 tilts at W (Ip/2 Id +- sqrt((Ip/2 Id)^2 + ...)): forward critical at
    sqrt(400 / (Id - Ip)) = 20 rad/s, backward at sqrt(400 / (Id + Ip)) = 8.944 rad/s.

    >>> from scipy.sparse import csc_array, eye_array
    >>> disc = TurningSystem(csc_array(3.0 * eye_array(2)), csc_array(400.0 * eye_array(2)), (Dof(1, 5), Dof(1, 6)),
    ...                      G=csc_array([[0.0, 2.0], [-2.0, 0.0]]), parts=(SpinningPart((1.0, 0.0, 0.0)),))
    >>> found = campbell(disc, [0.0, 10.0, 30.0], n_modes=2)
    >>> [(round(c.speed, 4), round(c.whirl)) for c in found.critical]
    [(8.9443, -1), (20.0, 1)]
    """
    speed = np.asarray(speeds, dtype=np.float64)
    if speed.ndim != 1 or speed.size < 2 or not np.all(np.diff(speed) > 0) or not np.isfinite(speed).all():
        raise ValueError(f"speeds of shape {speed.shape} must be two or more rising values in rad/s")
    system = as_turning_system(system, parts, preload, factors)
    if n_modes is None and f_max is None:
        n_modes = min(10, len(system.dofs))
    beyond = None if n_modes is None else n_modes + max(4, int(GUARD * n_modes))
    solver = _solver(system, n_modes, beyond, f_max, tolerance, float(speed[-1]))
    walk = _walked(system, solver, speed, n_modes, f_max)
    return _told(system, solver, walk, tuple(float(o) for o in orders))


def _solver(
    system: TurningSystem, n_modes: int | None, beyond: int | None, f_max: float | None, tolerance: float, top: float
) -> ComplexSolver:
    """A solver for the wanted modes and some beyond, as many as there are; its space begins at the `top` speed."""
    wider = None if f_max is None else (1 + GUARD) * f_max
    try:
        solver = ComplexSolver(system, n_modes=beyond, f_max=wider, tolerance=tolerance)
        solver.raw(top)
    except ValueError:
        if n_modes is None:
            raise
        return ComplexSolver(system, n_modes=n_modes, f_max=wider, tolerance=tolerance)
    return solver


def _walked(
    system: TurningSystem, solver: ComplexSolver, speeds: NDArray[np.float64], n_modes: int | None, f_max: float | None
) -> _Walk:
    """Branches of the modes at the first speed, through all speeds."""

    def at(speed: float) -> State:
        return State.of(system, solver.raw(speed), speed)

    # at rest planes of equal stiffness mix at will: branches begin a little later, where they are told apart
    first = float(speeds[0]) if speeds[0] != 0 else 1e-3 * float(speeds[1])
    state = at(first)
    wanted = state.poles.size if n_modes is None else min(n_modes, state.poles.size)
    if f_max is not None:
        wanted = min(wanted, int(np.sum(np.abs(state.poles) <= 2 * np.pi * f_max)))
    columns = np.arange(wanted)
    walk = _Walk([state], [columns], [np.ones(wanted)], [first == speeds[0]])
    for target in speeds[1:]:
        _step(walk, at, float(target), DEPTH, True)
    if speeds[0] == 0:
        rest = at(0.0)
        _, order = follow(state, rest, by_pole=True)
        walk.states.insert(0, rest)
        walk.columns.insert(0, np.where(columns < order.size, order[columns], -1))
        walk.sure.insert(0, np.ones(wanted))
        walk.asked.insert(0, True)
        for values in (walk.states, walk.columns, walk.sure, walk.asked):
            del values[1]
    return walk


def _step(walk: _Walk, at: Callable[[float], State], target: float, depth: int, asked: bool) -> None:
    """Takes the branches to `target`, in halves where their continuation is not clear."""
    before, columns = walk.states[-1], walk.columns[-1]
    after = at(target)
    quality, order = follow(before, after)
    here = columns >= 0
    sure = np.where(here, quality[columns], np.nan)
    if depth > 0 and np.any(sure[here] < SURE):
        middle = 0.5 * (before.speed + target)
        _step(walk, at, middle, depth - 1, False)
        _step(walk, at, target, depth - 1, asked)
        return
    # without any likeness at the smallest step the branch has left the modes computed
    walk.states.append(after)
    walk.columns.append(np.where(here & (np.nan_to_num(sure) > 0.1), order[columns], -1))
    walk.sure.append(sure)
    walk.asked.append(asked)


def _told(system: TurningSystem, solver: ComplexSolver, walk: _Walk, orders: tuple[float, ...]) -> Campbell:
    """The table of branches, with what is found between its rows."""
    meter = WhirlMeter(system)
    shape = (len(walk.states), walk.columns[0].size)
    poles = np.full(shape, np.nan + 1j * np.nan)
    whirl, residual = np.full(shape, np.nan), np.full(shape, np.nan)
    for i, (state, columns) in enumerate(zip(walk.states, walk.columns, strict=True)):
        here = columns >= 0
        poles[i, here] = state.poles[columns[here]]
        residual[i, here] = state.residual[columns[here]]
        whirl[i, here] = meter.of(state.right[:, columns[here]])
    finder = _Finder(system, solver, meter, walk)
    critical, limits = finder.critical(orders), finder.limits()
    return Campbell(
        np.array([s.speed for s in walk.states]),
        np.array(walk.asked),
        poles,
        whirl,
        residual,
        np.array(walk.sure),
        critical,
        limits,
        np.array([s.n_divergent for s in walk.states]),
        orders,
    )


class _Finder:
    """Speeds at which a branch meets a condition, solved for at the very speed."""

    def __init__(self, system: TurningSystem, solver: ComplexSolver, meter: WhirlMeter, walk: _Walk) -> None:
        self.system, self.solver, self.meter, self.walk = system, solver, meter, walk

    def critical(self, orders: tuple[float, ...]) -> tuple[CriticalSpeed, ...]:
        """Where Im pole = order x speed."""
        found = []
        for order in orders:

            def over(state: State, column: int, order: float = order) -> float:
                return float(state.poles[column].imag - order * state.speed)

            for branch, state, column in self.crossings(over):
                pole = state.poles[column]
                whirl = float(self.meter.of(state.right[:, [column]])[0])
                zeta = float(-pole.real / abs(pole))
                freq = float(pole.imag / (2 * np.pi))
                found.append(
                    CriticalSpeed(order, branch, state.speed, freq, whirl, zeta, float(state.residual[column]))
                )
        return tuple(sorted(found, key=lambda c: (c.speed, c.order)))

    def limits(self) -> tuple[StabilityLimit, ...]:
        """Where Re pole changes sign."""

        def growth(state: State, column: int) -> float:
            pole = state.poles[column]
            return float(pole.real - GROWTH * abs(pole))

        found = []
        first, columns = self.walk.states[0], self.walk.columns[0]
        for branch, column in enumerate(columns):
            if column >= 0 and growth(first, int(column)) > 0:
                freq = float(first.poles[column].imag / (2 * np.pi))
                found.append(StabilityLimit(branch, first.speed, freq, True))
        for branch, state, column in self.crossings(growth):
            before = self.before(branch, state.speed)
            freq = float(state.poles[column].imag / (2 * np.pi))
            found.append(StabilityLimit(branch, state.speed, freq, growth(*before) < 0))
        return tuple(sorted(found, key=lambda limit: limit.speed))

    def before(self, branch: int, speed: float) -> tuple[State, int]:
        """The last state of the walk below a speed that has the branch."""
        at = [i for i, s in enumerate(self.walk.states) if s.speed < speed and self.walk.columns[i][branch] >= 0]
        return self.walk.states[at[-1]], int(self.walk.columns[at[-1]][branch])

    def crossings(self, value: Callable[[State, int], float]) -> list[tuple[int, State, int]]:
        """Branch, state and column at every change of sign of `value` between neighbouring states."""
        out = []
        states, columns = self.walk.states, self.walk.columns
        for i in range(len(states) - 1):
            for branch in range(columns[0].size):
                a, b = int(columns[i][branch]), int(columns[i + 1][branch])
                if a < 0 or b < 0 or (states[i].poles[a] == 0 and states[i + 1].poles[b] == 0):
                    continue
                left, right = value(states[i], a), value(states[i + 1], b)
                if left != 0 and left * right <= 0:
                    out.append((branch, *self.root(value, (states[i], a, left), (states[i + 1], b, right))))
        return out

    def root(
        self, value: Callable[[State, int], float], left: tuple[State, int, float], right: tuple[State, int, float]
    ) -> tuple[State, int]:
        """Bracketed root by the rule of Illinois, the branch followed from the nearer end."""
        side = 0
        for _ in range(60):
            (a, _, fa), (b, _, fb) = left, right
            if fb == 0 or b.speed - a.speed <= ROOT * abs(b.speed):
                break
            speed = (a.speed * fb - b.speed * fa) / (fb - fa)
            speed = min(max(speed, a.speed + 1e-12 * b.speed), b.speed - 1e-12 * b.speed)
            near = left if speed - a.speed < b.speed - speed else right
            state = State.of(self.system, self.solver.raw(speed), speed)
            column = int(follow(near[0], state)[1][near[1]])
            if column < 0:
                break
            f = value(state, column)
            if abs(f) <= ROOT * abs(state.poles[column]):
                return state, column
            kept = 0.5 if side == (1 if f * fa > 0 else -1) else 1.0
            if f * fa > 0:
                left, right, side = (state, column, f), (right[0], right[1], kept * right[2]), 1
            else:
                left, right, side = (left[0], left[1], kept * left[2]), (state, column, f), -1
        return right[0], right[1]
