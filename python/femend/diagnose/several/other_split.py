"""Other recordings to choose on, where what one law leaves shows in none of those that chose it.

A stop that is reached in the strongest recording alone leaves the weaker ones to what is missing beside it: a law that
explains these is chosen, and nothing says that it leaves most of the strongest. Which recordings choose was settled by
what a free force takes away before anything was named; what the best law leaves is known afterwards.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.split import Split, split_by
from femend.diagnose.naming.judge import Given, again, compared_in, judge_in, to_beat
from femend.diagnose.naming.ranked import told_simply
from femend.diagnose.naming.shares import score_of_noise
from femend.diagnose.several.pairs import Searched, updated
from femend.estimate import Fit

__all__ = ["chosen_where_it_shows", "judged_with"]

FloatArray = NDArray[np.float64]


def chosen_where_it_shows(first: Searched) -> Searched | None:
    """The search as it was, on whole recordings of which those choose in which it shows what the best law leaves; None
    where it shows in those that chose already, or where a single free force explains them all, so that the law was
    lost on the way and nothing stands beside it."""
    settings, split = first.settings, first.split
    if split.held is not None or not first.ranked or not first.located or first.one_force_explains:
        return None
    left = _left_in_each(first)
    chose = {r.name for r in split.choosing.records}
    if any(left[name] > settings.adequate for name in chose) or max(left.values()) <= settings.far:
        return None
    null = updated(first)
    if null is None:
        return None
    other = split_by(split.whole, np.array([(left[r.name] - 1) * r.y.size for r in split.whole.records]))
    return judged_with(first, _given(first, other, null.p), null, 0.0)


def _given(first: Searched, split: Split, p: FloatArray) -> Given:
    """What laws are tried on with another split of the recordings, the model's unknowns being `p` (n_p,)."""
    return Given(split, first.reduced, first.g_rows, p, first.settings)


def _left_in_each(first: Searched) -> dict[str, float]:
    """Misfit that the best law leaves in each whole recording, by its name."""
    split, best = first.split, first.ranked[0]
    left = {}
    for record in split.whole.records:
        alone = replace(split, choosing=split.whole.on([record]))
        judged = judge_in(_given(first, alone, best.candidate.p), 0.0).ranked(again(best), afresh=True)
        left[record.name] = judged.candidate.chosen
    return left


def judged_with(first: Searched, given: Given, null: Fit, sigma: float) -> Searched:
    """The search with laws compared as is `given`, in a window exp(-sigma t), against the updated model `null`."""
    alone = to_beat(given, null, sigma)
    ranked = told_simply(compared_in(given, first.ranked, sigma), first.settings)
    return replace(
        first, split=given.split, ranked=ranked, n_values=alone.n_values, null_score=alone.score,
        floor=score_of_noise(ranked, alone.n_values), sigma=sigma, in_window=partial(judged_with, first, given, null),
    )  # fmt: skip
