"""Many starts: which minima there are, how often each is reached, and the best of them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from threading import Event

import numpy as np
from numpy.typing import NDArray

from femend.errors import FemendError, UpdatingError
from femend.estimate.updating.design import design
from femend.estimate.updating.lost_modes import EXPLAINED
from femend.estimate.updating.problem import Problem
from femend.estimate.updating.result import UpdateResult
from femend.estimate.updating.unknown import spans
from femend.estimate.updating.update import update
from femend.numerals import plain
from femend.threads import one_blas_thread

__all__ = ["Minimum", "MultiStart", "StartsInterrupted", "multi_start"]

FloatArray = NDArray[np.float64]
# ends closer than this in spans are one minimum
SAME = 1e-2
# minima that are shown
SHOWN = 5


@dataclass(frozen=True, eq=False)
class Minimum:
    """A minimum: the run that tells of it, and the numbers of the `starts` that end there."""

    result: UpdateResult
    starts: tuple[int, ...]


@dataclass(frozen=True, eq=False, repr=False)
class MultiStart:
    """`minima`, best first; `ends` (n_starts, n_unknowns) p of every start (NaN where it failed), `cost` (n_starts,);
    `failures` in words by number of the start."""

    starts: FloatArray
    ends: FloatArray
    cost: FloatArray
    minima: tuple[Minimum, ...]
    failures: dict[int, str]

    @property
    def best(self) -> UpdateResult:
        """The run of the lowest cost."""
        return self.minima[0].result

    def __repr__(self) -> str:
        lines = [f"{len(self.starts)} starts, {len(self.minima)} minima, {len(self.failures)} failed"]
        for k, minimum in enumerate(self.minima[:SHOWN], 1):
            lines.append(
                f"minimum {k}: cost {plain(minimum.result.after.cost)}, {len(minimum.starts)} starts end there"
            )
        return "\n".join([*lines, "", repr(self.best)] if self.minima else lines)


@one_blas_thread
def multi_start(
    problem: Problem,
    n: int = 20,
    *,
    starts: FloatArray | None = None,
    small: Problem | None = None,
    n_polished: int = 5,
    seed: int = 0,
    iterations: int = 60,
    tolerance: float = 1e-6,
    workers: int = 1,
    told: Callable[[], None] | None = None,
) -> MultiStart:
    """Updates `problem` from `n` points between the bounds (a Latin hypercube of `seed`), or from `starts` (n,
    n_unknowns).

    With `small`, the same problem in reduced models (`reduced_problem`), the searches are made there, and only the best
    `n_polished` different minima are gone on from in `problem`: every end is moved along with its minimum. `iterations`
    and `tolerance` are those of `update`, `workers` the number of threads. `told` is called when a start is done. A
    start that fails is told of, the others go on. Raises UpdatingError where all fail. Stopped by hand
    (KeyboardInterrupt) once a start is done, it raises StartsInterrupted with those that are, and goes on with the best
    of them alone in `problem` first.

    Each start is followed with modes paired in the order of frequency, then by shape. Where that does not explain the
    data (squares above `EXPLAINED` a value) it is followed with modes paired by shape alone as well, and the better end
    taken: modes that change places lead the first way astray, shapes that are far from their own the second. All count
    the same modes: which of them the others contradict, `update` from the best end tells.
    """
    if starts is None and n < 1:
        raise UpdatingError(f"{n} starts are asked for; take one or more")
    points = design(problem.unknowns, n, seed=seed) if starts is None else np.asarray(starts, dtype=np.float64)
    search = _Search(problem if small is None else small, iterations, tolerance)
    stopped = _searched(search, points, workers, told)
    done = sorted(search.done)
    if stopped and not any(isinstance(search.done[i], UpdateResult) for i in done):
        raise stopped
    found = [(k, search.done[i]) for k, i in enumerate(done)]
    polished = 0 if small is None else 1 if stopped else n_polished
    many, stopped_later = _collected(problem, points[done], found, small is not None, polished, search)
    if stopped or stopped_later:
        raise StartsInterrupted(many, len(points)) from (stopped or stopped_later)
    return many


class StartsInterrupted(KeyboardInterrupt):
    """Searches from many starts that were stopped by hand.

    Attributes: `found`, what the starts that were done gave, as if there had been no others; `asked`, the number of
    starts there were to be.
    """

    def __init__(self, found: MultiStart, asked: int) -> None:
        super().__init__(f"interrupted after {len(found.starts)} of {asked} starts; what these gave is in `found`")
        self.found = found
        self.asked = asked


@dataclass(frozen=True, eq=False)
class _Search:
    """How starts are followed in `problem`, what those that are `done` gave by number, and whether to `stop`."""

    problem: Problem
    iterations: int
    tolerance: float
    done: dict[int, UpdateResult | str] = field(default_factory=dict)
    stop: Event = field(default_factory=Event)

    def update(self, problem: Problem, p: FloatArray) -> UpdateResult:
        """One search, which ends with its step once it is to stop: whoever waits for it has gone."""
        return update(
            problem,
            p,
            iterations=self.iterations,
            tolerance=self.tolerance,
            stop=lambda _: self.stop.is_set(),
            # starts are compared on the same modes
            doubt=False,
        )


def _searched(
    search: _Search, points: FloatArray, workers: int, told: Callable[[], None] | None
) -> KeyboardInterrupt | None:
    """Follows all `points`; gives the interruption where it was stopped by hand."""

    def one(start: tuple[int, FloatArray]) -> None:
        if search.stop.is_set():
            return
        end = _follow(search, start[1])
        if not search.stop.is_set():
            search.done[start[0]] = end
            if told is not None:
                try:
                    told()
                except KeyboardInterrupt:
                    # this thread takes its next start before the one that waits hears of it
                    search.stop.set()
                    raise

    with ThreadPoolExecutor(workers) as pool:
        try:
            list(pool.map(one, enumerate(points)))
        except KeyboardInterrupt as stopped:
            search.stop.set()
            return stopped
    return None


def _collected(
    problem: Problem,
    points: FloatArray,
    found: list[tuple[int, UpdateResult | str]],
    reduced: bool,
    n_polished: int,
    search: _Search,
) -> tuple[MultiStart, KeyboardInterrupt | None]:
    """The minima of what was `found`, where that was in a `reduced` problem the best `n_polished` of them gone on from
    in `problem`, and the interruption where that was stopped by hand."""
    failures = {i: r for i, r in found if isinstance(r, str)}
    good = [(i, r) for i, r in found if isinstance(r, UpdateResult)]
    if not good:
        raise UpdatingError(f"none of {len(points)} starts gave a result; the first: {failures[0]}")
    ends, cost = np.full(points.shape, np.nan), np.full(len(points), np.inf)
    for i, r in good:
        ends[i], cost[i] = r.p, r.after.cost
    stopped: KeyboardInterrupt | None = None
    minima: list[Minimum] = []
    rest: list[Minimum] = []
    search.stop.clear()
    for k, (first, members) in enumerate(_grouped(good, spans(problem.unknowns))):
        if reduced and (stopped or k >= n_polished):
            # their costs are the small model's, so that they come last
            rest.append(Minimum(first, tuple(members)))
            continue
        result = first
        if reduced:
            try:
                then = search.update(problem, first.p)
            except FemendError as error:
                failures |= {i: str(error) for i in members}
                continue
            except KeyboardInterrupt as error:
                stopped = error
                rest.append(Minimum(first, tuple(members)))
                continue
            result = _joined(first, then, "from here on in the full model")
            for i in members:
                ends[i], cost[i] = result.p, result.after.cost
        minima.append(Minimum(result, tuple(members)))
    order = sorted(minima, key=lambda m: (len(m.result.unpaired()), m.result.after.cost))
    return MultiStart(points, ends, cost, (*order, *rest), failures), stopped


def _follow(search: _Search, p: FloatArray) -> UpdateResult | str:
    """The better end of the two ways from a start, or what went wrong."""
    problem = search.problem
    by_shape = any(
        c.test is not None and c.test.phi is not None and c.test.by == "shape" for c in problem.configurations
    )
    found: list[UpdateResult] = []
    trouble = ""
    for ways in ((problem.by_order(), problem), (problem,)) if by_shape else ((problem,),):
        try:
            result = search.update(ways[0], p)
            for way in ways[1:]:
                then = search.update(way, result.p)
                result = _joined(result, then, "from here on modes are paired by shape")
        except (FemendError, ArithmeticError) as error:
            trouble = str(error)
            continue
        found.append(result)
        if result.after.squares <= EXPLAINED * result.after.n_values and not result.unpaired():
            break
    # a search that lost modes on its way explains less, however little it costs
    return min(found, key=lambda r: (len(r.unpaired()), r.after.cost)) if found else trouble


def _joined(first: UpdateResult, then: UpdateResult, note: str) -> UpdateResult:
    """`then`, which began where `first` ended, with the steps of both; `note` says where the one becomes the other."""
    begun = replace(then.history[0], notes=(*first.history[-1].notes, note))
    return replace(then, before=first.before, history=(*first.history[:-1], begun, *then.history[1:]))


def _grouped(found: list[tuple[int, UpdateResult]], scale: FloatArray) -> list[tuple[UpdateResult, list[int]]]:
    """Runs that end at one place, best first: the best run of each and the numbers of all."""
    groups: list[tuple[UpdateResult, list[int]]] = []
    for i, r in sorted(found, key=lambda x: (len(x[1].unpaired()), x[1].after.cost)):
        for first, members in groups:
            if np.abs((r.p - first.p) / scale).max() < SAME:
                members.append(i)
                break
        else:
            groups.append((r, [i]))
    return groups
