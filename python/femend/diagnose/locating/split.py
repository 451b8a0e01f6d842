"""Which recordings estimate, and which choose between laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.held_back import HeldBack, before, hold_back, since
from femend.diagnose.locating.locate import Located
from femend.estimate import Fit, FitRecord, Problem

__all__ = ["Split", "split_by", "split_records", "weaker_first"]

FloatArray = NDArray[np.float64]

# lines a record while laws are compared; the chosen one is fitted on all
NAMING_LINES = 400
# share of what a recording shows most of: below the first a recording shows nothing, from the second on as much
SILENT, TELLING = 0.1, 0.5


@dataclass(frozen=True, eq=False)
class Split:
    """The fit recordings apart: `fitting` for estimates, `choosing` for the choice between laws, `whole` both; `held`
    is what is held back of a single one."""

    whole: Problem
    fitting: Problem
    choosing: Problem
    held: HeldBack | None = None

    def of(self, problem: Problem) -> Split:
        """The same split of the same recordings in another problem (with other noise, say)."""
        if self.held is not None:
            return _of_one(problem, self.held)
        problem = problem.sparing(NAMING_LINES)
        named = {r.name: r for r in problem.records}
        fitting, choosing = (
            problem.on([named[r.name] for r in part.records]) for part in (self.fitting, self.choosing)
        )
        return Split(problem, fitting, choosing)

    def changed(self, change: Callable[[FitRecord], FitRecord]) -> Split:
        """The same split of records that `change` makes of these, each once."""
        made: dict[int, FitRecord] = {}

        def part(problem: Problem) -> Problem:
            for r in problem.records:
                if id(r) not in made:
                    made[id(r)] = change(r)
            return problem.on([made[id(r)] for r in problem.records])

        whole = part(self.whole)
        if self.fitting is self.whole:
            return Split(whole, whole, whole, self.held)
        return Split(whole, part(self.fitting), part(self.choosing), self.held)

    @property
    def reading(self) -> Problem:
        """The records that what a place did is read off, for laws to start from: fits, which start there, end on
        `fitting`. A part of a record is too little to tell starts by."""
        return self.fitting if self.held is None else self.whole

    @property
    def unseen(self) -> list[FitRecord]:
        """Recordings that choose and that no law is fitted to, or those of which a part is so."""
        fitted = {r.name for r in self.fitting.records}
        return [r for r in self.choosing.records if r.start > 0 or r.name not in fitted]

    def told(self, sigma: float = 0.0) -> str:
        """On what laws that were compared in a window exp(-sigma t) were chosen where there is a single recording;
        nothing where a whole one chooses."""
        if self.held is None or self.held.cut == 0 or sigma == 0:
            return "" if self.held is None else self.held.text
        return (
            f"laws were chosen on the beginning of recording {self.held.name!r}, which they were fitted to as well, "
            "since they cannot be followed further; record another"
        )


def split_records(problem: Problem, null: Fit | None = None, located: Sequence[Located] = ()) -> Split:
    """Keeps the record of middle level for choosing.

    A law that acts at high level alone (a stop that is reached, a stiffness that grows) leaves no trace there. Where
    the middle record hardly shows what a free force at the best place takes away from the updated model `null`, the
    lowest one that shows it is kept instead; if one alone does (the highest, or the one that was struck elsewhere), it
    is fitted and chooses too, beside the middle one of the others that the law has to leave as it is. Of a single
    record a part is held back, where it is long enough.
    """
    problem = problem.sparing(NAMING_LINES)
    records = problem.records
    if len(records) < 2:
        return _of_one(problem, hold_back(problem))
    drops = np.zeros(len(records)) if null is None or not located else _drops(null, located[0].fit, records)
    return split_by(problem, drops)


def split_by(problem: Problem, drops: FloatArray) -> Split:
    """Keeps of several records the one of middle level for choosing, or one that shows what is to be chosen: `drops`
    (n_records,) says how much of that is in each."""
    records = problem.records
    order = [int(i) for i in np.argsort([r.level for r in records])]
    middle = _middle(order)
    choosing, kept = [middle], middle
    telling = [i for i in order if drops[i] >= TELLING * drops.max()]
    if drops[middle] < SILENT * drops.max():
        choosing, kept = (telling[:1], telling[0]) if len(telling) > 1 else ([middle, *telling], middle)
    elif max(drops[i] for i in order if i != middle) < SILENT * drops.max():
        # a law fitted to the others would be fitted to nothing
        kept = _middle([i for i in order if i != middle])
        choosing = [kept, middle]
    fitted = [i for i in order if i != kept]

    def part(chosen: list[int]) -> Problem:
        return problem.on([r for i, r in enumerate(records) if i in chosen])

    return Split(problem, part(fitted), part(choosing))


def _middle(order: Sequence[int]) -> int:
    """The one of middle level of several in rising order of it, the lower one of two."""
    return order[(len(order) - 1) // 2 if len(order) < 3 else len(order) // 2]


def weaker_first(split: Split) -> Split | None:
    """The split in which the strongest recording chooses and the weaker ones are fitted; None where that is so already,
    or where there is a single one."""
    if split.held is not None or len(split.whole.records) < 2:
        return None
    strongest = max(split.whole.records, key=lambda r: r.level)
    if [r.name for r in split.choosing.records] == [strongest.name]:
        return None
    weaker = [r for r in split.whole.records if r is not strongest]
    return Split(split.whole, split.whole.on(weaker), split.whole.on([strongest]))


def _of_one(problem: Problem, held: HeldBack) -> Split:
    """The split of a problem with a single record."""
    problem = problem.sparing(NAMING_LINES)
    if held.cut == 0:
        return Split(problem, problem, problem, held)
    early, late = (problem.on([part(r, held.cut) for r in problem.records]) for part in (before, since))
    return Split(problem, early, late, held)


def _drops(null: Fit, free: Fit, records: Sequence[FitRecord]) -> FloatArray:
    """Weighted squares (n_records,) that a free force takes away from the updated model in each record."""
    sizes = np.array([r.y.size for r in records])
    return np.maximum(np.asarray(null.misfit) - np.asarray(free.misfit), 0.0) * sizes
