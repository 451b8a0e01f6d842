"""The verdict: what is missing, where and what, or that nothing is, from laws in order of score."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.deciding.accepted import (
    accepted,
    adequate,
    as_drawn,
    bends,
    clearly_missing,
    share_taken,
    stands_out,
    worth_its_price,
)
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.outside_band import further_outside_alone
from femend.diagnose.deciding.own_frequency import own_frequency
from femend.diagnose.deciding.parting import parting
from femend.diagnose.deciding.plain_error import further_off, most_of_noise, plain_errors, silenced, whole_errors
from femend.diagnose.deciding.too_little import too_little
from femend.diagnose.fitting.candidates import Candidate, standard_deviations
from femend.diagnose.fitting.collapse import collapsed
from femend.diagnose.fitting.linear import refit_linear
from femend.diagnose.fitting.nonlinear import refit_nonlinear
from femend.diagnose.loads.loads import LoadFinding
from femend.diagnose.loads.unmeasured import find_harmonic, find_unmeasured, where_it_acts
from femend.diagnose.locating.dressed import own_span, own_values
from femend.diagnose.naming.advice import BENT, LATER, PART_OF_A_FORCE, PART_OF_ALL, beside_laws
from femend.diagnose.naming.free_form_rival import Rival, find_rival, refit_rival
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.naming.shares import needed_share
from femend.diagnose.updating.levels import depends_on_level, relative_errors
from femend.estimate import Fit
from femend.numerals import plain
from femend.physics import catalogue

__all__ = ["decide", "nothing_explains", "refitted_to_all"]


def decide(found: Diagnosis, plainly: bool = False) -> Diagnosis:
    """The verdict: a law has to win clearly on data it has not seen, and to explain about as much as a free force;
    `plainly` says that recordings of different level show one and the same force."""
    best = found.ranked[0] if found.ranked else None
    if found.load is not None and (best is None or found.load.score < best.score):
        told = replace(found, verdict="missing-physics", place=None)
        if not _off_with_the_load(told):
            return told
        found = replace(found, load=None)
    named = best is not None and accepted(found, best)
    if not (named and best is not None and adequate(found, best)):
        unmeasured = _unmeasured(found, plainly)
        if unmeasured is not None:
            return replace(found, verdict="missing-physics", load=unmeasured, advice=where_it_acts(unmeasured))
    rival = _rival(found, named)
    if rival is not None:
        told = _free_form(found, rival)
    elif best is not None and (named or stands_out(found, best)):
        told = _one_law(found, best, named)
    else:
        return _no_law(found)
    errors = plain_errors(told)
    if untold := silenced(told, errors):
        return replace(found, verdict="undetermined", place=None, advice=untold)
    off = further_off(told, errors)
    if off and told.best is not None and further_outside_alone(told):
        likeliest = further_off(told, errors, so="it is the likeliest, and no more")
        return replace(told, verdict="located-not-named", advice=likeliest)
    if off:
        return _no_law(found, off)
    return told if told.sigma == 0 else _of_a_beginning(found, told)


def _of_a_beginning(found: Diagnosis, told: Diagnosis) -> Diagnosis:
    """The verdict on what explains the beginning of the recordings, which shows too little to tell many laws apart: as
    a whole the model has to come nearer to them. To be sure, a law has to come near to the noise, or what it leaves has
    to be of motion that cannot be followed: models that explain the beginning as well part as far."""
    whole = replace(told, sigma=0.0)
    if off := further_off(whole, plain_errors(whole), LATER, beginning=told):
        return replace(found, verdict="located-not-named", place=told.place, advice=off)
    if told.verdict != "missing-physics":
        return told
    rest = parting(told)
    if rest.otherwise:
        return replace(told, verdict="located-not-named", advice=rest.otherwise)
    if rest.accounts and told.best is not None:
        return replace(told, advice=beside_laws([told.best], told.problem, told.sigma, parts=True))
    sure = most_of_noise(whole) <= told.settings.together
    return told if sure else replace(told, verdict="located-not-named")


def _off_with_the_load(told: Diagnosis) -> bool:
    """Whether the recordings as a whole are further from the model with the force elsewhere than from the updated one:
    it won by what shares of sensors, or lines in the band alone, make of it."""
    if told.load is None or told.load.physics != "load_misplaced":
        return False
    before, after = whole_errors(told)
    return after > told.settings.worse * before


def _one_law(found: Diagnosis, best: Ranked, named: bool) -> Diagnosis:
    """The verdict on the best law fitted to all recordings, told by its name where it is `named` and adequate, and the
    model's own unknowns stay near their priors beside it: what they make up for, the law does not explain."""
    refitted = refitted_to_all(found, best)
    if best.located is not None and best.located.place.scaled and as_drawn(refitted):
        factor = plain(next(iter(refitted.values.values())), 3)
        return _no_law(
            found,
            f"a factor on the stiffness {best.located.place.where} explains the data that chose best, but is {factor} "
            "when fitted to all recordings, which is as drawn within its interval",
        )
    if best.located is not None and not worth_its_price(found, refitted):
        return _no_law(
            found,
            f"{best.name.replace('_', ' ')} {best.located.place.where} explains the data that chose best, but the "
            f"model fitted to all recordings leaves {plain(refitted.fitted, 3)} times what noise explains with it and "
            f"{plain(found.null.score, 3)} times without, less than what a law's parameters cost",
        )
    bent = bends(found, best)
    enough = named and adequate(found, best) and not bent
    verdict = "missing-physics" if enough else "located-not-named"
    advice = BENT if bent else PART_OF_A_FORCE if named else PART_OF_ALL
    if enough:
        advice = beside_laws([refitted], found.problem, found.sigma)
    return replace(found, verdict=verdict, best=refitted, place=best.located, advice=advice)


