"""How much of what is wrong with an updated model a law takes away, by scores."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femend.diagnose.evidence import deviance
from femend.diagnose.naming.judge import ToBeat
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.settings import Settings

__all__ = ["needed_share", "score_of_noise", "share_explained", "unclear"]


def score_of_noise(ranked: Sequence[Ranked], n_values: float) -> float:
    """Score of what a free force leaves at best, or the noise where that is less."""
    references = [r.candidate.reference for r in ranked if np.isfinite(r.candidate.reference)]
    return deviance(min([1.0, *references]), n_values)


def share_explained(alone: ToBeat, best: Ranked, ranked: Sequence[Ranked], settings: Settings) -> float:
    """Share of what is wrong with the updated model, `alone`, that a law takes away: of its unseen misfit above the
    noise, or above what a free force leaves where that is less, and of the prior cost of its unknowns.

    A law at the right place leaves hardly anything. What is wrong with the model everywhere (its mesh, its
    idealisation) is never taken away by one law at one place, however much that gains.

    Of an updated model that explains the recordings as they are, nothing is wrong but what it pays its priors for that:
    by how much a free force leaves less than it does is a matter of noise, which one law does not take away.
    """
    whole = (alone.score - best.score) / max(alone.score - score_of_noise(ranked, alone.n_values), 1e-12)
    before, after = alone.candidate, best.candidate
    if before.chosen > settings.consistent or after.chosen > before.chosen:
        return whole
    return max(whole, (before.prior - after.prior) / max(before.prior, 1e-12))


def needed_share(misfit: float, settings: Settings) -> float:
    """Share that a law must take away of what is wrong with an updated model of this unseen misfit."""
    return settings.nearly if misfit < settings.weak else settings.explained


def unclear(alone: ToBeat, ranked: Sequence[Ranked], settings: Settings) -> bool:
    """Whether much is wrong with the updated model, `alone`, and no law at the places tried takes nearly all of it
    away, or not what it has to."""
    wrong = alone.score - score_of_noise(ranked, alone.n_values)
    share = share_explained(alone, ranked[0], ranked, settings) if ranked else 0.0
    enough = max(settings.clear, needed_share(alone.candidate.chosen, settings))
    return bool(wrong > 2 * settings.gain_cost and share < enough)
