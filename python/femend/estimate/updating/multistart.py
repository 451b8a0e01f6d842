"""Many starts: which minima there are, how often each is reached, and the best of them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.errors import FemendError, UpdatingError
from femend.estimate.updating.design import design
from femend.estimate.updating.problem import Problem
from femend.estimate.updating.result import UpdateResult
from femend.estimate.updating.unknown import spans
from femend.estimate.updating.update import update
from femend.threads import one_blas_thread

__all__ = ["Minimum", "MultiStart", "multi_start"]

FloatArray = NDArray[np.float64]
# ends closer than this in spans are one minimum
SAME = 1e-2
# squares a value: residuals of two deviations
EXPLAINED = 4.0


@dataclass(frozen=True, eq=False)
class Minimum:
    """A minimum: the run that tells of it, and the numbers of the `starts` that end there."""

    result: UpdateResult
    starts: tuple[int, ...]


@dataclass(frozen=True, eq=False)
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
    start that fails is told of, the others go on. Raises UpdatingError where all fail.

    Each start is followed with modes paired in the order of frequency, then by shape. Where that does not explain the
    data (squares above `EXPLAINED` a value) it is followed with modes paired by shape alone as well, and the better end
    taken: modes that change places lead the first way astray, shapes that are far from their own the second.
    """
    points = design(problem.unknowns, n, seed=seed) if starts is None else np.asarray(starts, dtype=np.float64)
    inner = problem if small is None else small

    def one(p: FloatArray) -> UpdateResult | str:
        end = _follow(inner, p, iterations, tolerance)
        if told is not None:
            told()
        return end

    with ThreadPoolExecutor(workers) as pool:
        found = list(enumerate(pool.map(one, points)))
    failures = {i: r for i, r in found if isinstance(r, str)}
    good = [(i, r) for i, r in found if isinstance(r, UpdateResult)]
    if not good:
        raise UpdatingError(f"none of {len(points)} starts gave a result; the first: {failures[0]}")
    ends, cost = np.full(points.shape, np.nan), np.full(len(points), np.inf)
    for i, r in good:
        ends[i], cost[i] = r.p, r.after.cost
    minima: list[Minimum] = []
    for k, (first, members) in enumerate(_grouped(good, spans(problem.unknowns))):
        result = first
        if small is not None and k < n_polished:
            try:
                then = update(problem, first.p, iterations=iterations, tolerance=tolerance)
            except FemendError as error:
                failures |= {i: str(error) for i in members}
                continue
            result = _joined(first, then, "from here on in the full model")
            for i in members:
                ends[i], cost[i] = result.p, result.after.cost
        minima.append(Minimum(result, tuple(members)))
    # minima that were not gone on from in the full model come last: their costs are the small model's
    done = minima if small is None else minima[:n_polished]
    order = sorted(done, key=lambda m: (len(m.result.unpaired()), m.result.after.cost))
    return MultiStart(points, ends, cost, (*order, *minima[len(done) :]), failures)


def _follow(problem: Problem, p: FloatArray, iterations: int, tolerance: float) -> UpdateResult | str:
    """The better end of the two ways from a start, or what went wrong."""
    by_shape = any(
        c.test is not None and c.test.phi is not None and c.test.by == "shape" for c in problem.configurations
    )
    found: list[UpdateResult] = []
    trouble = ""
    for ways in ((problem.by_order(), problem), (problem,)) if by_shape else ((problem,),):
        try:
            result = update(ways[0], p, iterations=iterations, tolerance=tolerance)
            for way in ways[1:]:
                then = update(way, result.p, iterations=iterations, tolerance=tolerance)
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