def refitted_to_all(found: Diagnosis, best: Ranked, *, simulated: bool = True) -> Candidate:
    """A law by the name of the simplest that does the same, fitted to all recordings; one whose response needs a
    simulation as it stands unless `simulated`."""
    candidate = collapsed(best.candidate, best.recovered, found.settings)
    if candidate.joint is not None and not candidate.nonlinear:
        return refit_linear(found.problem, candidate)
    if candidate.joint is not None:
        return refit_nonlinear(found.problem.thinned(600), candidate) if simulated else candidate
    if best.located is None:
        return candidate
    (fit,) = found.problem.fit([best.located.fit.hypothesis], [(candidate.p, candidate.x)])
    return candidate if fit is None else _refitted_part(candidate, fit)


def _no_law(found: Diagnosis, advice: str = "") -> Diagnosis:
    """The verdict where no law is told: something may be missing all the same, or the data cannot tell. `advice` is
    what has to be said of a law that won."""
    settings = found.settings

    def told(verdict: str, more: str) -> Diagnosis:
        return replace(found, verdict=verdict, place=None, advice="; ".join(filter(None, [more, advice])))

    if not found.located and found.null.score > settings.far:
        return told("undetermined", _more_sensors(found))
    if _worst_parameter(found) > settings.parameter_z or clearly_missing(found):
        return replace(told("located-not-named", nothing_explains(found)), place=found.place)
    mode = own_frequency(found)
    if mode is not None and mode.deviations > settings.parameter_z:
        if _brings_back(found):
            return replace(told("located-not-named", mode.text), place=found.place)
        return told("undetermined", mode.text)
    if untold := too_little(found.problem, found.reduced):
        return told("undetermined", untold)
    return told("parameters-only" if _needed_update(found) else "consistent", "")


def _unmeasured(found: Diagnosis, plainly: bool) -> LoadFinding | None:
    """A force nobody recorded beside those that were: any where much is missing, and a harmonic one where less is."""
    if plainly or clearly_missing(found):
        return find_unmeasured(found.given, found.located)
    if found.null.score <= found.settings.consistent:
        return None
    return find_harmonic(found.given, found.located, found.null_chosen, found.null_score)


