"""Whether a law is what is missing: what it has to bring on data that no fit has seen."""

from __future__ import annotations

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.evidence import deviance, fall, price
from femend.diagnose.fitting.candidates import Candidate, standard_deviations
from femend.diagnose.naming.judge import ToBeat
from femend.diagnose.naming.ranked import Ranked, at_one_level, effective_values
from femend.diagnose.naming.shares import needed_share, share_explained
from femend.diagnose.updating.levels import depends_on_level

__all__ = [
    "TELLING",
    "accepted",
    "adequate",
    "as_drawn",
    "bends",
    "clearly_missing",
    "explains_alone",
    "share_taken",
    "stands_out",
    "worth_its_price",
]

# gain, in `gain_cost`, from which a law is told though it explains part of what is wrong
TELLING = 10.0
# half a 90 % interval, in standard deviations
INTERVAL = 1.645


def accepted(found: Diagnosis, best: Ranked) -> bool:
    """Whether a law wins against the updated model by what it has to, and takes away the share that it has to of what
    is wrong with that."""
    settings = found.settings
    gain = found.null_score - best.score
    chosen = fall(found.null_chosen.chosen, best.candidate.chosen)
    # what the model can do by itself only far outside its priors is as much missing as what it cannot do
    relieved = found.null_chosen.prior - best.candidate.prior
    won = settings.wins(gain, -np.inf if explains_alone(found) else chosen, relieved)
    return bool(won and share_taken(found, best) >= needed_share(found.null_chosen.chosen, settings))


def explains_alone(found: Diagnosis) -> bool:
    """Whether the updated model explains the recordings as they are, so that it lacks nothing that they could show."""
    return max(found.null.score, found.null_chosen.chosen) <= found.settings.consistent


def adequate(found: Diagnosis, best: Ranked) -> bool:
    """Whether a law explains unseen data about as well as a free force at its place does; a linear one that leaves far
    more of the records it is fitted to explains one level alone."""
    if at_one_level(best.candidate, _free(best), found.settings):
        return False
    return best.candidate.chosen <= found.settings.adequate * max(_reference(best), 1.0)


def _free(best: Ranked) -> float:
    """Misfit of the free force at a law's place on the records that locate; infinite where none was fitted there."""
    return best.recovered.fit.score if best.recovered is not None else np.inf


def bends(found: Diagnosis, best: Ranked) -> bool:
    """Whether the model's own unknowns leave their priors by so much beside a law that something else is missing."""
    return found.settings.bends(best.candidate.prior)


def _reference(best: Ranked) -> float:
    """Misfit of a free force at a law's place; the law's own where none was fitted there."""
    reference = best.candidate.reference
    return reference if np.isfinite(reference) else best.candidate.chosen


def stands_out(found: Diagnosis, best: Ranked) -> bool:
    """Whether a law takes away more than half of an unseen misfit far above the noise, though not what a law has to:
    beside a mesh or an idealisation that is wrong everywhere it is told as the likeliest, not as what is missing."""
    settings, before, after = found.settings, found.null_chosen.chosen, best.candidate.chosen
    far = before > settings.far and after < 0.5 * before
    gain = found.null_score - best.score
    # what one recording says of parameters that another one needs may be little, where all together are explained
    explained = found.null.score <= settings.consistent and not settings.bends(found.null.prior)
    return bool(
        far and not explained and gain > TELLING * settings.gain_cost and share_taken(found, best) >= settings.partly
    )


def as_drawn(part: Candidate) -> bool:
    """Whether the factor of a member, region or connection, fitted to all recordings, has an interval that holds 1, or
    the stiffness of a bedding one that holds 0: what one of them asked for, the others do not show.

    Told is the interval of a factor below 1, and of the inverse of one above: next to nothing that is left of a
    stiffness, or of a compliance, may be any small number, and its logarithm has no end.
    """
    if part.physics is not None or part.covariance is None:
        return False
    sd = standard_deviations(part.covariance, left=part.fitted)
    away = [1.0 if name == "k" else float(np.expm1(abs(np.log(value)))) for name, value in part.values.items()]
    return bool(np.all(np.array(away) < INTERVAL * sd))


def worth_its_price(found: Diagnosis, law: Candidate) -> bool:
    """Whether a law fitted to all recordings explains more of them than the updated model fitted to them does, by what
    its parameters cost. Where each recording is needed to tell the model's own unknowns, a model fitted to some of them
    predicts another badly, which a law at hand may make up for by chance; all of them together show that it is none.

    A law that was followed for a beginning alone is not compared with whole recordings.
    """
    if found.sigma > 0 or law.sigma > 0:
        return True
    n_values = effective_values(found.problem, found.reduced)
    alone = deviance(found.null.score, n_values) + found.null.prior
    priced = deviance(law.fitted, n_values) + law.prior + price(found.settings, n_values) * law.n_law
    return alone > priced


def share_taken(found: Diagnosis, best: Ranked) -> float:
    """Share of what is wrong with the updated model that a law takes away."""
    alone = ToBeat(found.null_chosen, found.n_values, found.null_score)
    return share_explained(alone, best, found.ranked, found.settings)


def clearly_missing(found: Diagnosis) -> bool:
    """The updated model is far from the noise, or far from it at one level and nearer at another, and a free force
    somewhere takes most of it away."""
    if not found.located:
        return False
    misfit, free = found.null.score, found.located[0].fit.score
    far = misfit > found.settings.far and free < 0.5 * misfit
    return bool(far or depends_on_level(found.problem, found.null, found.located, found.settings))
