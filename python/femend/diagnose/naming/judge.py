"""Laws judged on data that no fit has seen, all in one window exp(-sigma t)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.evidence import deviance
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.linear import judge_linear
from femend.diagnose.fitting.nonlinear import as_recorded, judge_nonlinear, refit_nonlinear
from femend.diagnose.fitting.other_sides import on_other_sides
from femend.diagnose.fitting.pace import OUTDONE
from femend.diagnose.locating.dressed import own_values
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.recovered import Recovered
from femend.diagnose.locating.split import Split
from femend.diagnose.naming.ranked import Ranked, effective_values, score
from femend.diagnose.naming.simple_first import simple_first
from femend.diagnose.settings import Settings
from femend.estimate import Fit
from femend.model import ReducedModel

__all__ = [
    "Given",
    "Judge",
    "ToBeat",
    "Tried",
    "again",
    "beaten",
    "compared_in",
    "free_reference",
    "free_score",
    "judge_in",
    "null_candidate",
    "to_beat",
]

FloatArray = NDArray[np.float64]

# candidates of one name among those that are fitted once more
OF_ONE_NAME = 2


@dataclass(frozen=True, eq=False)
class Given:
    """What laws are tried on: the fit recordings apart, the updated model with its unknowns `updated` (n_p,), the rows
    of the g-set that a basis has to hold (`g_rows`, as of `reduce_model`), and the thresholds."""

    split: Split
    reduced: ReducedModel
    g_rows: list[int]
    updated: FloatArray
    settings: Settings

    def n_values(self, sigma: float = 0.0) -> float:
        """Number of values that scores count in a window exp(-sigma t)."""
        return effective_values(self.split.choosing, self.reduced, sigma)


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate with where it came from."""

    candidate: Candidate
    found: Located
    recovered: Recovered | None


def again(ranked: Ranked) -> Tried:
    """A law that was judged, to be judged otherwise."""
    return Tried(ranked.candidate, ranked.located, ranked.recovered)


def null_candidate(split: Split, null: Fit, name: str = "none", sigma: float = 0.0) -> Candidate:
    """The model with its parameters alone (or a member's factor, a soft clamp's springs) as a candidate, judged with a
    window of `sigma`."""
    (fitted,) = split.fitting.fit([null.hypothesis], [(null.p, null.x)])
    fitted = null if fitted is None else fitted
    (seen,) = split.choosing.fit([fitted.hypothesis], [(fitted.p, fitted.x)], sigma=sigma, iterations=0)
    n_law = null.hypothesis.reduced.extra
    mean, sd = split.fitting.prior(null.hypothesis.reduced)
    deviations = ((fitted.p - mean) / sd) ** 2
    n = len(null.hypothesis.reduced.names)
    own = slice(n - n_law, n)
    prior = float(deviations.sum() - deviations[own].sum())
    values = own_values(null.hypothesis.reduced, fitted.p)
    chosen = np.inf if seen is None else seen.score
    return Candidate(None, name, None, values, fitted.p, fitted.x, n_law, prior, fitted.score, chosen)


def free_reference(split: Split, recovered: Recovered, sigma: float = 0.0) -> float:
    """Misfit a free force at the joint leaves on the choosing records, worked out once: what the right law can reach at
    best."""

    def left() -> float:
        fit = recovered.fit
        (seen,) = split.choosing.fit([fit.hypothesis], [(fit.p, fit.x)], sigma=sigma, iterations=0)
        return np.inf if seen is None else seen.score

    return float(split.choosing.kept(("free force", recovered, sigma), left))


def free_score(split: Split, recovered: Recovered, reference: float, n_values: float) -> float:
    """Score of a law that explains as much as a free force at its place, which leaves `reference` of `n_values` values,
    and has no parameters: no law can have less there."""
    prior = split.fitting.prior_cost(recovered.fit.hypothesis.reduced, recovered.fit.p)
    return deviance(reference, n_values) + prior


def beaten(given: Given, tried: Sequence[Tried], recovered: Recovered) -> bool:
    """Whether one of the laws `tried` explains whole records, the model near its priors, with a score clearly less than
    any law can have where something did what was `recovered`. Where none does so there may be two effects."""
    settings, n_values = given.settings, given.n_values()
    explaining = (
        t.candidate
        for t in tried
        if t.candidate.sigma == 0
        and t.candidate.chosen <= settings.adequate
        and t.candidate.prior <= settings.gain_cost
    )
    best = min((score(c, settings, n_values) for c in explaining), default=np.inf)
    if not np.isfinite(best):
        return False
    free = free_score(given.split, recovered, free_reference(given.split, recovered), n_values)
    return bool(best + settings.gain_cost < free)


