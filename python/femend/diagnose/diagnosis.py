"""The diagnosis: update, detect, locate, name, decide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from femend.diagnose.deciding.as_read import as_read, read_at, settles
from femend.diagnose.deciding.contradicted import nothing_followed
from femend.diagnose.deciding.more_effects import with_further
from femend.diagnose.deciding.no_model import no_model
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.so_far import SoFar
from femend.diagnose.deciding.verdict import decide
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.loads.loads import try_loads
from femend.diagnose.loads.unmeasured import plainly_unmeasured
from femend.diagnose.locating.alike import with_look_alikes
from femend.diagnose.locating.directions import in_other_directions
from femend.diagnose.locating.locate import Located, cost_of, locate, shortlist
from femend.diagnose.locating.members_there import members_there
from femend.diagnose.locating.sensed import sensed_places
from femend.diagnose.locating.split import split_records, weaker_first
from femend.diagnose.naming.between_members import with_pairs_between
from femend.diagnose.naming.followed import AsRead
from femend.diagnose.naming.judge import Given, ToBeat, compared_in, to_beat
from femend.diagnose.naming.name import linear_alone, name_physics
from femend.diagnose.naming.ranked import Ranked, tempered, told_simply
from femend.diagnose.naming.shares import unclear
from femend.diagnose.naming.stretched import with_other_ends
from femend.diagnose.recordings.crossing import as_sensors_are
from femend.diagnose.recordings.put_right import put_right
from femend.diagnose.settings import Settings
from femend.diagnose.several.best_place import at_the_best_place
from femend.diagnose.several.law_elsewhere import where_it_explains_more
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.second import hidden_by_each_other, look_further
from femend.diagnose.updating.each_alone import unlike
from femend.diagnose.updating.levels import depends_on_level
from femend.diagnose.updating.nearer import nearer
from femend.diagnose.updating.noise import louder, quieter_records
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.estimate import FitRecord
from femend.model import Model, Place, find_places
from femend.model.beddings.bed_places import bed_places
from femend.progress import Progress, SilentProgress
from femend.threads import one_blas_thread

__all__ = ["diagnose_records", "explain"]


@one_blas_thread
def diagnose_records(
    model: Model,
    records: Sequence[FitRecord],
    zeta: float,
    progress: Progress | None = None,
    settings: Settings | None = None,
    so_far: SoFar | None = None,
    contradicts: Callable[[UpdatedModel], bool] | None = None,
) -> Diagnosis:
    """Diagnoses a model against its fit records (accelerations, measured forces, from rest).

    `zeta` is the starting damping ratio; `so_far` is filled on the way. `contradicts` is asked of the updated model
    whether deck and recordings contradict each other as a whole; then nothing is looked for that neither the updated
    model nor a force at one place comes near. Raises RecordingError where there is nothing to fit.
    """
    settings, so_far = settings or Settings(), so_far or SoFar()
    tell = progress or SilentProgress()
    start = so_far.start = update_model(model, records, zeta, tell.start)
    contradicted = contradicts is not None and contradicts(start)
    if contradicted and (nothing := nothing_followed(start)) is not None:
        return nothing
    tell.start("list the places")
    listed = [*find_places(start.reduced.model), *bed_places(start.reduced, start.problem.band[1])]
    places = sensed_places(start.problem, start.reduced, listed)
    tell.start("locate what is missing", len(places))
    located = locate(start.problem, start.reduced, places, start.null)
    quieter = quieter_records(start.problem, located)
    if quieter is not None:
        start = update_model(start.reduced.model, quieter, zeta)
        located = locate(start.problem, start.reduced, places, start.null)
    located, places = with_pairs_between(start, located, places)
    off, start, located = put_right(start, located, places, zeta, settings)
    start, located = as_sensors_are(start, located, places)
    so_far.off = off
    so_far.places(start, located)
    begun = nearer(start, located, settings)
    out = explain(begun, located, places, settings, tell, so_far=so_far, contradicted=contradicted)
    out = so_far.found = out if off is None else replace(out, off=off)
    tell.done()
    return out


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
    contradicted: bool = False,
) -> Diagnosis:
    """Names what is missing at the places `located` (of all `places`), or says that nothing is; `further` effects are
    looked for where one does not explain enough. `so_far` is filled on the way; where deck and recordings are
    `contradicted` by each other, no law is tried that a force at one place does not stand for."""
    tell, so_far = tell or SilentProgress(), so_far or SoFar()
    loud = louder(start, located)
    now, at = (start, located) if loud is None else (loud.start, loud.located)
    so_far.places(now, at)
    states = unlike(start, settings)
    far = contradicted and start.null.score > settings.far
    hopeless = bool(states or far) and not any(one.fit.score <= settings.adequate for one in located)
    decided = _one_effect(_Task(now, list(at), places, settings, tell, so_far, hopeless))
    if hopeless and not states:
        return decided  # nor do several forces make up for what is wrong with all of it
    if states and decided.best is None:
        if decided.verdict == "located-not-named" and not hopeless:
            # one force at one place explains all of them, too
            return replace(decided, advice="; ".join(filter(None, [decided.advice, states])))
        # nor is there a force that nobody recorded: each recording is explained without
        return replace(decided, verdict="undetermined", place=None, load=None, advice=states)
    if untold := no_model(decided, loud):
        return replace(decided, verdict="undetermined", place=None, advice=untold)
    told = decided.verdict in ("missing-physics", "located-not-named")
    # where nothing is told two effects may hide each other from every single law, but not from the misfit
    wrong = told or start.null.score > settings.far
    if not (further and wrong) or decided.by_load or now.problem.load is not None:
        return decided
    if decided.rival is not None and decided.rival.ranked.candidate.chosen <= settings.adequate:
        return decided  # one force at one place explains what was not used to fit it
    if decided.read is not None and decided.read.law is not None:
        return decided  # so does the one that was read, with a law behind it
    tell.start("look for more")
    so_far.decided = decided
    search = look_further if told else hidden_by_each_other
    return with_further(decided, start, located, places, loud, search)


@dataclass(frozen=True, eq=False)
class _Task:
    """One effect to be named: from an updated model and the places found for it, of all `places`; `tell` is told of the
    steps, and `so_far` of what is settled. Naming may be `hopeless`: no force explains recordings that are not those of
    one structure, or that contradict the deck as a whole."""

    start: UpdatedModel
    located: list[Located]
    places: Sequence[Place]
    settings: Settings
    tell: Progress
    so_far: SoFar
    hopeless: bool = False

    @cached_property
    def given(self) -> Given:
        """What laws are tried on."""
        start = self.start
        split = split_records(start.problem, start.null, self.located)
        return Given(split, start.reduced, start.g_rows, start.null.p, self.settings)


def _one_effect(task: _Task) -> Diagnosis:
    """The verdict on what one law at one place, or another load, explains."""
    start, located, settings, given = task.start, task.located, task.settings, task.given
    problem, reduced, null = start.problem, start.reduced, start.null
    alone = to_beat(given, null)
    task.tell.start("try loads")
    explained = _explained_at_the_ground(task)
    load = try_loads(problem, given, null, alone, turned=explained)
    short = with_look_alikes(problem, reduced, shortlist(located), task.places, settings)
    task.tell.start("name it", len(short))
    ranked, sigma, read = list[Ranked](), 0.0, None
    # a load that explains the recordings leaves nothing to name
    settled = load is not None and load.fit.score <= settings.consistent
    worth = not settled and not task.hopeless and _worth_naming(task) and _could_win(task, alone.candidate)
    plainly = worth and plainly_unmeasured(given, located)
    if worth and not plainly:
        given, alone, ranked, sigma, read = _named(task, short, alone)
        ranked = with_other_ends(given, ranked) if sigma == 0 else ranked
        task.so_far.ranked = list(ranked)
        if load is None and explained and sigma == 0 and _lacking(alone, ranked, settings):
            # no law is behind the force that explains so much: it may stand in for a load that acts elsewhere after all
            task.tell.start("try loads")
            load = try_loads(problem, given, null, alone)
        if sigma > 0:
            alone = to_beat(given, null, sigma)
    ranked = told_simply(ranked, settings)
    task.tell.start("fit the final model")
    undecided = Diagnosis(
        "", problem, given.split, reduced, start.nominal, null, alone.candidate, alone.score, located, ranked,
        tempered(ranked, alone.score), None, short[0] if short else None, load, "", settings, start.g_rows,
        alone.n_values, sigma,
    )  # fmt: skip
    if task.hopeless and load is None:
        return replace(undecided, verdict="undetermined", place=None)
    return as_read(_placed(decide(undecided, plainly), task.places), read)


def _explained_at_the_ground(task: _Task) -> bool:
    """Whether one force against the ground explains the recordings, and hardly any other place more. It cannot stand in
    for a load that acts elsewhere than recorded, though it can for one turned round where it is; one between the two
    places, or at a joint between them, can."""
    settings, located = task.settings, task.located
    near = located[0].cost + settings.reach if located else np.inf
    return any(f.place.kind == "ground" and f.fit.score < settings.adequate and f.cost <= near for f in located)


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


def _lacking(alone: ToBeat, ranked: Sequence[Ranked], settings: Settings) -> bool:
    """Whether no law takes nearly all away, or the best one, however much it takes, leaves far more than noise."""
    far = bool(ranked) and ranked[0].candidate.chosen > settings.far
    return far or unclear(alone, ranked, settings)


def _named(
    task: _Task, short: Sequence[Located], alone: ToBeat
) -> tuple[Given, ToBeat, list[Ranked], float, AsRead | None]:
    """Laws at the places `short` and, as long as none takes away nearly all of what the updated model leaves, `alone`,
    at further kinds of places and then in directions not tried, the best of them at its own node too, in rising order
    of score, and the window they are compared in; with what they were tried on, and what they had to beat there, and
    what was read at the best place where no law could be followed."""
    start, settings, given = task.start, task.settings, task.given
    naming = partial(name_physics, tell=task.tell.advance, note=task.so_far.ranked.extend)
    clamps = [*short, *task.located]
    ranked, sigma = naming(given, short, alone.score, clamps=clamps)
    lost = _lost_on_the_way(task, alone, ranked, sigma)
    read = read_at(given, short[0]) if lost else None
    if settles(read, alone.candidate.chosen, settings):
        return given, alone, ranked, sigma, read
    weaker = weaker_first(given.split) if lost else None
    if weaker is not None:
        task.tell.start("name it", len(short))
        again = replace(given, split=weaker)
        there = to_beat(again, start.null)
        found, window = naming(again, short, there.score, clamps=clamps)
        if window == 0 and _explains(found, settings) and not unclear(there, found, settings):
            return again, there, found, window, read
    tried = [one.place for one in short]
    asked: list[Ranked] = []

    def more(ranked: list[Ranked], places: Sequence[Located], reach: Settings) -> tuple[list[Ranked], float]:
        """The laws with those at further `places`, and the window they are compared in."""
        further = with_look_alikes(start.problem, start.reduced, places, task.places, reach)
        tried.extend(one.place for one in further)
        task.tell.start("name it", len(further))
        beaten = min([alone.score, *(r.score for r in ranked)])
        new, window = naming(replace(given, settings=reach), further, beaten, clamps=())
        ranked = sorted([*ranked, *new], key=lambda r: r.score)
        return compared_in(given, ranked, window) if window > 0 else ranked, window

    def at_its_own(ranked: list[Ranked], sigma: float) -> tuple[list[Ranked], float]:
        """The same with those at nodes where the best law leaves less, each best law once."""
        if sigma > 0 or not ranked or any(ranked[0] is one for one in asked):
            return ranked, sigma
        asked.append(ranked[0])
        better = where_it_explains_more(given, task.places, ranked, alone.score)
        return more(ranked, better, settings) if better else (ranked, sigma)

    ranked, sigma = at_its_own(ranked, sigma)
    all_kinds = replace(settings, places=settings.kinds)
    # of a direction that never came to the fore, nonlinear laws are tried at all kinds of places
    in_others = partial(in_other_directions, start.problem, start.reduced, task.places, start.null)
    for wider, reach in ((_untried, all_kinds), (in_others, replace(all_kinds, nonlinear_places=settings.kinds))):
        if sigma > 0 or not unclear(alone, ranked, settings):
            break
        ranked, sigma = at_its_own(*more(ranked, wider(task.located, tried), reach))
    if sigma == 0 and (unclear(alone, ranked, settings) or (ranked and settings.bends(ranked[0].candidate.prior))):
        members = members_there(start.problem, start.reduced, task.places, task.located, tried)
        ranked, sigma = more(ranked, members, settings) if members else (ranked, sigma)
    return given, alone, ranked, sigma, read


def _lost_on_the_way(task: _Task, alone: ToBeat, ranked: Sequence[Ranked], sigma: float) -> bool:
    """Whether one force at one place explains all recordings, and no law does: a strong motion that jumps cannot be
    followed from where a law begins, and the weaker recordings bring it near. Where a linear law comes so near to what
    a free force does that no nonlinear one was tried, none was lost."""
    settings, located = task.settings, task.located
    if sigma > 0 or not located or located[0].fit.score > settings.consistent:
        return False
    if linear_alone([r.candidate for r in ranked], settings):
        return False
    return not _explains(ranked, settings) or unclear(alone, ranked, settings)


def _explains(ranked: Sequence[Ranked], settings: Settings) -> bool:
    """Whether the best law explains what it has not seen to the noise."""
    return bool(ranked) and ranked[0].candidate.chosen <= settings.consistent


def _untried(located: Sequence[Located], tried: Sequence[Place]) -> list[Located]:
    """Places whose laws are worth fitting, without those tried already."""
    return [one for one in shortlist(located) if not any(one.place is p for p in tried)]


def _worth_naming(task: _Task) -> bool:
    """Whether the updated model leaves anything that a force somewhere could explain."""
    null, settings = task.start.null, task.settings
    if not task.located:
        return False
    # as if no force had been projected out, as the cost of a place is
    cost = cost_of(task.start.problem, null, 0.0)
    gain = cost - task.located[0].cost
    return null.score > settings.consistent or gain > max(settings.worth_naming * cost, settings.gain_cost)


def _could_win(task: _Task, alone: Candidate) -> bool:
    """Whether a law could be accepted at all: of an updated model that explains the recordings, on the choosing ones as
    `alone`, it has to take away more prior cost than there may be."""
    null, settings = task.start.null, task.settings
    enough = max(null.score, alone.chosen) <= settings.consistent
    if not enough or alone.prior > settings.gain_cost:
        return True
    return depends_on_level(task.start.problem, null, task.located, settings)
