"""An update from more starts than the deck as it stands: other minima, and how sure the best of them is the best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femend.estimate.updating import (
    MultiStart,
    Problem,
    Reduction,
    StartsInterrupted,
    UpdateResult,
    design,
    multi_start,
    spans,
    update,
)
from femend.estimate.updating.multistart import SAME
from femend.numerals import plain
from femend.study.file.bench_settings import UpdatingSettings

__all__ = ["Starts", "search_from_starts"]

# costs nearer to each other than this are one: a tenth of a deviation of one value
NEAR = 0.01
# the minimum of the next higher cost explains the data too where it costs no more than this above the best: under equal
# curvature it has a share of exp(-CLOSE / 2), one in twenty
CLOSE = 6.0


@dataclass(frozen=True, eq=False)
class Starts:
    """Searches from many starts, the first of which is the deck as it stands: all of them (`many`), the one that is
    `taken`, the reduction they were made in (None: the models as they are), the number of the start, from 0, whose
    search was taken, and how many starts were `asked` for where it was stopped by hand (0: it was not)."""

    many: MultiStart
    taken: UpdateResult
    small: Reduction | None
    at_start: int = 0
    asked: int = 0

    @property
    def lacking(self) -> str:
        """What is missing since it was stopped by hand; "" where it was not."""
        done = len(self.many.starts)
        if not self.asked:
            return ""
        if done == self.asked:
            return "minima of the starts were not all gone on from in the full models"
        return f"only {done} of {self.asked} starts were followed to their end"

    @property
    def at(self) -> int | None:
        """The minimum that was taken, from 0; None where only the search from the deck found it."""
        scale = spans(self.taken.problem.unknowns)
        for i, m in enumerate(self.many.minima):
            if np.abs((m.result.p - self.taken.p) / scale).max() < SAME:
                return i
        return None

    @property
    def together(self) -> int:
        """How many starts end where the one that was taken does."""
        return 0 if self.at is None else len(self.many.minima[self.at].starts)

    def as_dict(self) -> dict[str, Any]:
        """What updating.json holds of them; starts and minima have numbers from 1, the first start is the deck."""
        at = self.at
        return {
            "starts": len(self.many.starts),
            "end_there": self.together,
            "taken": None if at is None else at + 1,
            "reduced_model_error": None if self.small is None else self.small.error,
            "minima": [
                {
                    "cost": m.result.after.cost,
                    "squares": m.result.after.squares,
                    "status": m.result.status,
                    "modes_without_mate": len(m.result.unpaired()),
                    "in_full_model": self.small is None or m.result.problem is not self.small.problem,
                    "starts": [i + 1 for i in sorted(m.starts)],
                    "parameters": m.result.values,
                }
                for m in self.many.minima
            ],
            "failures": {str(i + 1): text for i, text in sorted(self.many.failures.items())},
        }

    def warnings(self) -> list[str]:
        """Starts that gave no result."""
        n = len(self.many.starts)
        return [f"start {i + 1} of {n} gave no result: {text}" for i, text in sorted(self.many.failures.items())]

    def advice(self) -> list[str]:
        """Other minima that explain the data as well, and a minimum that no other start confirms."""
        said = []
        cost = self.taken.after.cost
        lost = len(self.taken.unpaired())
        rivals = [
            (i, m)
            for i, m in enumerate(self.many.minima)
            if i != self.at and len(m.result.unpaired()) <= lost and m.result.after.cost < cost + CLOSE
        ]
        for i, m in rivals[:3]:
            values = ", ".join(f"{n} {plain(v)}" for n, v in list(m.result.values.items())[:6])
            said.append(
                f"minimum {i + 1} explains the data nearly as well (cost {plain(m.result.after.cost)}, that taken "
                f"{plain(cost)}) with {values}: measure what tells them apart"
            )
        n = len(self.many.starts)
        if self.together <= 1 and n > 1:
            said.append(
                f"no other of {n} starts ends where the one that was taken does: there may be lower minima still, "
                "allow more starts"
            )
        return said


def search_from_starts(
    problem: Problem,
    first: UpdateResult,
    settings: UpdatingSettings,
    small: Reduction | None,
    told: Callable[[], None] | None = None,
) -> Starts:
    """Searches `problem` from the deck and from points of a Latin hypercube between the bounds, `settings.starts` in
    all; where one ends lower than `first`, the search from the deck, its end is taken.

    With `small` the searches are made in reduced models, and their different ends gone on from in the full ones. `told`
    is called when a start is done. Stopped by hand once one is, it gives those that are. Raises UpdatingError where all
    starts fail.
    """
    unknowns = problem.unknowns
    points = np.vstack([unknowns.mean, design(unknowns, settings.starts - 1, seed=settings.seed)])
    asked = 0
    try:
        many = multi_start(
            problem,
            starts=points,
            small=None if small is None else small.problem,
            iterations=settings.iterations,
            told=told,
        )
    except StartsInterrupted as stopped:
        many, asked = stopped.found, stopped.asked
    for minimum in many.minima[:1]:
        best = minimum.result
        if small is not None and best.problem is small.problem:
            break  # stopped before it was gone on from: its cost is no cost of the full models
        lost, before = len(best.unpaired()), len(first.unpaired())
        if lost < before or (lost == before and best.after.cost < first.after.cost - NEAR):
            # the starts count all modes alike; from this end on those are left out that all others contradict
            best = _doubted(problem, best, settings)
            # the run that tells of a minimum is that of the first of its starts
            return Starts(many, replace(best, before=first.before), small, minimum.starts[0], asked)
    return Starts(many, first, small, asked=asked)


def _doubted(problem: Problem, best: UpdateResult, settings: UpdatingSettings) -> UpdateResult:
    """The search that ended in `best`, gone on from where a mode leads that all others contradict."""
    again = update(problem, best.p, iterations=settings.iterations)
    if again.problem.left_out == problem.left_out:
        return best
    return replace(again, history=(*best.history, *again.history[1:]))
