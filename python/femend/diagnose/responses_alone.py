"""The diagnosis of responses to one force that nobody recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from femend.diagnose.accepted import TELLING
from femend.diagnose.diagnosis import explain
from femend.diagnose.locate import cost_of, locate
from femend.diagnose.outcome import Diagnosis
from femend.diagnose.settings import Settings
from femend.diagnose.so_far import SoFar
from femend.diagnose.unrecorded import Driven, holds, locate_drive, with_force_read_off
from femend.diagnose.verdict import nothing_explains
from femend.estimate import FitRecord
from femend.model import Model
from femend.progress import Progress, SilentProgress
from femend.threads import one_blas_thread

__all__ = ["diagnose_responses"]

# misfit with one more free force, in that of the updated model, up to which it explains clearly more where the force
# that drove the structure is free too: 0.94 and more on controls of calibration seed 27, 0.88 and less where something
# shows
ONE_MORE = 0.91


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
            out = replace(out, verdict="located-not-named", place=driven.located[0], advice=nothing_explains(out))
    tell.done()
    so_far.found = replace(out, driven=driven)
    return so_far.found


def _one_more_force(driven: Driven, settings: Settings) -> bool:
    """Whether a free force beside the drive explains clearly more than the updated model. Near the noise a misfit alone
    says little where a force is free on every line."""
    if not driven.located:
        return False
    start, first = driven.start, driven.located[0]
    gain = cost_of(start.problem, start.null, 0.0) - first.cost
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
