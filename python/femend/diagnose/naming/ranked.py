"""Laws in order of score: tempered squares on unseen data, priors, and a price for every parameter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from femend.diagnose.evidence import deviance, price
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.collapse import collapsed
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.recovered import Recovered
from femend.diagnose.naming.calibration import CALIBRATION
from femend.diagnose.settings import Settings
from femend.estimate import Problem
from femend.model import ReducedModel

__all__ = ["Judged", "Ranked", "at_one_level", "effective_values", "score", "tempered", "told_simply"]


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate with its place and score (tempered log posterior on unseen data, lower is better); `name` is that of
    the simplest law that does the same."""

    candidate: Candidate
    located: Located
    score: float
    recovered: Recovered | None = None
    name: str = ""


def at_one_level(candidate: Candidate, free: float, settings: Settings) -> bool:
    """Whether a linear law leaves far more of the records it is fitted to than a `free` force does there: it may
    explain the choosing ones, of a level between theirs, by being too stiff for one and too soft for another."""
    return bool(not candidate.nonlinear and candidate.fitted > settings.far * max(free, 1.0))


class Judged(Protocol):
    """One law or several after their fit: misfit on the choosing records, prior cost of the model's unknowns, number of
    parameters."""

    @property
    def chosen(self) -> float:
        """Mean weighted square left on the records kept for choosing."""

    @property
    def prior(self) -> float:
        """Prior cost of the model's unknowns."""

    @property
    def n_law(self) -> int:
        """Number of law parameters fitted."""


def score(judged: Judged, settings: Settings, n_values: float) -> float:
    """Tempered squares on unseen data, prior of the model's unknowns, and a price for every parameter of the law."""
    return deviance(judged.chosen, n_values) + judged.prior + price(settings, n_values) * judged.n_law


def tempered(ranked: Sequence[Ranked], null_score: float = np.inf) -> list[float]:
    """Softmax of -score/2 over the candidates and nothing, tempered so that no choice looks surer than it is; what none
    of them says keeps the rest to one."""
    if not ranked:
        return []
    scores = np.array([r.score for r in ranked] + [null_score]) / CALIBRATION.temperature
    weights = np.exp(-0.5 * (scores - scores.min()))
    return [CALIBRATION.surest * float(w) for w in (weights / weights.sum())[:-1]]


def effective_values(choosing: Problem, reduced: ReducedModel, sigma: float = 0.0) -> float:
    """Tempered number of values of the choosing records, windowed by exp(-sigma t), as they count in the score: of
    whole records, though of one only a part may choose, so that scores mean the same in every study."""
    lines = choosing.lines(reduced, sigma)
    return float(sum(line.share * line.Y.size * (line.record.n / line.n) for line in lines))


def told_simply(ranked: Sequence[Ranked], settings: Settings) -> list[Ranked]:
    """Ranked laws, each by the name of what it collapses to."""
    return [replace(r, name=collapsed(r.candidate, r.recovered, settings).name) for r in ranked]
