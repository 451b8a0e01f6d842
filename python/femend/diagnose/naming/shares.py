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


def share_explained(null_score: float, best: Ranked, ranked: Sequence[Ranked], n_values: float) -> float:
    """Share of what is wrong with the updated model that a law takes away: of its unseen misfit above the noise, or
    above what a free force leaves where that is less, and of the prior cost of its unknowns.

    A law at the right place leaves hardly anything. What is wrong with the model everywhere (its mesh, its
    idealisation) is never taken away by one law at one place, however much that gains.
    """
    return (null_score - best.score) / max(null_score - score_of_noise(ranked, n_values), 1e-12)


def needed_share(misfit: float, settings: Settings) -> float:
    """Share that a law must take away of what is wrong with an updated model of this unseen misfit."""
    return settings.nearly if misfit < settings.weak else settings.explained


def unclear(alone: ToBeat, ranked: Sequence[Ranked], settings: Settings) -> bool:
    """Whether much is wrong with the updated model, `alone`, and no law at the places tried takes nearly all of it
    away, or not what it has to."""
    wrong = alone.score - score_of_noise(ranked, alone.n_values)
    share = share_explained(alone.score, ranked[0], ranked, alone.n_values) if ranked else 0.0
    enough = max(settings.clear, needed_share(alone.candidate.chosen, settings))
    return bool(wrong > 2 * settings.gain_cost and share < enough)