@dataclass(frozen=True, eq=False)
class Judge:
    """Scores on the choosing records, all in one window; `n_values` as they count there."""

    split: Split
    settings: Settings
    n_values: float
    sigma: float

    def at_once(self, tried: Sequence[Tried]) -> list[Ranked]:
        """Candidates that were followed over whole records, with their scores as they are, nothing judged anew."""
        whole = [t for t in tried if t.candidate.sigma == 0 and np.isfinite(t.candidate.chosen)]
        scores = [score(t.candidate, self.settings, self.n_values) for t in whole]
        return [Ranked(t.candidate, t.found, value, t.recovered) for t, value in zip(whole, scores, strict=True)]

    def ranked(self, tried: Tried, afresh: bool = False) -> Ranked:
        """A candidate with its score; judged `afresh` where it may have been in another window."""
        candidate, choosing = tried.candidate, self.split.choosing
        if afresh or self.sigma > 0 or candidate.sigma > 0:
            if candidate.nonlinear:
                candidate = judge_nonlinear(choosing, candidate, self.sigma)
            elif candidate.joint is not None:
                candidate = judge_linear(choosing, candidate, self.sigma)
            else:
                candidate = null_candidate(self.split, tried.found.fit, candidate.name, self.sigma)
        if tried.recovered is not None:
            candidate = replace(candidate, reference=free_reference(self.split, tried.recovered, self.sigma))
        value = score(candidate, self.settings, self.n_values)
        return Ranked(candidate, tried.found, value, tried.recovered)

    def refined(self, ranked: list[Ranked]) -> list[Ranked]:
        """In rising order of score, the best nonlinear candidates fitted once more in fine steps, all unknowns free, as
        far as they can still win, and of those whose motion was followed in a beginning alone the one that explains
        that best: what it leaves of the rest says nothing of it."""
        best: list[Ranked] = []
        for r in sorted((r for r in ranked if r.candidate.nonlinear), key=lambda r: r.candidate.chosen):
            again = sum(r.candidate.name == b.candidate.name for b in best)
            best += [r] if again < OF_ONE_NAME and len(best) < self.settings.refined else []
        begun = [r for r in ranked if r.candidate.nonlinear and r.candidate.sigma > self.sigma]
        begun = [r for r in sorted(begun, key=lambda r: r.candidate.fitted)[:1] if not any(r is b for b in best)]
        best += begun
        rest = [r for r in ranked if not any(r is b for b in best)]
        recorder, settings = self.split.fitting.recorder, self.settings
        filters = recorder.filters
        done: list[Ranked] = []
        for r in best:
            if self._beaten(r, done):
                rest.append(r)
                continue
            inside = replace(r.candidate, sigma=max(r.candidate.sigma, self.sigma))
            candidate = refit_nonlinear(self.split.fitting, inside)
            candidate = on_other_sides(self.split.fitting, candidate, r.recovered, settings.consistent)
            if r is best[0]:
                candidate = as_recorded(self.split.fitting, candidate, settings.margin, settings.adequate)
            done.append(self.judged(candidate, r))
        if recorder.filters != filters:
            rest = [self.judged(r.candidate, r) if r.candidate.nonlinear else r for r in rest]
        return self.in_order([*rest, *done])

    def _beaten(self, r: Ranked, done: Sequence[Ranked]) -> bool:
        """Whether one of the laws `done` explains so much that `r` is far behind, or has a score that no law can have
        where `r` is."""
        nearest = min((d.candidate.chosen for d in done), default=np.inf)
        if nearest <= self.settings.adequate and r.candidate.chosen > OUTDONE * nearest:
            return True
        if r.recovered is None:
            return False
        least = free_score(self.split, r.recovered, r.candidate.reference, self.n_values)
        return min((d.score for d in done), default=np.inf) + self.settings.gain_cost < least

    def judged(self, candidate: Candidate, tried: Ranked) -> Ranked:
        """A nonlinear candidate judged anew where it was `tried`."""
        return self.ranked(Tried(judge_nonlinear(self.split.choosing, candidate), tried.located, tried.recovered))

    def in_order(self, ranked: Sequence[Ranked]) -> list[Ranked]:
        """In rising order of score, a simple law before one that is hardly better."""
        return simple_first(sorted((r for r in ranked if np.isfinite(r.score)), key=lambda r: r.score), self.settings)


def judge_in(given: Given, sigma: float) -> Judge:
    """The judge of laws in a window exp(-sigma t)."""
    return Judge(given.split, given.settings, given.n_values(sigma), sigma)


def compared_in(given: Given, ranked: Sequence[Ranked], sigma: float) -> list[Ranked]:
    """Laws that were found one place after the other, all compared in one window exp(-sigma t)."""
    judge = judge_in(given, sigma)
    return judge.in_order([judge.ranked(again(r), afresh=True) for r in ranked])


@dataclass(frozen=True, eq=False)
class ToBeat:
    """The updated model as a candidate in a window exp(-sigma t), the number of values that scores there are of, and
    its own."""

    candidate: Candidate
    n_values: float
    score: float


def to_beat(given: Given, null: Fit, sigma: float = 0.0) -> ToBeat:
    """What laws have to beat in a window exp(-sigma t): the updated model, `null`, by itself."""
    candidate, n_values = null_candidate(given.split, null, sigma=sigma), given.n_values(sigma)
    return ToBeat(candidate, n_values, score(candidate, given.settings, n_values))
