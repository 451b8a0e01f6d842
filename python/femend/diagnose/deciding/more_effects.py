"""More than one effect, where the one that was found does not explain enough."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.plain_error import further_off, most_of_noise, plain_errors
from femend.diagnose.locating.locate import Located
from femend.diagnose.naming.advice import FAR_FROM_NOISE, PART_OF_TWO, beside_laws
from femend.diagnose.naming.judge import compared_in, to_beat
from femend.diagnose.naming.ranked import Ranked, told_simply
from femend.diagnose.naming.shares import score_of_noise
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.second import Further
from femend.diagnose.updating.noise import Louder
from femend.diagnose.updating.update import UpdatedModel
from femend.model import Place

__all__ = ["with_further"]


def with_further(
    found: Diagnosis,
    start: UpdatedModel,
    located: Sequence[Located],
    places: Sequence[Place],
    loud: Louder | None,
    search: Callable[[Searched], Further | None],
) -> Diagnosis:
    """The diagnosis with more than one effect where one does not explain enough.

    What one force leaves may be a second effect: `search` looks for it from the `start` and its places as they were
    before that counted as noise (`loud`).
    """
    settings = found.settings

    def searched(sigma: float) -> Searched:
        one = found if sigma == found.sigma else _compared_in(found, sigma)
        ranked, null_score = one.ranked, one.null_score
        split = one.split.of(start.problem)
        if loud is not None:
            factor = float(np.mean([loud.factor[r.name] for r in split.choosing.records]))
            shift = one.n_values * float(np.log(factor))
            ranked = [_shifted(r, factor, shift) for r in ranked]
            null_score += shift
        floor = score_of_noise(ranked, one.n_values)
        return Searched(start.problem, one.reduced, one.g_rows, split, places, located, ranked, settings,
                        one.n_values, null_score, floor, sigma, searched)  # fmt: skip

    further = search(searched(found.sigma))
    if further is None or (found.verdict == "missing-physics" and further.terms.fitted > settings.second):
        return found
    adequate = further.terms.chosen <= settings.adequate
    verdict = "missing-physics" if adequate else "located-not-named"
    laws = [term.candidate for term in further.terms.terms]
    advice = beside_laws(laws, start.problem, further.terms.sigma) if adequate else PART_OF_TWO
    lead = further.terms.terms[0]
    told = replace(
        found, verdict=verdict, problem=start.problem, best=lead.candidate, place=lead.located, advice=advice,
        rival=None, further=further, sigma=further.terms.sigma,
    )  # fmt: skip
    if further_off(told, plain_errors(told)):
        return found
    if adequate and found.verdict != "missing-physics" and most_of_noise(told) > settings.together:
        return replace(told, verdict="located-not-named", advice=FAR_FROM_NOISE)
    return told


def _compared_in(found: Diagnosis, sigma: float) -> Diagnosis:
    """The laws as they compare in another window exp(-sigma t)."""
    alone, ranked = to_beat(found.given, found.null, sigma), compared_in(found.given, found.ranked, sigma)
    return replace(
        found, ranked=told_simply(ranked, found.settings), null_chosen=alone.candidate, null_score=alone.score,
        n_values=alone.n_values, sigma=sigma,
    )  # fmt: skip


def _shifted(ranked: Ranked, factor: float, shift: float) -> Ranked:
    """A law as it is judged where squares are `factor` times as large, which raises every score by `shift`."""
    c = ranked.candidate
    return replace(
        ranked,
        candidate=replace(c, chosen=c.chosen * factor, reference=c.reference * factor),
        score=ranked.score + shift,
    )