def _refitted_part(candidate: Candidate, fit: Fit) -> Candidate:
    """A part of the model (a member, a soft clamp) at its fit to all records, with the covariance of its unknowns."""
    reduced = fit.hypothesis.reduced
    covariance, own = np.asarray(np.linalg.pinv(fit.hessian), dtype=np.float64), own_span(reduced)
    told = reduced.members[-1].slopes(fit.p[own]) if reduced.members else np.ones(0)
    return replace(
        candidate,
        values=own_values(reduced, fit.p),
        p=fit.p,
        fitted=fit.score,
        p_sd=standard_deviations(covariance, len(fit.p)),
        covariance=covariance[own, own] * np.outer(told, told) if reduced.members else None,
        converged=fit.converged,
    )


def _rival(found: Diagnosis, named: bool) -> Rival | None:
    """The free-form force where it beats every named law and is itself what a law has to be to be accepted."""
    if found.problem.load is not None or not (named or clearly_missing(found)):
        return None
    rival = find_rival(found.split, found.ranked, found.settings, found.n_values, found.sigma, found.null_score)
    return rival if rival is not None and accepted(found, rival.ranked) else None


def _free_form(found: Diagnosis, rival: Rival) -> Diagnosis:
    """The verdict where the free-form force wins: it goes into the final model, and its class is told."""
    best = refit_rival(found.problem.thinned(600), rival.ranked.candidate)
    return replace(
        found, verdict="located-not-named", best=best, place=rival.ranked.located, advice=rival.advice, rival=rival
    )


def _worst_parameter(found: Diagnosis) -> float:
    n = len(found.reduced.model.parameters)
    mean, sd = found.problem.prior(found.reduced)
    return float(np.abs((found.null.p[:n] - mean[:n]) / sd[:n]).max(initial=0.0))


def _brings_back(found: Diagnosis) -> bool:
    """Whether a free force at the best place brings the model's own unknowns clearly nearer to their priors."""
    if found.place is None:
        return False
    free = found.place.fit
    before, after = (found.problem.prior_cost(f.hypothesis.reduced, f.p) for f in (found.null, free))
    return before - after > found.settings.gain_cost


def _needed_update(found: Diagnosis) -> bool:
    hypothesis, p = found.nominal
    (nominal,) = found.problem.fit([hypothesis], [(p, np.zeros(0))], iterations=0)
    return nominal is None or nominal.score > max(found.settings.consistent, 1.1 * found.null.score)


def nothing_explains(found: Diagnosis) -> str:
    """What is told where something is missing that no law explains."""
    told = f"something is missing at the first place listed, but {_nearest(found)}"
    if not depends_on_level(found.problem, found.null, found.located, found.settings):
        return told
    error = relative_errors(found.problem, found.null)
    best, worst = int(np.argmin(error)), int(np.argmax(error))
    names = [r.name for r in found.problem.records]
    return (
        f"{told}; it depends on the level: beyond the noise the updated model leaves {plain(100 * error[worst], 2)} % "
        f"of {names[worst]} and {plain(100 * error[best], 2)} % of {names[best]}, which no linear model does"
    )


def _nearest(found: Diagnosis) -> str:
    """How far the best law is from an explanation."""
    best = found.ranked[0] if found.ranked else None
    needed = needed_share(found.null_chosen.chosen, found.settings)
    if best is None or not adequate(found, best) or not found.settings.partly <= share_taken(found, best) < needed:
        others = len(catalogue(extended=True)) > len(catalogue())
        more = '; others can be asked for ("laws", by name or "all")' if others else ""
        return f"no law that was tried explains it{more}"
    share, name = share_taken(found, best), best.name.replace("_", " ")
    return (
        f"the best law, {name} {best.located.place.where}, takes away {plain(100 * share, 2)} % of what is "
        f"wrong with the updated model, and a name needs {plain(100 * needed, 2)} %"
    )


def _more_sensors(found: Diagnosis) -> str:
    """Why no place could be told, and what would."""
    n = min(r.y.shape[0] for r in found.problem.records)
    return (
        f"the updated model leaves {plain(found.null.score, 3)} times what noise explains, but with {n} response(s) a "
        f"force anywhere explains everything; record at least {n + 1} responses, or name the law at a place you "
        "suspect with femend.diagnose.name_at"
    )
