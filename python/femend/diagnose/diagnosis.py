"""The diagnosis: update, detect, locate, name, decide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.advice import PART_OF_A_FORCE, PART_OF_ALL, PART_OF_TWO, beside_laws
from femend.diagnose.alike import with_look_alikes
from femend.diagnose.best_place import at_the_best_place
from femend.diagnose.candidates import Candidate, standard_deviations
from femend.diagnose.collapse import collapsed
from femend.diagnose.directions import in_other_directions
from femend.diagnose.dressed import own_span, own_values
from femend.diagnose.free_form_rival import Rival, find_rival, refit_rival
from femend.diagnose.levels import depends_on_level, relative_errors
from femend.diagnose.linear import refit_linear
from femend.diagnose.loads import LoadFinding, try_loads
from femend.diagnose.locate import FINAL_LINES, Located, locate, shortlist, squares_of
from femend.diagnose.name import (
    Ranked,
    compared_in,
    effective_values,
    name_physics,
    null_candidate,
    score,
    tempered,
    told_simply,
)
from femend.diagnose.noise import Louder, louder, quieter_records
from femend.diagnose.nonlinear import refit_nonlinear
from femend.diagnose.second import Further, Searched, look_further
from femend.diagnose.settings import Settings
from femend.diagnose.shares import score_of_noise, share_explained, unclear
from femend.diagnose.so_far import SoFar
from femend.diagnose.split import Split, split_records
from femend.diagnose.too_little import too_little
from femend.diagnose.unmeasured import find_harmonic, find_unmeasured, plainly_unmeasured
from femend.diagnose.unrecorded import Driven, holds, locate_drive, with_force_read_off
from femend.diagnose.update import UpdatedModel, update_model
from femend.estimate import Fit, FitRecord, Hypothesis, Problem
from femend.model import Model, Place, ReducedModel, find_places
from femend.progress import Progress, SilentProgress
from femend.threads import one_blas_thread

__all__ = ["Diagnosis", "diagnose_records", "diagnose_responses", "explain"]

FloatArray = NDArray[np.float64]

# misfit, as a multiple of what counts as consistent, from which something is missing whatever it is
FAR = 3.0
# gain, in `gain_cost`, from which a law is told though it explains part of what is wrong
TELLING = 10.0
# misfit with one more free force, in that of the updated model, up to which it explains clearly more where the force
# that drove the structure is free too: 0.94 and more on controls of calibration seed 27, 0.88 and less where something
# shows
ONE_MORE = 0.91
# places from whose free forces an updated model that leaves more than noise is fitted again
STARTS = 3


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything a diagnosis found.

    `verdict` is one of the contract's; `split` says which recordings choose between laws; `best` is the accepted
    candidate refitted to all records (None where nothing is added), `null` the updated model, `nominal` the deck as it
    is; `ranked` are the candidates in order, `located` the places, `probabilities` of the ranked, `load` a finding
    about the load, `n_values` the effective number of values that scores count on the choosing records, windowed by
    exp(-`sigma` t); `rival` is the free-form force where it beats every named law (`best` is it then); `further` are
    several effects at once where one does not explain enough; `driven` is where the force acts if nobody recorded it;
    `interrupted` says that the run was stopped before it could decide.
    """

    verdict: str
    problem: Problem
    split: Split
    reduced: ReducedModel
    nominal: tuple[Hypothesis, FloatArray]
    null: Fit
    null_chosen: Candidate
    null_score: float
    located: list[Located]
    ranked: list[Ranked]
    probabilities: list[float]
    best: Candidate | None
    place: Located | None
    load: LoadFinding | None
    advice: str
    settings: Settings
    g_rows: list[int]
    n_values: float = 0.0
    sigma: float = 0.0
    rival: Rival | None = None
    further: Further | None = None
    driven: Driven | None = None
    interrupted: bool = False

    @property
    def by_load(self) -> bool:
        """Whether what is told is the load; one that was tried may have lost against a law, or against nothing."""
        return self.load is not None and self.best is None and self.verdict == "missing-physics"

    @property
    def final(self) -> Candidate | None:
        """The candidate used for the final predictions; None for the updated model."""
        return self.best


