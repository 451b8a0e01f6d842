"""What is missing: every law of the catalogue at the best places, judged on a record that no fit has seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.judge import Tried, again, compared_in, free_reference, judge_in
from femend.diagnose.laws_at import Opened, linear_at, nonlinear_at, on_springs, with_kin
from femend.diagnose.locate import Located, order
from femend.diagnose.ranked import Ranked, effective_values, score
from femend.diagnose.settings import Settings
from femend.diagnose.split import Split
from femend.diagnose.window import followed_on, widest
from femend.model import ReducedModel

__all__ = ["name_physics"]

FloatArray = NDArray[np.float64]


def name_physics(
    split: Split,
    reduced: ReducedModel,
    located: Sequence[Located],
    g_rows: list[int],
    settings: Settings,
    updated: FloatArray,
    null_score: float = np.inf,
    tell: Callable[[int], None] = lambda n: None,
    clamps: Sequence[Located] | None = None,
    note: Callable[[list[Ranked]], None] = lambda judged: None,
) -> tuple[list[Ranked], float]:
    """Candidates of all laws at the best places, in rising order of score, and the window they are compared in;
    `updated` are the unknowns of the updated model. Clamps among the places `clamps` (`located` without them) are tried
    on springs of their own. `note` gets the laws of each place as they come.

    Linear laws are tried at every place and its nearest look-alikes; nonlinear ones at the first places, and only where
    no linear law explains the choosing records about as well as a free force does. All are compared on whole
    records (sigma = 0), but where the best law's motion could only be followed within a window exp(-sigma t) there.
    """
    tried: list[Tried] = []
    opened: list[Opened] = []
    first_look = judge_in(split, reduced, 0.0, settings)
    for found in located:
        tell(1)
        for one in with_kin(found):
            # a brace to a support does what the ground does, but carries no mass
            masses_alone = found.place.kind != "ground" and one is not found
            new, at = linear_at(split, reduced, one, g_rows, masses_alone, updated)
            tried += new
            note(first_look.at_once(new))
            opened += [at] if at is not None and one is found else []
    tried += on_springs(split, reduced, located if clamps is None else clamps, updated, tried, settings)
    if not _linear_suffices(split, reduced, tried, opened, null_score, settings):
        for at in _likeliest(opened, tried, settings):
            new = nonlinear_at(split, at)
            tried += new
            note(first_look.at_once(new))
    tried = [t for t in tried if np.isfinite(t.candidate.chosen)]
    judge = widest(split, reduced, tried, settings, updated)
    ranked = [judge.ranked(t) for t in tried]
    ranked = judge.refined([r for r in ranked if np.isfinite(r.score)])
    if judge.sigma == 0:
        # in its own window a law may be adequate once it is refined
        judge = widest(split, reduced, [again(r) for r in ranked], settings, updated)
        if judge.sigma > 0:
            ranked = compared_in(split, reduced, ranked, judge.sigma, settings)
    return followed_on(split, reduced, ranked, judge.sigma, settings)


def _linear_suffices(
    split: Split,
    reduced: ReducedModel,
    tried: Sequence[Tried],
    opened: Sequence[Opened],
    null_score: float,
    settings: Settings,
) -> bool:
    """Whether the best linear law, or the model alone, comes so near to a free force that no nonlinear law could win by
    what it has to."""
    n_values = effective_values(split.choosing, reduced)
    scored = [(score(t.candidate, split.choosing, settings, n_values), t.candidate.chosen) for t in tried]
    linear, chosen = min(scored, default=(np.inf, np.inf))
    references = [free_reference(split, o.recovered) for o in opened]
    if chosen * np.exp(-settings.gain_nonlinear) < min(references, default=np.inf):
        return True
    free = [
        n_values * np.log(max(reference, 1e-12)) + split.fitting.prior_cost(o.joint.reduced, o.recovered.fit.p)
        for o, reference in zip(opened, references, strict=True)
    ]
    if null_score - min(free, default=np.inf) < settings.gain_nonlinear * n_values:
        return True
    return bool(linear - min(free, default=np.inf) < settings.gain_cost)


def _likeliest(opened: Sequence[Opened], tried: Sequence[Tried], settings: Settings) -> list[Opened]:
    """The places where nonlinear laws are tried: in turns the one a free force fits best at, and the one where a linear
    law comes nearest, since what it stands in for acts there."""

    def nearest(at: Opened) -> float:
        return min((t.candidate.chosen for t in tried if t.found.place is at.found.place), default=np.inf)

    free, linear = sorted(opened, key=lambda at: order(at.found)), sorted(opened, key=nearest)
    chosen: list[Opened] = []
    for at in (at for pair in zip(free, linear, strict=True) for at in pair):
        chosen += [] if any(at is c for c in chosen) else [at]
    return chosen[: settings.nonlinear_places]
