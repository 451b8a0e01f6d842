"""The first step of every diagnosis: the model with its parameters updated inside their priors, nothing added."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from femend.diagnose.fitting.predict import predict_model
from femend.diagnose.settings import AT_NOISE, CLEARLY
from femend.diagnose.updating.damping_level import at_its_level
from femend.diagnose.updating.loud_sensor import loud_sensor
from femend.errors import ModelError, RecordingError
from femend.estimate import (
    Fit,
    FitRecord,
    ForcesBeside,
    Hypothesis,
    Problem,
    at_work,
    check_sampling,
    further_band,
    modelled_band,
    used_band,
    with_across,
    without_crossed,
    without_still,
)
from femend.estimate.fit import TUNED_ABOVE
from femend.estimate.lines import band_power
from femend.model import Model, ReducedModel, affordable_refinement, form_errors, reduce_model
from femend.model.known_mesh import Unresolved
from femend.model.mesh.form_errors import MODE_SD
from femend.model.mesh.resolution import unresolved
from femend.model.reduced.unsolvable import no_solution
from femend.threads import one_blas_thread

__all__ = [
    "DRAWN",
    "UpdatedModel",
    "drawn_starts",
    "modelled",
    "sensors_in_doubt",
    "update_model",
    "updated_by",
]

FloatArray = NDArray[np.float64]

# sets of parameters drawn from their priors from which an update starts beside the deck's
DRAWN = 7
# error of the deck as it is, as a share of that of the refined and updated one, below which its own mesh is taken
AS_GIVEN = 0.5
# standard deviations that no share of motion across a sensor, or of its own, is beyond
SENSORS_AT_MOST = 4.0


@dataclass(frozen=True, eq=False)
class UpdatedModel:
    """The problem of the fit recordings, the reduced model, and its fit without anything added; `drawn` is the deck's
    model as it stands where the reduced one is that of a finer mesh, or without what its beams leave out."""

    problem: Problem
    reduced: ReducedModel
    null: Fit
    g_rows: list[int]
    drawn: Hypothesis | None = None

    @property
    def nominal(self) -> tuple[Hypothesis, FloatArray]:
        """The deck as it is, and its unknowns."""
        at = self.null.hypothesis if self.drawn is None else self.drawn
        return at, self.problem.as_drawn(at.reduced)

    @cached_property
    def crossing(self) -> UpdatedModel | None:
        """The same model updated where sensors may hold shares of the motion across them and be off by such of their
        own; None where there is none that counts, and where the model explains the recordings as it is."""
        return _picking_up(self)


@one_blas_thread
def update_model(
    model: Model, records: Sequence[FitRecord], zeta: float, tell: Callable[[str], None] = lambda step: None
) -> UpdatedModel:
    """Fits parameters, frequency factors and damping ratios (prior median `zeta`) of the model as it is, but for its
    mesh: linear shells and solids are refined where that is cheap enough. `tell` is told each step by name.

    Raises RecordingError where there is nothing to fit or the sampling is too slow for the modes in the band, and
    ModelError where the model has no solution at the deck's values.
    """
    tell("reduce the model")
    given = modelled(model, records, zeta)
    tell("update the parameters")
    start = _updated(*given)
    start = _on_its_own_mesh(start, records, zeta) or start
    crossing = start.crossing if _by_sensors(start) else None
    if crossing is None or not _explains(crossing.null, start.null):
        return start
    # one sensor that is off by itself explains more simply what all that are off a little do
    loud = loud_sensor(start.problem, start.null)
    return crossing if loud is None else update_model(start.reduced.model, loud, zeta)


def _by_sensors(start: UpdatedModel) -> bool:
    """Whether what sensors may pick up, or be off by, is large enough to be all that an updated model leaves: with |r|
    what it leaves at best, shares that add up to c leave |r| - |c| at least, whatever the model's unknowns."""
    reduced, null = start.reduced, start.null
    lines = sensors_in_doubt(start.problem, null).lines(reduced)
    shown = sum(line.picked_up.most for line in lines if line.picked_up is not None)
    values = sum(line.share * line.Y.size for line in lines)
    return bool(np.sqrt(null.cost - null.prior) - SENSORS_AT_MOST * np.sqrt(shown) <= np.sqrt(AT_NOISE * values))


def _picking_up(start: UpdatedModel) -> UpdatedModel | None:
    null, before = start.null, start.problem
    if null.score <= AT_NOISE and null.prior <= CLEARLY:
        return None
    # resonances of what moves across are those of the updated model; of one that is fitted with it once more
    problem = sensors_in_doubt(before, null)
    if not _has_across(problem):
        return None
    # from afar, since without shares the model was bent for them, and from where it was
    far = problem.continuation(null.hypothesis, drawn_starts(problem, start.reduced))
    (near,) = problem.fit([null.hypothesis], [(null.p, null.x)])
    found = min((f for f in (far, near) if f is not None), key=lambda f: f.cost, default=None)
    if found is None:
        return None
    problem = sensors_in_doubt(before, found)
    (again,) = problem.fit([null.hypothesis], [(found.p, found.x)])
    return None if again is None else replace(start, problem=problem, null=again)