@one_blas_thread
def diagnose_records(
    model: Model,
    records: Sequence[FitRecord],
    zeta: float,
    progress: Progress | None = None,
    settings: Settings | None = None,
    so_far: SoFar | None = None,
) -> Diagnosis:
    """Diagnoses a model against its fit records (accelerations, measured forces, from rest).

    `zeta` is the starting damping ratio; `so_far` is filled on the way. Raises RecordingError where there is nothing to
    fit.
    """
    settings, so_far = settings or Settings(), so_far or SoFar()
    tell = progress or SilentProgress()
    start = so_far.start = update_model(model, records, zeta, tell.start)
    tell.start("list the places")
    places = find_places(start.reduced.model)
    tell.start("locate what is missing", len(places))
    located = locate(start.problem, start.reduced, places, start.null)
    quieter = quieter_records(start.problem, located)
    if quieter is not None:
        start = update_model(start.reduced.model, quieter, zeta)
        located = locate(start.problem, start.reduced, places, start.null)
    so_far.places(start, located)
    out = so_far.found = explain(_nearer(start, located, settings), located, places, settings, tell, so_far=so_far)
    tell.done()
    return out


@one_blas_thread
def diagnose_responses(
    model: Model,
    records: Sequence[FitRecord],
    zeta: float,
    progress: Progress | None = None,
    settings: Settings | None = None,
    so_far: SoFar | None = None,
) -> Diagnosis | None:
    """Diagnoses a model against records of one force that nobody recorded (`u` (0, n)); None where no single force
    explains them. Linear laws are named; what depends on the level is located. `so_far` is filled on the way.

    Raises RecordingError with fewer than three responses.
    """
    settings, tell, so_far = settings or Settings(), progress or SilentProgress(), so_far or SoFar()
    driven = locate_drive(model, records, zeta, settings, tell)
    if not driven.explained:
        return None
    so_far.driven = driven
    so_far.places(driven.start, driven.located)
    out = explain(driven.start, driven.located, driven.places, settings, tell, so_far=so_far)
    if out.verdict != "missing-physics" and _one_more_force(driven, settings):
        out = _simulated(driven, out, settings, tell)
        if out.verdict in ("consistent", "parameters-only"):
            out = replace(out, verdict="located-not-named", place=driven.located[0], advice=_unnamed(out))
    tell.done()
    so_far.found = replace(out, driven=driven)
    return so_far.found


def _one_more_force(driven: Driven, settings: Settings) -> bool:
    """Whether a free force beside the drive explains clearly more than the updated model. Near the noise a misfit alone
    says little where a force is free on every line."""
    if not driven.located:
        return False
    start, first = driven.start, driven.located[0]
    gain = start.null.prior + squares_of(start.problem, start.null, 0.0) - first.cost
    return gain > TELLING * settings.gain_cost and first.fit.score < ONE_MORE * start.null.score


def _simulated(driven: Driven, plain: Diagnosis, settings: Settings, tell: Progress) -> Diagnosis:
    """The diagnosis with laws that have to be simulated, under the force that is read off at the drive; `plain` where
    none holds with the force free again."""
    first, place = driven.located[0], plain.place
    near = place is not None and place.cost < first.cost + settings.margin
    known = with_force_read_off(driven, place if near and place is not None else first)
    if known is None:
        return plain
    tell.start("locate what is missing", len(driven.places))
    located = locate(known.problem, known.reduced, driven.places, known.null)
    again = explain(known, located, driven.places, settings, tell, further=False)
    if again.verdict != "missing-physics" or again.best is None:
        return plain
    return again if holds(driven, known.problem, again.best, settings) else plain


def _nearer(start: UpdatedModel, located: Sequence[Located], settings: Settings) -> UpdatedModel:
    """The updated model, fitted again from where free forces at the best places put it: an update may stop far from the
    truth though nothing is missing, and a force, whatever it is, leads past."""
    problem, null = start.problem, start.null
    if null.score <= settings.consistent:
        return start
    tries = [f.fit.p for f in located if len(f.fit.p) == len(null.p)][:STARTS]
    if not tries:
        return start
    few = problem.sparing(FINAL_LINES)
    found = few.fit([null.hypothesis] * (1 + len(tries)), [(p, null.x) for p in (null.p, *tries)])
    best = min((f for f in found if f is not None), key=lambda f: f.cost, default=null)
    (fit,) = problem.fit([null.hypothesis], [(best.p, best.x)])
    return replace(start, null=fit) if fit is not None and fit.cost < null.cost else start


