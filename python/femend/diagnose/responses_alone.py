"""The diagnosis of responses to one force that nobody recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femend.diagnose.deciding.one_more import one_more_force, shows_beside, stands_in
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.so_far import SoFar
from femend.diagnose.deciding.verdict import nothing_explains
from femend.diagnose.diagnosis import explain
from femend.diagnose.driven.dashpots import best_dashpot, led_by, told
from femend.diagnose.driven.unrecorded import Driven, holds, locate_drive, with_force_read_off
from femend.diagnose.locating.locate import locate
from femend.diagnose.settings import Settings
from femend.diagnose.updating.with_level import moves_with_level, told_of_drift
from femend.estimate import FitRecord
from femend.model import Model
from femend.progress import Progress, SilentProgress
from femend.threads import one_blas_thread

__all__ = ["diagnose_responses"]


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

    def note(driven: Driven) -> None:
        so_far.driven = driven
        so_far.places(driven.start, driven.located)

    driven = locate_drive(model, records, zeta, settings, tell, note)
    if not driven.explained:
        so_far.start, so_far.driven = None, None
        return None
    note(driven)
    plainly = one_more_force(driven, settings)
    moved = None if plainly or not driven.located else moves_with_level(driven.start)
    more = plainly or moved is not None
    dashpot = best_dashpot(driven, settings)
    located = driven.located if dashpot is None else led_by(dashpot, driven)
    if more or dashpot is not None:
        # the model does not explain the recordings, however little of that stands above the noise
        left = min([one.fit.score for one in driven.located[:1]] + ([] if dashpot is None else [dashpot.fit.score]))
        between = float(np.sqrt(driven.start.null.score * left))
        settings = replace(settings, consistent=min(settings.consistent, between))
    out = explain(driven.start, located, driven.places, settings, tell, so_far=so_far)
    if out.verdict != "missing-physics" and more:
        out = _simulated(driven, out, settings, tell)
    silent = out.verdict in ("consistent", "parameters-only")
    if dashpot is not None and located and silent:
        out = replace(out, verdict="located-not-named", place=located[0], advice=told(dashpot, model.units))
    elif more and (silent or stands_in(out, driven)):
        shown = shows_beside(driven, settings)
        advice = nothing_explains(out) if moved is None else told_of_drift(driven.start, moved, shown)
        out = replace(out, verdict="located-not-named", place=driven.located[0], best=None, advice=advice)
    tell.done()
    so_far.found = replace(out, driven=driven)
    return so_far.found


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
