"""Campbell diagram: modes followed over the speed, their whirl, critical speeds and limits of stability."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.analysis.complex_modes import ComplexSolver
from femend.analysis.crossings import DEPTH, SURE, Finder, Walk
from femend.analysis.follow import State, follow
from femend.analysis.turning import TurningSystem, as_turning_system
from femend.analysis.whirl import WhirlMeter
from femend.data.campbell import Campbell
from femend.dof import Dof
from femend.errors import ConvergenceError, ModelError, TooFewModesError
from femend.model import Model
from femend.model.terms.spinning import SpinningPart
from femend.numerals import listed, plain

__all__ = ["campbell"]

GUARD = 0.5  # modes beyond the wanted ones, as a share, so that branches may change places
BESIDE_REST = 1e-3  # share of the second speed at which branches begin where the first is 0
FAR = 0.5  # share by which a pole cannot change between rest and the beginning of a branch
LIKE = 0.1  # bi-orthogonality below which, at the smallest step, a branch is lost


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
    followed; fewer where no more oscillate or can be told, which `notes` of what is returned says.

    `system`, `parts`, `preload`, `factors` and `tolerance` as in `complex_modes`. Modes of neighbouring speeds are
    paired by bi-orthogonality, |y_i^T ((p_i + p_j) M + C + W G) psi_j| / |modal a|, with an assignment over all of
    them; where the pairing is not clear the step is halved, and a branch that is lost is told in `notes`. Whirl is told
    forward or backward by the orbits of the parts. Critical speeds are where the damped frequency is an order of
    `orders` times the speed; they and the limits of stability are solved for at the very speed by bracketed root
    finding, critical speeds on the j-th lowest frequency, which is continuous whatever mode it belongs to. One
    factorisation and one space serve all speeds.

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
    spectrum = _Spectrum(system, n_modes, f_max, tolerance, _beginning(speed), float(speed[-1]))
    walk = _walked(spectrum, speed, f_max)
    return _told(system, spectrum, walk, tuple(float(o) for o in orders))


def _beginning(speeds: NDArray[np.float64]) -> float:
    """The speed at which branches begin: at rest planes of equal stiffness mix at will, a little later they are told
    apart."""
    return float(speeds[0]) if speeds[0] != 0 else BESIDE_REST * float(speeds[1])


class _Spectrum:
    """Modes at any speed, `wanted` ones (None: all up to `f_max` in Hz) and some beyond, as many as there are.

    The space begins at the speed `top`; `notes` tells why fewer than `n_modes` are wanted, those there are at the
    speed `first`.
    """

    def __init__(
        self,
        system: TurningSystem,
        n_modes: int | None,
        f_max: float | None,
        tolerance: float,
        first: float,
        top: float,
    ) -> None:
        self.system, self.wanted = system, n_modes
        self.notes: list[str] = []
        self._tolerance, self._f_max = tolerance, None if f_max is None else (1 + GUARD) * f_max
        self._solvers: dict[int | None, ComplexSolver] = {}
        self._known: dict[float, State] = {}
        self._n = None if n_modes is None else n_modes + max(4, int(GUARD * n_modes))
        self._try(first, top)

    def at(self, speed: float) -> State:
        """The modes at a `speed` in rad/s. Raises ConvergenceError, and ModelError where none oscillates."""
        if speed not in self._known:
            try:
                found = self._solver(self._n).raw(speed)
            except TooFewModesError as error:
                # more are overdamped here than where the branches begin
                found = self._solver(_some(error.available, error)).raw(speed)
            self._known[speed] = State.of(self.system, found, speed)
        return self._known[speed]

    def _solver(self, n: int | None) -> ComplexSolver:
        if n not in self._solvers:
            self._solvers[n] = ComplexSolver(self.system, n_modes=n, f_max=self._f_max, tolerance=self._tolerance)
        return self._solvers[n]

    def _try(self, first: float, top: float) -> None:
        """Settles how many modes are computed: as many as there are where branches begin, and as converge."""
        asked = self.wanted
        for _ in range(4):
            try:
                self.at(top)
                found = self._solver(self._n).raw(first)
            except (TooFewModesError, ConvergenceError) as error:
                if self._n is None or asked is None:
                    raise
                if isinstance(error, ConvergenceError):
                    # those beyond the wanted ones may be left out
                    n = asked if self._n > asked else error.converged or 0
                    if n == 0:
                        raise
                    why = "the frequencies of those beyond lie too far apart for what rounding leaves"
                else:
                    n = _some(error.available, error)
                    massless = n == int(np.count_nonzero(abs(self.system.M).sum(axis=0)))
                    why = "no more DOFs have a mass" if massless else f"no more oscillate at {_rpm(first)} 1/min"
                self._n = n
                self._known.clear()
                if n < asked:
                    self.wanted = n
                    self.notes = [f"only {n} mode{'s' * (n > 1)}: {why}"]
            else:
                self._known[first] = State.of(self.system, found, first)
                return
        raise ConvergenceError(
            f"of {asked} modes asked for not even the lowest {self._n} can be followed up to {_rpm(top)} 1/min; ask "
            "for fewer modes, or for lower speeds"
        )


def _some(available: int, error: TooFewModesError) -> int:
    """How many modes are `available`. Raises ModelError where there is none."""
    if available == 0:
        raise ModelError(
            "no mode of the model oscillates: give the materials a density (RHO of MAT1) or add masses (CONM2), and "
            "look for dashpots that are too strong"
        ) from error
    return available


def _rpm(speed: float) -> str:
    return plain(speed * 30 / np.pi)


def _walked(spectrum: _Spectrum, speeds: NDArray[np.float64], f_max: float | None) -> Walk:
    """Branches of the modes at the first speed, through all speeds."""
    state = spectrum.at(_beginning(speeds))
    wanted = state.poles.size if spectrum.wanted is None else min(spectrum.wanted, state.poles.size)
    if f_max is not None:
        wanted = min(wanted, int(np.sum(np.abs(state.poles) <= 2 * np.pi * f_max)))
    columns = np.arange(wanted)
    walk = Walk([state], [columns], [np.ones(wanted)], [state.speed == speeds[0]])
    for target in speeds[1:]:
        _step(walk, spectrum.at, float(target), DEPTH, True)
    if speeds[0] == 0:
        rest = spectrum.at(0.0)
        _, order = follow(state, rest, by_pole=True)
        walk.states.insert(0, rest)
        # what is overdamped or rigid at rest has no pole there that is anywhere near
        there = (np.abs(rest.poles[order] - state.poles) <= FAR * np.abs(state.poles)) | (rest.poles[order] == 0)
        walk.columns.insert(0, np.where((order >= 0) & there, order, -1)[columns])
        walk.sure.insert(0, np.ones(wanted))
        walk.asked.insert(0, True)
    return walk


def _step(walk: Walk, at: Callable[[float], State], target: float, depth: int, asked: bool) -> None:
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
    walk.columns.append(np.where(here & (np.nan_to_num(sure) > LIKE), order[columns], -1))
    walk.sure.append(sure)
    walk.asked.append(asked)


def _told(system: TurningSystem, spectrum: _Spectrum, walk: Walk, orders: tuple[float, ...]) -> Campbell:
    """The table of branches, with what is found between its rows."""
    meter = WhirlMeter(system)
    shape = (len(walk.states), walk.columns[0].size)
    poles = np.full(shape, np.nan + 1j * np.nan)
    whirl, residual = np.full(shape, np.nan), np.full(shape, np.nan)
    for i, (state, columns) in enumerate(zip(walk.states, walk.columns, strict=True)):
        here = columns >= 0
        poles[i, here] = state.poles[columns[here]]
        residual[i, here] = state.residual[columns[here]]
        whirl[i, here] = meter.of(state.right, state.poles)[columns[here]]
    finder = Finder(spectrum.at, meter, walk)
    critical, limits = finder.critical(orders), finder.limits()
    notes = (*spectrum.notes, *_lost(walk), *_others(finder.others, shape[1]))
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
        notes,
    )


def _lost(walk: Walk) -> list[str]:
    """Branches that are not there at every speed, and from which on."""
    at_rest = [str(branch + 1) for branch in np.flatnonzero(walk.columns[0] < 0)]
    told = []
    if at_rest:
        who = f"modes {listed(at_rest, 12)} do" if len(at_rest) > 1 else f"mode {at_rest[0]} does"
        told.append(f"{who} not oscillate at {_rpm(walk.states[0].speed)} 1/min, but beyond")
    first: dict[str, list[str]] = {}
    for branch in range(walk.columns[0].size):
        gone = [s.speed for s, columns in zip(walk.states[1:], walk.columns[1:], strict=True) if columns[branch] < 0]
        if gone:
            first.setdefault(_rpm(gone[0]), []).append(str(branch + 1))
    return told + [
        f"{'modes' if len(some) > 1 else 'mode'} {listed(some, 12)} lost from {speed} 1/min on: no mode there is "
        "clearly the same, or it became overdamped, and critical speeds beyond are not told; give more speeds before "
        "it, or ask for more modes"
        for speed, some in first.items()
    ]


def _others(speeds: list[float], followed: int) -> list[str]:
    """Critical speeds of modes beyond those followed."""
    told = sorted({_rpm(s) for s in speeds}, key=float)
    if not told:
        return []
    return [f"modes beyond the {followed} followed are critical, too, at {listed(told, 6)} 1/min; ask for more modes"]