@one_blas_thread
def explain(
    start: UpdatedModel,
    located: Sequence[Located],
    places: Sequence[Place],
    settings: Settings,
    tell: Progress | None = None,
    *,
    further: bool = True,
    so_far: SoFar | None = None,
) -> Diagnosis:
    """Names what is missing at the places `located` (of all `places`), or says that nothing is; `further` effects are
    looked for where one does not explain enough. `so_far` is filled on the way."""
    tell, so_far = tell or SilentProgress(), so_far or SoFar()
    plain, plainly_located, loud = start, located, louder(start, located)
    if loud is not None:
        start, located = loud.start, loud.located
    so_far.places(start, located)
    problem, reduced, null = start.problem, start.reduced, start.null
    split = split_records(problem, null, located)
    baseline, n_values, null_score = _to_beat(split, reduced, null, settings)
    tell.start("try loads")
    located = list(located)
    # one force against the ground cannot stand in for a load that acts elsewhere than recorded, though it can for one
    # turned round where it is; one between the two places, or at a joint between them, can
    near = located[0].cost + settings.reach if located else np.inf
    explained = any(f.place.kind == "ground" and f.fit.score < settings.adequate and f.cost <= near for f in located)
    load = try_loads(problem, split, reduced, null, baseline, settings, turned=explained)
    short = with_look_alikes(problem, reduced, shortlist(located), places, settings)
    tell.start("name it", len(short))
    ranked, sigma = list[Ranked](), 0.0
    # a load that explains the recordings leaves nothing to name
    settled = load is not None and load.fit.score <= settings.consistent
    worth = (
        not settled
        and _worth_naming(problem, null, located, settings)
        and _could_win(problem, null, baseline, located, settings)
    )
    plainly = worth and plainly_unmeasured(split, reduced, located, start.g_rows, settings)
    if worth and not plainly:
        ranked, sigma = _named(start, split, located, places, short, (null_score, n_values), settings, tell, so_far)
        so_far.ranked = list(ranked)
        if load is None and explained and sigma == 0 and _lacking(null_score, ranked, n_values, settings):
            # no law is behind the force that explains so much: it may stand in for a load that acts elsewhere after all
            tell.start("try loads")
            load = try_loads(problem, split, reduced, null, baseline, settings)
        if sigma > 0:
            baseline, n_values, null_score = _to_beat(split, reduced, null, settings, sigma)
    ranked = told_simply(ranked, settings)
    tell.start("fit the final model")
    undecided = Diagnosis(
        "", problem, split, reduced, start.nominal, null, baseline, null_score, located, ranked,
        tempered(ranked, null_score), None, short[0] if short else None, load, "", settings, start.g_rows,
        n_values, sigma,
    )  # fmt: skip
    decided = _placed(decide(undecided, plainly), places)
    told = not decided.by_load and decided.verdict in ("missing-physics", "located-not-named")
    if not (further and told) or problem.load is not None:
        return decided
    if decided.rival is not None and decided.rival.ranked.candidate.chosen <= settings.adequate:
        return decided  # one force at one place explains what was not used to fit it
    tell.start("look for more")
    so_far.decided = decided
    return with_further(decided, plain, plainly_located, places, loud)


def _placed(found: Diagnosis, places: Sequence[Place]) -> Diagnosis:
    """The diagnosis with a named law of one coordinate where it leaves least of the places that move the sensors
    alike."""
    best, place = found.best, found.place
    if found.verdict != "missing-physics" or found.rival is not None or best is None or place is None:
        return found
    if place.place.n_w != 1 or found.problem.load is not None or any(r.frf is not None for r in found.problem.records):
        return found
    first = Searched(found.problem, found.reduced, found.g_rows, found.split, places, found.located, found.ranked,
                     found.settings, found.n_values, found.null_score, 0.0, found.sigma)  # fmt: skip
    law, there = at_the_best_place(first, best, place)
    return replace(found, best=law, place=there)


def _lacking(null_score: float, ranked: Sequence[Ranked], n_values: float, settings: Settings) -> bool:
    """Whether no law takes nearly all away, or the best one, however much it takes, leaves far more than noise."""
    far = bool(ranked) and ranked[0].candidate.chosen > FAR * settings.consistent
    return far or unclear(null_score, ranked, n_values, settings)