def _has_across(problem: Problem) -> bool:
    """Whether sensors may pick up something that counts."""
    return any(r.across is not None for r in problem.records)


def _explains(null: Fit, other: Fit) -> bool:
    """Whether an updated model explains the recordings to the noise within its priors, and clearly better than
    another."""
    return null.score <= AT_NOISE and null.prior <= CLEARLY and null.cost <= other.cost - CLEARLY


def _updated(model: Model, reduced: ReducedModel, problem: Problem) -> UpdatedModel:
    null = problem.continuation(Hypothesis(reduced, np.zeros((0, reduced.r))), drawn_starts(problem, reduced))
    if null is None:
        raise no_solution(model)
    problem, null = at_its_level(problem, null)
    g_rows = _rows(problem.records)
    return UpdatedModel(problem, reduced, null, g_rows, _drawn(reduced, problem.band[1], g_rows))


def _on_its_own_mesh(start: UpdatedModel, records: Sequence[FitRecord], zeta: float) -> UpdatedModel | None:
    """The deck updated with its own mesh, where that explains the recordings to the noise without leaving its priors,
    and clearly better than the refined one of `start` does, or where the deck as it is given leaves far less of them
    than the refined one updated; None otherwise.

    No structure has the error of a mesh; recordings that were simulated with the deck have, and what the refined model
    lacks of it (half of the stiffness that a spring sees at a node of shells) would be told as missing. A deck that has
    to leave its priors for it only makes up for what is missing.
    """
    drawn = _as_built(start)
    if drawn is None or (start.null.score <= AT_NOISE and start.null.prior <= CLEARLY):
        return None
    own = _updated(*modelled(drawn, records, zeta, as_built_in=start.problem.band))
    if not _explains(own.null, start.null) and not _better_as_given(start):
        return None
    # the refined model's band ends where its mesh does; the deck's own has no error here
    _, whole = _excited([at_work(r) for r in records])
    if whole[1] > start.problem.band[1]:
        own = _updated(*modelled(drawn, records, zeta, as_built_in=whole))
    return replace(own, reduced=replace(own.reduced, model=replace(own.reduced.model, simulated=True)))


def _excited(records: Sequence[FitRecord]) -> tuple[tuple[float, float], tuple[float, float]]:
    """The band (Hz) of the records, and that with resonances just above it that they show."""
    plain = used_band(records)
    return plain, further_band(plain, records)


def _as_built(start: UpdatedModel) -> Model | None:
    """The deck's model with the errors of its mesh, where the updated one is without so much of them that it shows."""
    model, form = start.reduced.model, start.reduced.form
    if model.refines is not None:
        return model.refines
    shows = form is not None and any(f <= start.problem.band[1] and abs(e) > MODE_SD / 2 for f, e in form.beams)
    return model if shows else None


def _better_as_given(start: UpdatedModel) -> bool:
    """Whether the deck as it is leaves less of the recordings, as a whole, than `AS_GIVEN` of what the updated model
    leaves: no update is worth that."""
    records = [r for r in start.problem.records if r.frf is None and r.driven]
    none = np.zeros(0)

    def left(hypothesis: Hypothesis, p: FloatArray) -> float:
        return sum(
            float(((predict_model(start.problem, hypothesis, p, none, r) - r.y) ** 2).sum() / (r.y**2).sum())
            for r in records
        )

    return bool(records) and left(*start.nominal) < AS_GIVEN**2 * left(start.null.hypothesis, start.null.p)


def modelled(
    model: Model, records: Sequence[FitRecord], zeta: float, *, as_built_in: tuple[float, float] | None = None
) -> tuple[Model, ReducedModel, Problem]:
    """The model, refined where that is cheap enough, its reduction without what its beams are known to leave out, for
    the band of the records, with resonances just above it that they show where the mesh follows them, and the problem
    of what the records hold but rest, whose band ends where the mesh no longer follows the modes (`Model.unresolved`
    then says so); raises RecordingError as `update_model`.

    All as drawn where the structure is taken to have the mesh's errors (recordings simulated with the deck): in the
    band `as_built_in` (Hz) of the model it is held against, for in a narrower one much less has to be explained.
    """
    if not records:
        raise RecordingError('no recording with role = "fit"; name at least one')
    records = [at_work(r) for r in records]
    built, g_rows = as_built_in is not None, _rows(records)
    plain, shown = _excited(records)
    band = shown if as_built_in is None else as_built_in
    used = _refined(model, records, band, g_rows, built)
    if used[3] is not None and band[1] > plain[1]:
        # what lies above the force's power is worth no mesh that does not follow it
        used = _refined(model, records, plain, g_rows, built)
    model, reduced, band, missed = used
    check_sampling(records, band, reduced.freq)
    if missed is not None:
        model, band = _left_out(model, records, band, missed)
        reduced = reduce_model(model, band[1], g_rows)
    if band[1] > plain[1]:
        records = [replace(r, known_to=plain[1]) for r in records]
    records = without_still(without_crossed(records, reduced, band, zeta))
    reduced = form_errors(reduced, band[1], mesh_as_built=built).on(reduced)
    n_tuned = max(1, int((reduced.freq < TUNED_ABOVE * band[1]).sum()))
    return model, reduced, Problem(records, band, zeta, n_tuned)


