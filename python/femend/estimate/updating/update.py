"""Updating: a bounded Gauss-Newton search in a trust region, modes paired anew at every point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ArgumentError, FemendError, UpdatingError
from femend.estimate.updating.contradicted import Way, better_way
from femend.estimate.updating.history import Iteration, point, read_history, write_history
from femend.estimate.updating.lost_modes import CONTRADICTED, Flags, Times, back_again, last_paired, lost, modes_of
from femend.estimate.updating.problem import Evaluation, Problem
from femend.estimate.updating.result import Status, UpdateResult
from femend.estimate.updating.step import best_step, root
from femend.estimate.updating.unknown import limits, spans
from femend.numerals import plain
from femend.threads import one_blas_thread

__all__ = ["update"]

FloatArray = NDArray[np.float64]

# usual constants of a trust region (Nocedal and Wright, Numerical Optimization, algorithm 4.1)
ACCEPT, POOR, GOOD = 1e-4, 0.25, 0.75
SMALLEST_RADIUS = 1e-8
# a promised decrease of the cost below which no step need be found: it moves no unknown by more than a hundredth of its
# deviation, and trial points of large models differ by as much from rounding
SETTLED = 1e-4


@dataclass
class _Search:
    """What changes during a search."""

    here: Evaluation
    active: Flags
    radius: float
    iterations: list[Iteration]
    let_go: Times


@one_blas_thread
def update(
    problem: Problem,
    start: ArrayLike | None = None,
    *,
    iterations: int = 60,
    tolerance: float = 1e-6,
    radius: float = 1.0,
    history: str | Path | None = None,
    resume: bool = False,
    stop: Callable[[Iteration], bool] | None = None,
    doubt: bool = True,
) -> UpdateResult:
    """Finds the unknowns of `problem` that make squares and prior together least, from `start` (n,) p or the prior
    mean.

    With finite priors this is the maximum a posteriori estimate with its Laplace covariance, with infinite ones
    weighted least squares. A step is the exact minimum of the linearised problem inside limits and a trust region that
    is a box of `radius` spans (`spans`); it is taken when it lowers the cost. After each the modes are paired anew, and
    measured modes that have found a mate join. Those that have none where the search ends are let go, which is noted,
    and it goes on from the last point at which they had one; a mode that has a mate again then counts once more
    (`lost_modes`). Where the data are not explained, the search is made again without modes whose shape is a doubtful
    mate's: a mode that all others contradict then is left out, which is noted (`contradicted`; not without `doubt`).
    The search ends when the linearised problem promises less than
    `tolerance`^2 of the cost or a step of less than `tolerance` spans ("converged", "at bound" with unknowns at their
    limits), when no step lowers the cost ("stalled") or after `iterations` (of each such search, "limit"; both are
    "converged" where less than 1e-4 is promised, a hundredth of the unknowns' deviations), or when `stop` of an
    iteration is True ("stopped").

    `history` is a file that keeps every iteration; with `resume` the search goes on from it where it exists. A point at
    which a model has no solution or no derivative is not taken, and noted; where none can be taken the search has
    stalled, keeps what it had and says why in its advice. Raises UpdatingError for fewer data than unknowns without
    prior, where no mode pairs, a start outside the limits, values that are no numbers or a history of another problem,
    and what the start's models raise.
    """
    if not isinstance(problem, Problem):
        raise ArgumentError.given("`update` takes a Problem(unknowns, (Configuration(...),))", problem)
    kept = read_history(history, problem) if resume and history is not None and Path(history).exists() else []
    run = _Run(iterations, tolerance, radius, None if history is None else Path(history), stop)
    if out := _left_out(kept):
        problem = replace(problem, left_out=problem.left_out | out)
    found = run.searched(problem, start, kept)
    begun = problem.unknowns.mean if start is None else np.asarray(start, dtype=np.float64)
    begun = point(kept[0]) if kept else begun
    while doubt and found.status != "stopped":
        way = better_way(found, begun, run.searched)
        if run.stopped:
            found = replace(found, status="stopped")
        if way is None or run.stopped:
            break
        found = _went(found, way)
    if run.history is not None:
        write_history(run.history, found.problem, list(found.history), found.status)
    return found


@dataclass
class _Run:
    """How searches are made, and whether one of them was `stopped`."""

    iterations: int
    tolerance: float
    radius: float
    history: Path | None
    stop: Callable[[Iteration], bool] | None
    stopped: bool = False
    # the file keeps the first search; those without a mode are kept where they were right
    begun: bool = False

    def searched(self, problem: Problem, start: ArrayLike | None, kept: Sequence[Iteration] = ()) -> UpdateResult:
        """One search of `problem` from `start` (n,), or on from what was `kept`."""
        history, self.begun = (None if self.begun else self.history), True
        lower, upper = limits(problem.unknowns)
        search = _begin(problem, start, list(kept), self.radius, lower, upper)
        first = search.here if not kept else problem.evaluate(kept[0].p, active=search.active)
        _enough(problem, search.here)
        scale = spans(problem.unknowns)
        if history is not None:
            write_history(history, problem, search.iterations, "running")
        status: Status = "limit"
        left = self.iterations
        while left > 0:
            left -= 1
            done = _advance(problem, search, lower, upper, scale, self.tolerance)
            if done is not None:
                if not _other_modes(problem, search, self.radius):
                    status = done
                    break
                left = self.iterations
            if history is not None:
                write_history(history, problem, search.iterations, "running")
            if self.stopped or (self.stop is not None and self.stop(search.iterations[-1])):
                status, self.stopped = "stopped", True
                break
        if status == "limit" and _settled(problem, search.here, lower, upper, scale):
            status = "converged"  # it crept along what the responses do not tell
        at = _at_bound(search.here.p, lower, upper, scale)
        if status == "converged" and at.any():
            status = "at bound"
        return UpdateResult(problem, first, search.here, status, at, tuple(search.iterations))


def _left_out(kept: Sequence[Iteration]) -> frozenset[tuple[int, int]]:
    """Modes that all others contradict where a search that was `kept` ended."""
    times = kept[-1].let_go if kept else ()
    return frozenset((c, i) for c, own in enumerate(times) for i, n in enumerate(own) if n == CONTRADICTED)


def _went(found: UpdateResult, way: Way) -> UpdateResult:
    """The search that led a better `way` than that of `found`, with the steps of both."""
    end = way.result
    begun = replace(end.history[0], notes=(*end.history[0].notes, _told(found.problem, way)))
    return replace(end, history=(*found.history, begun, *end.history[1:]))


def _told(problem: Problem, way: Way) -> str:
    """Why a search was made again from here."""
    if way.out is None:
        return "from here on a mode counts again that had led the search astray"
    configuration = problem.configurations[way.out.configuration]
    assert configuration.test is not None
    return (
        f"{configuration.name}: test mode {configuration.test.numbers[way.out.mode]} (MAC {plain(way.out.mac, 3)}) is "
        f"{plain(way.out.off, 2)} deviations off what explains all others: left out, from the start on"
    )


def _begin(
    problem: Problem,
    start: ArrayLike | None,
    kept: list[Iteration],
    radius: float,
    lower: FloatArray,
    upper: FloatArray,
) -> _Search:
    p = problem.unknowns.mean.copy() if start is None else np.asarray(start, dtype=np.float64).copy()
    if kept:
        p, radius = point(kept[-1]), kept[-1].radius
    if p.shape != (len(problem.unknowns),):
        raise UpdatingError(f"the start has shape {p.shape}, there are {len(problem.unknowns)} unknowns")
    if not (np.all(p >= lower - 1e-12) and np.all(p <= upper + 1e-12)):
        i = int(np.flatnonzero(~((p >= lower - 1e-12) & (p <= upper + 1e-12)))[0])
        u = problem.unknowns.items[i]
        raise UpdatingError(f"the start of {u.name!r} is {u.value(p[i]):g}, outside its bounds {u.bounds}")
    states = problem.states(p)
    active = problem.active(states)
    let_go: Times = tuple(None if a is None else np.zeros(a.size, dtype=np.int64) for a in active)
    for c, mode in problem.left_out:
        times = let_go[c]
        if times is not None:
            times[mode] = CONTRADICTED
    if kept:
        active = tuple(
            None if a is None else np.asarray(m) >= 0
            for a, m in zip(active, _kept(kept[-1].mates, active), strict=True)
        )
        if kept[-1].let_go:
            let_go = tuple(
                None if a is None else np.array(n, dtype=np.int64)
                for a, n in zip(active, _kept(kept[-1].let_go, active), strict=True)
            )
    here = problem.evaluate(p, slopes=True, active=active, states=states)
    search = _Search(here, active, radius, list(kept), let_go)
    if not kept:
        search.iterations.append(_iteration(search, ()))
    return search


def _kept(of_modes: tuple[tuple[int, ...], ...], active: Flags) -> list[tuple[int, ...]]:
    """What was kept `of_modes` by configuration, with nothing for configurations without modes."""
    return [m if a is not None else () for m, a in zip(of_modes, active, strict=True)]


def _iteration(search: _Search, notes: tuple[str, ...]) -> Iteration:
    here = search.here
    mates = tuple(() if m is None else tuple(int(i) for i in m.mate) for m in here.mates)
    mac = tuple(() if m is None else tuple(float(x) for x in m.mac) for m in here.mates)
    times = tuple(() if n is None else tuple(n.tolist()) for n in search.let_go)
    p = tuple(float(x) for x in here.p)
    return Iteration(p, here.cost, here.squares, search.radius, mates, notes, mac, times)


def _enough(problem: Problem, here: Evaluation) -> None:
    informed = int(np.linalg.matrix_rank(problem.unknowns.precision))
    n = len(problem.unknowns)
    if here.n_values + informed < n:
        raise UpdatingError(
            f"{here.n_values} paired values and {informed} priors for {n} unknowns: give priors (a finite sd), "
            "fewer unknowns or more responses"
        )


def _advance(
    problem: Problem, search: _Search, lower: FloatArray, upper: FloatArray, scale: FloatArray, tolerance: float
) -> Status | None:
    """One accepted step; a status where there is none to take."""
    here = search.here
    residual, jacobian = _with_priors(problem, here)
    notes: list[str] = []
    while search.radius > SMALLEST_RADIUS:
        box = search.radius * scale
        step, promised = best_step(
            residual, jacobian, np.maximum(lower - here.p, -box), np.minimum(upper - here.p, box), scale
        )
        length = float(np.abs(step / scale).max())
        # a step that only the trust region keeps short is no sign of a minimum
        if promised <= tolerance**2 * here.cost or length <= min(tolerance, 0.99 * search.radius):
            return "converged"
        p = np.clip(here.p + step, lower, upper)
        try:
            trial = problem.evaluate(p, active=search.active)
        except (FemendError, ArithmeticError) as error:
            notes.append(f"no result at a trial point: {error}")
            search.radius = 0.25 * length
            continue
        ratio = (here.cost - trial.cost) / promised
        if ratio < POOR:
            search.radius = 0.25 * length
        elif ratio > GOOD and length > 0.99 * search.radius:
            search.radius *= 2.0
        if ratio > ACCEPT:
            try:
                _accept(problem, search, trial, notes)
            except (FemendError, ArithmeticError) as error:
                notes.append(f"no derivative at a trial point: {error}")
                search.radius = 0.25 * length
                continue
            return None
    # a minimum beside which costs are rounding, or where modes part, lets no step pass either
    if not notes and _settled(problem, here, lower, upper, scale):
        return "converged"
    # what stood in the way would be lost with the step that was not taken
    last = search.iterations[-1]
    search.iterations[-1] = replace(last, notes=(*last.notes, *dict.fromkeys(notes)))
    return "stalled"


def _with_priors(problem: Problem, here: Evaluation) -> tuple[FloatArray, FloatArray]:
    """Residual (n_values + n,) and derivatives by the unknowns (n_values + n, n), with those of the priors."""
    R = root(problem.unknowns.precision)
    assert here.jacobian is not None
    residual = np.concatenate([here.residual, R @ (here.p - problem.unknowns.mean)])
    return residual, np.vstack([here.jacobian, R])


def _settled(problem: Problem, here: Evaluation, lower: FloatArray, upper: FloatArray, scale: FloatArray) -> bool:
    """Whether the best step inside the limits promises less than `SETTLED`."""
    residual, jacobian = _with_priors(problem, here)
    return bool(best_step(residual, jacobian, lower - here.p, upper - here.p, scale)[1] <= SETTLED)


def _accept(problem: Problem, search: _Search, trial: Evaluation, notes: list[str]) -> None:
    """Takes a point: measured modes that have found a mate join, changed pairs are noted."""
    paired = zip(search.active, problem.active(trial.states), search.let_go, strict=True)
    # those that were let go are looked at where the search ends
    joined: Flags = tuple(
        None if old is None or new is None or n is None else old | (new & (n == 0)) for old, new, n in paired
    )
    before, old = search.here.mates, search.active
    there = problem.evaluate(trial.p, slopes=True, active=joined, states=trial.states)
    search.here, search.active = there, joined
    newly: Flags = tuple(None if j is None or o is None else j & ~o for j, o in zip(joined, old, strict=True))
    notes += [f"{text} found a mate" for text in modes_of(problem.configurations, newly, there)]
    for c, old_pairs, new_pairs in zip(problem.configurations, before, search.here.mates, strict=True):
        if c.test is None or old_pairs is None or new_pairs is None:
            continue
        changed = np.flatnonzero((old_pairs.mate != new_pairs.mate) & (old_pairs.mate >= 0))
        notes += [
            f"{c.name}: test mode {c.test.numbers[i]} paired with model mode {new_pairs.mate[i] + 1}, before with "
            f"{old_pairs.mate[i] + 1}"
            for i in changed
        ]
    search.iterations.append(_iteration(search, tuple(notes)))


def _other_modes(problem: Problem, search: _Search, radius: float) -> bool:
    """Lets modes without a mate go where a search has ended, and takes those back that have one again; False where
    there are none, or too few were left. The search begins anew, with steps of `radius`."""
    gone = lost(search.here, problem.mac_min)
    leaving = any(m is not None and m.any() for m in gone)
    back = gone if leaving else back_again(search.here, search.active, search.let_go, problem.mac_min)
    if not any(m is not None and m.any() for m in back):
        return False
    active: Flags = tuple(None if a is None or m is None else a ^ m for a, m in zip(search.active, back, strict=True))
    who = "; ".join(modes_of(problem.configurations, back, search.here, with_mac=True))
    p, note = search.here.p, f"{who} found a mate again"
    if leaving:
        at = last_paired(search.iterations, gone, problem.mac_min)
        where = "from here on" if at is None else f"from step {at} on"
        p = p if at is None else point(search.iterations[at])
        note = f"{who} had no mate where the search ended: let go, {where}"
    try:
        here = problem.evaluate(p, slopes=True, active=active)
        _enough(problem, here)
    except (FemendError, ArithmeticError):
        return False
    if leaving:
        search.let_go = tuple(
            None if n is None or m is None else n + m.astype(np.int64) for n, m in zip(search.let_go, gone, strict=True)
        )
    search.here, search.active, search.radius = here, active, radius
    search.iterations.append(_iteration(search, (note,)))
    return True


def _at_bound(p: FloatArray, lower: FloatArray, upper: FloatArray, scale: FloatArray) -> NDArray[np.bool_]:
    return np.asarray((p - lower <= 1e-9 * scale) | (upper - p <= 1e-9 * scale))