def _named(
    start: UpdatedModel,
    split: Split,
    located: Sequence[Located],
    places: Sequence[Place],
    short: Sequence[Located],
    score_of_none: tuple[float, float],
    settings: Settings,
    tell: Progress,
    so_far: SoFar,
) -> tuple[list[Ranked], float]:
    """Laws at the places `short` and, as long as none takes away nearly all, at further kinds of places and then in
    directions not tried, in rising order of score, and the window they are compared in; `score_of_none` is that of the
    updated model, with the number of values it is of."""
    problem, reduced, null = start.problem, start.reduced, start.null
    null_score, n_values = score_of_none
    naming = partial(
        name_physics, split, reduced, g_rows=start.g_rows, updated=null.p, tell=tell.advance, note=so_far.ranked.extend
    )
    ranked, sigma = naming(short, settings=settings, null_score=null_score, clamps=[*short, *located])
    tried = [one.place for one in short]
    all_kinds = replace(settings, places=settings.kinds)
    # of a direction that never came to the fore, nonlinear laws are tried at all kinds of places
    in_others = partial(in_other_directions, problem, reduced, places, null)
    for wider, reach in ((_untried, all_kinds), (in_others, replace(all_kinds, nonlinear_places=settings.kinds))):
        if sigma > 0 or not unclear(null_score, ranked, n_values, settings):
            break
        further = with_look_alikes(problem, reduced, wider(located, tried), places, reach)
        tried += [one.place for one in further]
        tell.start("name it", len(further))
        beaten = min([null_score, *(r.score for r in ranked)])
        more, sigma = naming(further, settings=reach, null_score=beaten, clamps=())
        ranked = sorted([*ranked, *more], key=lambda r: r.score)
        ranked = compared_in(split, reduced, ranked, sigma, settings) if sigma > 0 else ranked
    return ranked, sigma


def _untried(located: Sequence[Located], tried: Sequence[Place]) -> list[Located]:
    """Places whose laws are worth fitting, without those tried already."""
    return [one for one in shortlist(located) if not any(one.place is p for p in tried)]


def _worth_naming(problem: Problem, null: Fit, located: Sequence[Located], settings: Settings) -> bool:
    """Whether the updated model leaves anything that a force somewhere could explain."""
    if not located:
        return False
    # as if no force had been projected out, as the cost of a place is
    cost = null.prior + squares_of(problem, null, 0.0)
    gain = cost - located[0].cost
    return null.score > settings.consistent or gain > max(settings.worth_naming * cost, settings.gain_cost)


def _could_win(
    problem: Problem, null: Fit, baseline: Candidate, located: Sequence[Located], settings: Settings
) -> bool:
    """Whether a law could be accepted at all: of an updated model that explains the recordings it has to take away more
    prior cost than there may be."""
    enough = max(null.score, baseline.chosen) <= settings.consistent
    return not enough or baseline.prior > settings.gain_cost or depends_on_level(problem, null, located, settings)


def decide(found: Diagnosis, plainly: bool = False) -> Diagnosis:
    """The verdict: a law has to win clearly on data it has not seen, and to explain about as much as a free force;
    `plainly` says that recordings of different level show one and the same force."""
    settings, best = found.settings, (found.ranked[0] if found.ranked else None)
    outlier = _worst_parameter(found)
    quiet = "parameters-only" if _needed_update(found) else "consistent"
    if found.load is not None and (best is None or found.load.score < best.score):
        return replace(found, verdict="missing-physics", place=None)
    named = best is not None and _accepted(found, best)
    if not (named and best is not None and _adequate(found, best)):
        unmeasured = _unmeasured(found, plainly)
        if unmeasured is not None:
            return replace(found, verdict="missing-physics", load=unmeasured)
    rival = _rival(found, named)
    if rival is not None:
        return _free_form(found, rival)
    partly = best is not None and not named and _stands_out(found, best)
    if best is None or not (named or partly):
        if not found.located and found.null.score > FAR * settings.consistent:
            return replace(found, verdict="undetermined", place=None, advice=_more_sensors(found))
        if outlier > settings.parameter_z or _clearly_missing(found):
            return replace(found, verdict="located-not-named", advice=_unnamed(found))
        if untold := too_little(found.problem, found.reduced):
            return replace(found, verdict="undetermined", place=None, advice=untold)
        return replace(found, verdict=quiet, place=None)
    candidate = collapsed(best.candidate, best.recovered, settings)
    refitted = candidate
    if candidate.joint is not None:
        whole = found.problem
        refitted = (
            refit_nonlinear(whole.thinned(600), candidate) if candidate.nonlinear else refit_linear(whole, candidate)
        )
    elif best.located is not None:
        (fit,) = found.problem.fit([best.located.fit.hypothesis], [(candidate.p, candidate.x)])
        if fit is not None:
            refitted = _refitted_part(candidate, fit)
    adequate = named and _adequate(found, best)
    verdict = "missing-physics" if adequate else "located-not-named"
    advice = PART_OF_ALL if partly else PART_OF_A_FORCE
    if adequate:
        advice = beside_laws([refitted], found.problem, found.sigma)
    return replace(found, verdict=verdict, best=refitted, place=best.located, advice=advice)


