"""Recordings that are off as a whole, or at one sensor, put right where a model tells it."""

from __future__ import annotations

from collections.abc import Sequence

from femend.diagnose.locating.locate import Located, locate
from femend.diagnose.recordings.late_sensors import late_sensors
from femend.diagnose.recordings.low_cut import low_cut
from femend.diagnose.recordings.recorded_off import RecordedOff
from femend.diagnose.recordings.tilted import force_tilt
from femend.diagnose.recordings.time_axis import force_shift
from femend.diagnose.settings import Settings
from femend.diagnose.updating.loud_sensor import loud_sensor
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.model import Place

__all__ = ["put_right"]


def put_right(
    start: UpdatedModel, located: list[Located], places: Sequence[Place], zeta: float, settings: Settings
) -> tuple[RecordedOff | None, UpdatedModel, list[Located]]:
    """What all recordings are off by, None where nothing is, with the model updated without it and its places
    `located`, of all `places`; one sensor that shows what the structure does not counts with as much noise. As they
    were where nothing is off. `zeta` is the starting damping ratio."""
    found = (
        force_shift(start, located, places, zeta)
        or force_tilt(start, located, places, zeta, settings)
        or late_sensors(start, located, places, zeta, settings)
        or low_cut(start, located, places, zeta, settings)
    )
    off: RecordedOff | None = None
    if found is not None:
        off, start, located = found
    loud = loud_sensor(start.problem, start.null, located)
    if loud is not None:
        start = update_model(start.reduced.model, loud, zeta)
        located = locate(start.problem, start.reduced, places, start.null)
    return off, start, located