def _refined(
    model: Model, records: Sequence[FitRecord], band: tuple[float, float], g_rows: list[int], as_built: bool
) -> tuple[Model, ReducedModel, tuple[float, float], Unresolved | None]:
    """The model, refined for a `band` (Hz) where that is cheap enough and it is not taken `as_built`, its reduction,
    the part of the band that it has modes for, and what its mesh does not follow there."""
    finer = None if as_built or model.refines is not None else affordable_refinement(model, band[1])
    model = finer or model
    reduced = reduce_model(model, band[1], g_rows)
    band = modelled_band(band, records, reduced.freq)
    return model, reduced, band, None if as_built else unresolved(reduced, band)


def sensors_in_doubt(problem: Problem, fit: Fit, beside: ForcesBeside | None = None) -> Problem:
    """The problem with what sensors may pick up of motion across them, or be off by of their own, as the model of `fit`
    predicts it under the recorded forces and those `beside`; as it is where the model cannot be solved there."""
    reduced = fit.hypothesis.reduced
    try:
        modal = problem.modes(reduced, fit.p)
    except ModelError:
        return problem
    return problem.on(with_across(problem.records, reduced, problem.band, modal, beside))


def updated_by(
    model: Model,
    problem: Problem,
    rows: Sequence[int],
    p: FloatArray,
    dress: Callable[[ReducedModel], ReducedModel] = lambda reduced: reduced,
) -> UpdatedModel | None:
    """The `model` of `modelled`, with what `dress` puts on it, updated from unknowns `p`, and from the deck's, in a
    basis that also holds what forces at `rows` of the g-set do at rest; None where it cannot be solved."""
    g_rows = sorted({*_rows(problem.records), *rows})
    reduced = reduce_model(model, problem.band[1], g_rows)
    drawn = _drawn(reduced, problem.band[1], g_rows)
    reduced = dress(form_errors(reduced, problem.band[1]).on(reduced))
    alone = Hypothesis(reduced, np.zeros((0, reduced.r)))
    # what members differ in may be told by one unknown more or less in the larger basis
    fits = len(p) == len(problem.prior(reduced)[0])
    near = problem.fit([alone], [(p, np.zeros(0))])[0] if fits else None
    found = [fit for fit in (near, problem.continuation(alone, drawn_starts(problem, reduced))) if fit is not None]
    if not found:
        return None
    null = min(found, key=lambda fit: fit.cost)
    if drawn is not None:
        own = dress(drawn.reduced)
        drawn = Hypothesis(own, np.zeros((0, own.r)))
    return UpdatedModel(problem, reduced, null, g_rows, drawn)


def drawn_starts(problem: Problem, reduced: ReducedModel) -> list[tuple[FloatArray, FloatArray]]:
    """Prior means of the unknowns, and `DRAWN` sets of them whose parameters are drawn from their priors (Latin
    hypercube; the same at every call): an update that starts at the deck's values alone can end in a minimum that is
    none of the structure's."""
    mean, sd = problem.prior(reduced)[:2]
    n = len(reduced.model.parameters)
    starts = [(mean, np.zeros(0))]
    if n:
        share = qmc.LatinHypercube(n, rng=0).random(DRAWN)
        starts += [(np.concatenate([mean[:n] + sd[:n] * z, mean[n:]]), np.zeros(0)) for z in ndtri(share)]
    return starts


def _left_out(
    model: Model, records: Sequence[FitRecord], band: tuple[float, float], missed: Unresolved
) -> tuple[Model, tuple[float, float]]:
    """The model that says what its mesh does not follow, and the band without it."""
    end = missed.limit or band[1]
    above = np.mean([band_power(r, (end, band[1])) / max(band_power(r, band), 1e-300) for r in records])
    return replace(model, unresolved=replace(missed, share=float(above))), (band[0], end)


def _rows(records: Sequence[FitRecord]) -> list[int]:
    """Rows of the g-set of all sensors and recorded forces."""
    return sorted({int(g) for r in records for g in [*r.in_rows, *r.out_rows]})


def _drawn(reduced: ReducedModel, f_max: float, g_rows: list[int]) -> Hypothesis | None:
    """The deck's own model for its predictions; None where that is the `reduced` one."""
    if reduced.model.refines is not None:
        reduced = reduce_model(reduced.model.refines, f_max, g_rows)
    elif reduced.beams is not None:
        reduced = reduced.with_beams()
    else:
        return None
    return Hypothesis(reduced, np.zeros((0, reduced.r)))