def _unmeasured(found: Diagnosis, plainly: bool) -> LoadFinding | None:
    """A force nobody recorded beside those that were: any where much is missing, and a harmonic one where less is."""
    given = (found.split, found.reduced, found.located, found.g_rows, found.settings)
    if plainly or _clearly_missing(found):
        return find_unmeasured(*given, found.null.p)
    if found.null.score <= found.settings.consistent:
        return None
    return find_harmonic(*given, found.null_chosen, found.null_score)


def _refitted_part(candidate: Candidate, fit: Fit) -> Candidate:
    """A part of the model (a member, a soft clamp) at its fit to all records, with the covariance of its unknowns."""
    reduced = fit.hypothesis.reduced
    covariance, own = np.asarray(np.linalg.pinv(fit.hessian), dtype=np.float64), own_span(reduced)
    return replace(
        candidate,
        values=own_values(reduced, fit.p),
        p=fit.p,
        fitted=fit.score,
        p_sd=standard_deviations(covariance, len(fit.p)),
        covariance=covariance[own, own] if reduced.members and reduced.members[-1].springs else None,
        converged=fit.converged,
    )


def with_further(
    found: Diagnosis, start: UpdatedModel, located: Sequence[Located], places: Sequence[Place], loud: Louder | None
) -> Diagnosis:
    """The diagnosis with more than one effect where one does not explain enough.

    What one force leaves may be a second effect: it is looked for from the `start` and its places as they were before
    that counted as noise (`loud`).
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

    further = look_further(searched(found.sigma))
    if further is None:
        return found
    adequate = further.terms.chosen <= settings.adequate
    verdict = "missing-physics" if adequate else "located-not-named"
    laws = [term.candidate for term in further.terms.terms]
    advice = beside_laws(laws, start.problem, further.terms.sigma) if adequate else PART_OF_TWO
    lead = further.terms.terms[0]
    return replace(
        found, verdict=verdict, problem=start.problem, best=lead.candidate, place=lead.located, advice=advice,
        rival=None, further=further, sigma=further.terms.sigma,
    )  # fmt: skip


def _compared_in(found: Diagnosis, sigma: float) -> Diagnosis:
    """The laws as they compare in another window exp(-sigma t)."""
    baseline, n_values, null_score = _to_beat(found.split, found.reduced, found.null, found.settings, sigma)
    ranked = compared_in(found.split, found.reduced, found.ranked, sigma, found.settings)
    return replace(
        found, ranked=told_simply(ranked, found.settings), null_chosen=baseline, null_score=null_score,
        n_values=n_values, sigma=sigma,
    )  # fmt: skip


def _to_beat(
    split: Split, reduced: ReducedModel, null: Fit, settings: Settings, sigma: float = 0.0
) -> tuple[Candidate, float, float]:
    """The updated model as a candidate in a window exp(-sigma t), the number of values scores are of, and its score."""
    baseline = null_candidate(split, null, sigma=sigma)
    n_values = effective_values(split.choosing, reduced, sigma)
    return baseline, n_values, score(baseline, split.choosing, settings, n_values)


def _shifted(ranked: Ranked, factor: float, shift: float) -> Ranked:
    """A law as it is judged where squares are `factor` times as large, which raises every score by `shift`."""
    c = ranked.candidate
    return replace(
        ranked,
        candidate=replace(c, chosen=c.chosen * factor, reference=c.reference * factor),
        score=ranked.score + shift,
    )


def _rival(found: Diagnosis, named: bool) -> Rival | None:
    """The free-form force where it beats every named law and is itself what a law has to be to be accepted."""
    if found.problem.load is not None or not (named or _clearly_missing(found)):
        return None
    rival = find_rival(found.split, found.ranked, found.settings, found.n_values, found.sigma, found.null_score)
    return rival if rival is not None and _accepted(found, rival.ranked) else None


def _free_form(found: Diagnosis, rival: Rival) -> Diagnosis:
    """The verdict where the free-form force wins: it goes into the final model, and its class is told."""
    best = refit_rival(found.problem.thinned(600), rival.ranked.candidate)
    return replace(
        found, verdict="located-not-named", best=best, place=rival.ranked.located, advice=rival.advice, rival=rival
    )


def _adequate(found: Diagnosis, best: Ranked) -> bool:
    """Whether a law explains unseen data about as well as a free force at its place does."""
    return best.candidate.chosen <= found.settings.adequate * max(_reference(found, best), 1.0)


def _reference(found: Diagnosis, best: Ranked) -> float:
    reference = best.candidate.reference
    return reference if np.isfinite(reference) else best.candidate.chosen


def _accepted(found: Diagnosis, best: Ranked) -> bool:
    settings = found.settings
    gain = found.null_score - best.score
    chosen = np.log(found.null_chosen.chosen / max(best.candidate.chosen, 1e-12))
    # what the model can do by itself only far outside its priors is as much missing as what it cannot do
    relieved = found.null_chosen.prior - best.candidate.prior
    # a model that explains the recordings as they are lacks nothing that they could show
    enough = max(found.null.score, found.null_chosen.chosen) <= settings.consistent
    won = settings.wins(gain, -np.inf if enough else chosen, relieved)
    needed = settings.nearly if found.null_chosen.chosen < settings.weak else settings.explained
    return bool(won and _share(found, best) >= needed)


def _share(found: Diagnosis, best: Ranked) -> float:
    """Share of what is wrong with the updated model that a law takes away."""
    return share_explained(found.null_score, best, found.ranked, found.n_values)


def _clearly_missing(found: Diagnosis) -> bool:
    """The updated model is far from the noise, or far from it at one level and nearer at another, and a free force
    somewhere takes most of it away."""
    if not found.located:
        return False
    misfit, free = found.null.score, found.located[0].fit.score
    far = misfit > FAR * found.settings.consistent and free < 0.5 * misfit
    return bool(far or depends_on_level(found.problem, found.null, found.located, found.settings))


def _stands_out(found: Diagnosis, best: Ranked) -> bool:
    """Whether a law takes away more than half of an unseen misfit far above the noise, though not what a law has to:
    beside a mesh or an idealisation that is wrong everywhere it is told as the likeliest, not as what is missing."""
    settings, before, after = found.settings, found.null_chosen.chosen, best.candidate.chosen
    far = before > FAR * settings.consistent and after < 0.5 * before
    gain = found.null_score - best.score
    return bool(far and gain > TELLING * settings.gain_cost and _share(found, best) >= settings.partly)


def _unnamed(found: Diagnosis) -> str:
    """What is told where something is missing that no law explains."""
    told = "something is missing at the first place listed, but no law of the catalogue explains it"
    if not depends_on_level(found.problem, found.null, found.located, found.settings):
        return told
    error = relative_errors(found.problem, found.null)
    best, worst = int(np.argmin(error)), int(np.argmax(error))
    names = [r.name for r in found.problem.records]
    return (
        f"{told}; it depends on the level: beyond the noise the updated model leaves {100 * error[worst]:.2g} % of "
        f"{names[worst]} and {100 * error[best]:.2g} % of {names[best]}, which no linear model does"
    )


def _more_sensors(found: Diagnosis) -> str:
    """Why no place could be told, and what would."""
    n = min(r.y.shape[0] for r in found.problem.records)
    return (
        f"the updated model leaves {found.null.score:.3g} times what noise explains, but with {n} response(s) a force "
        f"anywhere explains everything; record at least {n + 1} responses, or name the law at a place you suspect with "
        "femend.diagnose.name_at.name_at"
    )


def _worst_parameter(found: Diagnosis) -> float:
    n = len(found.reduced.model.parameters)
    mean, sd = found.problem.prior(found.reduced)
    return float(np.abs((found.null.p[:n] - mean[:n]) / sd[:n]).max(initial=0.0))


def _needed_update(found: Diagnosis) -> bool:
    hypothesis, p = found.nominal
    (nominal,) = found.problem.fit([hypothesis], [(p, np.zeros(0))], iterations=0)
    return nominal is None or nominal.score > max(found.settings.consistent, 1.1 * found.null.score)
