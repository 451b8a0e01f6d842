"""Diagnosis from responses alone: one force drove the structure, and neither it nor its place was recorded.

Of such a test only the ratios between sensors tell anything. A force that is free on every line is projected out, as
the force of what is missing is while it is located: first every DOF and a motion of the base along every axis are tried
as the drive, then every place for something missing beside it. Of several drives the one beside which least is left is
taken, since what is missing pulls the drive towards itself. Laws that have to be simulated need the force: it is read
off at the drive, and a law found so has to hold with the force free again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.driven.moving_base import as_moving_base, on_moving_base
from femend.diagnose.evidence import fall
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.known_force import Known, last_force
from femend.diagnose.fitting.linear import closed_by
from femend.diagnose.fitting.nonlinear import simulate_candidate
from femend.diagnose.locating.classes import similarity
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import Located, cost_of, locate, refitted
from femend.diagnose.locating.screen import is_many
from femend.diagnose.locating.sensed import sensed_places
from femend.diagnose.settings import Settings
from femend.diagnose.updating.noise import quieter_records
from femend.diagnose.updating.update import UpdatedModel, modelled, updated_by
from femend.errors import RecordingError
from femend.estimate import FitRecord, Hypothesis, Problem
from femend.model import Model, Place, ReducedModel, find_places
from femend.progress import Progress, SilentProgress

__all__ = ["LEAST_SENSORS", "Driven", "holds", "locate_drive", "with_force_read_off", "with_law"]

FloatArray = NDArray[np.float64]

# a drive takes one response and what is missing another; the one left says whether both explain it
LEAST_SENSORS = 3
# drives that go on beside the best one, if they cost less than `Settings.margin` more, times the misfit where that is
# above the noise: what is missing leaves more than noise
DRIVES = 2
# further drives from the beginnings of the records alone: their decay in units of `Problem.scale`, steps and lines
GLANCES, GLANCE, GLANCE_STEPS, GLANCE_LINES = 2, 30.0, 4, 60
# drives that are compared, and the mean squared correlation of what two do to the sensors from which one goes on
COMPARED, ALIKE, TWINS = 16, 0.97, 0.999
# cost, in that of the first drive, from which a drive alone leaves too much to be made up for
HOPELESS = 10.0
# misfit below which the noise was overrated: without a force only its quietest lines tell it, which a force over the
# whole band leaves too few of
UNSURE = 0.85
# misfit up to which one force with something missing beside it can be what drove the structure
ONE_FORCE = 10.0


@dataclass(frozen=True, eq=False)
class Driven:
    """Where the force acts: `start` the updated model with it, `located` what may be missing beside it, and the other
    places `alike` where it may act as well."""

    place: Place
    start: UpdatedModel
    located: list[Located]
    places: list[Place]
    alike: tuple[Place, ...]

    @property
    def explained(self) -> bool:
        """Whether one force, with one more force beside it, explains how the sensors move."""
        least = min([self.start.null.score, *(f.fit.score for f in self.located[:1])])
        return least <= ONE_FORCE


def locate_drive(
    model: Model,
    records: Sequence[FitRecord],
    zeta: float,
    settings: Settings | None = None,
    progress: Progress | None = None,
    note: Callable[[Driven], None] = lambda driven: None,
) -> Driven:
    """The place of the force that drove the structure, the model updated with it, and what is missing beside it.

    `records` hold no forces; `zeta` is the starting damping ratio. The force acts along one axis of a node, as far as
    the deck's own axes go, or is a motion of the base along one. `note` gets every drive that the model was updated
    with, before what is missing beside it is located. Raises RecordingError with fewer than three responses, and where
    no place can be fitted.
    """
    settings, tell = settings or Settings(), progress or SilentProgress()
    fewest = min(records, key=lambda r: r.y.shape[0])
    if fewest.y.shape[0] < LEAST_SENSORS:
        raise RecordingError(
            f"recording {fewest.name!r} has {fewest.y.shape[0]} response(s) and no force: without a force at least "
            f"{LEAST_SENSORS} responses are needed; record more, or the force",
            recording=fewest.name,
        )
    tell.start("reduce the model")
    bare, reduced, problem = modelled(model, records, zeta)
    places = sensed_places(problem, reduced, find_places(bare))
    drives = [place for place in places if place.kind in ("ground", "base") and place.n_w == 1]
    tell.start("locate the drive", len(drives))
    (resting,) = problem.fit([Hypothesis(reduced, np.zeros((0, reduced.r)))], iterations=0)
    assert resting is not None, "a model at rest has a misfit"
    found = _forces_first(locate(problem, reduced, drives, resting), settings)
    if not found:
        raise RecordingError(
            f"no force along an axis of a node explains how the sensors of {records[0].name!r} move relative to each "
            "other; check the sensors' nodes and directions",
            recording=records[0].name,
        )
    reach = settings.margin * max(found[0].fit.score, 1.0)
    near = [one for one in found if one.cost < found[0].cost + reach]
    place, p = found[0].place, found[0].fit.p
    tell.start("locate what is missing", len(places))
    if found[0].fit.score > settings.consistent:
        chosen = _unlike(problem, reduced, [(one.place, one.fit.p) for one in near], DRIVES)
        glance = [] if is_many(drives) else _at_a_glance(problem, reduced, drives)
        chosen += _unlike(problem, reduced, glance, GLANCES, [place for place, _ in chosen])
        if len(chosen) > 1:
            place, p = _likeliest(bare, problem, chosen, places, settings, note)
    best = _beside(bare, problem, place, p, places, note)
    if best is None:
        raise RecordingError("the model cannot be solved with the force that was located; check its mass and stiffness")
    quieter = quieter_records(best.start.problem, best.located, UNSURE)
    best = best if quieter is None else _quieter(best, quieter)
    return replace(best, alike=tuple(one.place for one in near if one.place is not place))


def _forces_first(found: list[Located], settings: Settings) -> list[Located]:
    """Places of the drive in rising order of cost, but a motion of the base behind the best force at a node unless it
    alone explains the recordings, or costs clearly less."""
    forces = [one for one in found if one.place.kind != "base"]
    if not forces or found[0].place.kind != "base" or found[0].fit.score <= settings.consistent:
        return found
    least = forces[0].cost - settings.margin * max(found[0].fit.score, 1.0)
    return sorted(found, key=lambda one: one.place.kind == "base" and one.cost >= least)


def _likeliest(
    model: Model,
    problem: Problem,
    chosen: Sequence[tuple[Place, FloatArray]],
    places: Sequence[Place],
    settings: Settings,
    note: Callable[[Driven], None],
) -> tuple[Place, FloatArray]:
    """The drive beside which least is left of the record of middle level, with unknowns of the model there; those that
    alone leave far more of it than the first does are not looked into."""
    order = sorted(problem.records, key=lambda r: r.level)
    middle = problem.on([order[len(order) // 2]])
    starts = [(place, updated_by(model, middle.driven_at(place), _row(place), p)) for place, p in chosen]
    known = [(place, start) for place, start in starts if start is not None]
    if known:
        note(_alone(*known[0], places))
    least = min((start.null.cost for _, start in known), default=0.0)
    tried = [_placed(place, start, places) for place, start in known if start.null.cost <= HOPELESS * least]
    best = min(tried, key=lambda one: _least(one, settings), default=None)
    return chosen[0] if best is None else (best.place, best.start.null.p)


def _quieter(driven: Driven, records: Sequence[FitRecord]) -> Driven:
    """The same with other noise."""
    problem = driven.start.problem.on(records)
    null = driven.start.null
    (again,) = problem.fit([null.hypothesis], [(null.p, null.x)])
    start = replace(driven.start, problem=problem, null=null if again is None else again)
    return replace(driven, start=start, located=refitted(problem, driven.located))


def _at_a_glance(problem: Problem, reduced: ReducedModel, drives: Sequence[Place]) -> list[tuple[Place, FloatArray]]:
    """The drives, those first that explain best how the records begin, with the deck's unknowns: before waves have come
    back neither what is missing nor what members differ in shows."""
    plain = problem.sparing(GLANCE_LINES).untuned()
    bare = reduced if reduced.form is None else reduced.bare()
    hypotheses = [hypothesis_of(place, bare) for place in drives]
    sigma = GLANCE * problem.scale()
    fits = plain.fit(hypotheses, sigma=sigma, iterations=GLANCE_STEPS)
    ranked = [(cost_of(plain, fit, sigma), i) for i, fit in enumerate(fits) if fit is not None]
    return [(drives[i], problem.prior(reduced)[0]) for _, i in sorted(ranked)]


def _unlike(
    problem: Problem,
    reduced: ReducedModel,
    ranked: Sequence[tuple[Place, FloatArray]],
    count: int,
    beside: Sequence[Place] = (),
) -> list[tuple[Place, FloatArray]]:
    """The first `count` of the places that move the sensors unlike each other and are no twins of those `beside`."""
    first = list(ranked[:COMPARED])
    few = problem.on(problem.records[:1]).thinned(GLANCE_LINES)
    everything = [*beside, *(place for place, _ in first)]
    # what stands for a place at a glance need not do so to the end
    least = np.where(np.arange(len(everything)) < len(beside), TWINS, ALIKE)
    like = similarity(few, reduced, everything, problem.prior(reduced)[0]) > least
    taken = list(range(len(beside)))
    for i in range(len(beside), len(everything)):
        if len(taken) < len(beside) + count and not like[i, taken].any():
            taken.append(i)
    return [first[i - len(beside)] for i in taken[len(beside) :]]


def _alone(drive: Place, start: UpdatedModel, places: Sequence[Place]) -> Driven:
    """A drive with the model updated under it, before places are tried beside it."""
    return Driven(drive, start, [], list(places), ())


def _beside(
    model: Model, problem: Problem, drive: Place, p: FloatArray, places: Sequence[Place], note: Callable[[Driven], None]
) -> Driven | None:
    """The model updated from unknowns `p` with a force at the place `drive`, and the places of what is missing beside
    it."""
    moving = as_moving_base(model, drive) if drive.kind == "base" else None
    if moving is None:
        start = updated_by(model, problem.driven_at(drive), _row(drive), p)
    else:
        # `p` has one mode less
        under = problem.driven_at(moving).with_modes(problem.n_tuned + 1)
        start = updated_by(model, under, (), p, partial(on_moving_base, moving))
    if start is None:
        return None
    note(_alone(moving or drive, start, places))
    return _placed(moving or drive, start, places)


def _row(drive: Place) -> list[int]:
    """Rows of the g-set where the force acts; none of a motion of the base, which acts at many."""
    return [] if drive.kind == "base" else [int(drive.g_rows[0][0])]


def _placed(drive: Place, start: UpdatedModel, places: Sequence[Place]) -> Driven:
    """The places of what is missing beside a drive."""
    others = [place for place in places if not _is(place, drive)]
    return Driven(drive, start, locate(start.problem, start.reduced, others, start.null), others, ())


def _is(place: Place, drive: Place) -> bool:
    """Whether a force at a place is the drive itself."""
    return place is drive or (
        place.kind == drive.kind and place.nodes == drive.nodes and place.direction == drive.direction
    )


def _least(one: Driven, settings: Settings) -> float:
    """Cost of a drive: alone where it explains all, else with what is missing beside it."""
    alone = one.start.null.cost
    if one.start.null.score <= settings.consistent or not one.located:
        return alone
    return min(alone, one.located[0].cost)


def with_force_read_off(driven: Driven, beside: Located) -> UpdatedModel | None:
    """The model updated under the force that is read off at the drive, as if it had been recorded; None where the model
    cannot be solved so, and for a motion of the base, which is no force at a DOF.

    It is read off beside a free force at the place `beside`, so that it holds nothing of what is missing there. What a
    law does that depends on the level has to be simulated, and for that the force has to be known.
    """
    start, drive = driven.start, driven.place
    if drive.kind == "base":
        return None
    problem = start.problem.driven_at(None)
    hypothesis = hypothesis_of(beside.place, start.reduced, (drive,))
    (fit,) = problem.fit([hypothesis], [(beside.fit.p, np.zeros(0))])
    if fit is None:
        return None
    rows = np.array(_row(drive))
    signs = np.asarray(drive.g_values[0], dtype=np.float64)
    read = zip(problem.records, last_force(problem, fit), strict=True)
    records = [replace(r, u=u[None, :], in_rows=rows, in_signs=signs) for r, u in read]
    known = problem.on(records)
    p = start.null.p
    (null,) = known.fit([start.null.hypothesis], [(p, np.zeros(0))])
    return None if null is None else replace(start, problem=known, null=null)


def with_law(
    driven: Driven, known: Problem, candidate: Candidate, records: Sequence[FitRecord]
) -> tuple[Problem, Hypothesis, FloatArray] | None:
    """The problem of `records` in which the force at the drive is free, with the law of a candidate and its fit
    coordinates; None for what has no law, cannot be followed, or is simulated in a cut of the model.

    What a simulated law does under the force read off (the records of `known`, by name) is among the recorded forces
    there. So no law is judged by a force that was read off to suit it.
    """
    joint = candidate.joint
    if joint is None or candidate.physics is None:
        return None
    if not candidate.nonlinear:
        return driven.start.problem.on(records), closed_by(candidate), candidate.x
    if joint.place.release is not None:
        return None
    read_off = {r.name: r for r in known.records}
    forces = {r.name: (-simulate_candidate(known, candidate, read_off[r.name]).f,) for r in records}
    if not all(np.isfinite(f).all() for (f,) in forces.values()):
        return None
    law = Known((joint.place,), forces)
    alone = Hypothesis(joint.reduced, np.zeros((0, joint.reduced.r)))
    return driven.start.problem.on([law.on(record) for record in records]), alone, np.zeros(0)


def holds(driven: Driven, known: Problem, candidate: Candidate, settings: Settings) -> bool:
    """Whether a law found under the force read off explains the sensors' motion, with the force free again, by as much
    better than the updated model as a law has to."""
    closed = with_law(driven, known, candidate, driven.start.problem.records)
    if closed is None:
        return False
    problem, hypothesis, x = closed
    # as it was found: a fit that goes on from there would be another finding
    (fit,) = problem.fit([hypothesis], [(candidate.p, x)], iterations=0)
    null = driven.start.null
    if fit is None:
        return False
    return settings.wins(null.cost - fit.cost, fall(null.score, fit.score), null.prior - fit.prior)
