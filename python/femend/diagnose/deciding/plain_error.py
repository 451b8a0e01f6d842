"""Whether what is told brings the model nearer to the recordings it was fitted to, as a whole.

Laws are compared in the band that the mesh represents. The model that is handed over answers beyond it too: a law may
win in the band by what it does outside, where the recordings speak against it (an oscillator tuned to where the band
ends stands for a stiffness within it, and has a resonance that was not recorded).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from femend.data.bands import within_band
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.stages import Values, final, updated
from femend.diagnose.naming.advice import seconds_seen
from femend.estimate import FitRecord, noise_floor
from femend.numerals import plain

__all__ = [
    "counted",
    "errors_in_band",
    "further_off",
    "left_in_band",
    "most_of_noise",
    "plain_errors",
    "silenced",
    "whole_errors",
]

# what counts of a record: its samples in the window, or its lines in the band as well
Counts = Callable[[Diagnosis, FitRecord, Values], Values]

REFINE = (
    "Refine the mesh, so that more of what was recorded can be compared, or free the parameters of the model that are "
    "least certain"
)
# error from which the motion that a law makes is no recording's: it grows without end
GROWN = 2.0


def plain_errors(found: Diagnosis) -> tuple[float, float] | None:
    """Errors of the updated and of the final model on all fit recordings: root of the summed squares over that of what
    was recorded, of all samples in the window of the diagnosis (of the lines in its band, of FRFs).

    None where nothing is added to the model, a load is told, or a force was not recorded.
    """
    added = found.best is not None or found.further is not None
    if not added or found.problem.load is not None or not all(r.driven for r in found.problem.records):
        return None
    return whole_errors(found)


def whole_errors(found: Diagnosis) -> tuple[float, float]:
    """The same errors of whatever is told, a load too."""
    return _errors(found, counted)


def errors_in_band(found: Diagnosis) -> tuple[float, float]:
    """The same errors in the band of the diagnosis alone, as `whole_errors` has them on all frequencies."""
    return _errors(found, _inside)


def _errors(found: Diagnosis, counts: Counts) -> tuple[float, float]:
    """Errors of the updated and of the final model on what `counts` of all fit recordings."""
    total = np.sum([_squares(found, record, counts) for record in found.problem.records], axis=0)
    before_all, after_all = np.sqrt(total[:2] / max(total[2], 1e-300))
    return float(before_all), float(after_all)


def most_of_noise(found: Diagnosis) -> float:
    """Error of the final model on the fit recording that it is furthest from, in units of that one's noise, both in the
    window and the band of the diagnosis."""
    times = 0.0
    for record in found.problem.records:
        floor = noise_floor(record, found.problem.band, found.sigma)
        times = max(times, left_in_band(found, record) / max(floor, 1e-300))
    return times


def left_in_band(found: Diagnosis, record: FitRecord) -> float:
    """Error of the final model on a fit recording in the window and the band of the diagnosis, as a share of what was
    recorded there: a mode beyond the band is nobody's to explain."""
    left = final(found, record, updated(found, record)) - recorded_of(record)
    powers = [float((np.abs(_inside(found, record, y)) ** 2).sum()) for y in (left, recorded_of(record))]
    return float(np.sqrt(powers[0] / max(powers[1], 1e-300)))


def _inside(found: Diagnosis, record: FitRecord, y: Values) -> Values:
    """What counts of a record at its lines in the band."""
    counts = counted(found, record, y)
    if record.frf is not None:
        return counts
    lines = within_band(np.fft.rfftfreq(record.n, record.dt), found.problem.band)
    return np.asarray(np.fft.rfft(counts, axis=1)[:, lines])


def _squares(found: Diagnosis, record: FitRecord, counts: Counts) -> tuple[float, float, float]:
    """Squares of what the updated and the final model leave of a recording, and of the recording, summed over what
    `counts` of it."""
    before = updated(found, record)
    after = final(found, record, before)
    recorded = recorded_of(record)
    sums = [
        float((np.abs(counts(found, record, y)) ** 2).sum()) for y in (before - recorded, after - recorded, recorded)
    ]
    return sums[0], sums[1], sums[2]


def recorded_of(record: FitRecord) -> Values:
    """Samples of a time record, values of an FRF."""
    return record.y if record.frf is None else record.frf.H


def counted(found: Diagnosis, record: FitRecord, y: Values) -> Values:
    """Samples of a time record in the window exp(-sigma t), lines in the band of an FRF."""
    if record.frf is None:
        return np.asarray(y * np.exp(-found.sigma * record.dt * np.arange(record.n)))
    return np.asarray(y[within_band(record.frf.freq, found.problem.band)])


def silenced(found: Diagnosis, errors: tuple[float, float] | None) -> str:
    """What has to be said where what was added makes the model follow hardly any of the recordings, by its
    `plain_errors`; "" elsewhere.

    Responses that have nothing to do with the force are explained best by a model that does not move. A law whose
    motion grows without end, where the updated model does follow them, silences nothing.
    """
    silent = found.settings.silent
    if errors is None or errors[1] <= silent or (errors[1] > GROWN and errors[0] < silent):
        return ""
    return (
        f"{_laws(found)} would explain the recordings best by silencing the model: {plain(100 * errors[1], 3)} % of "
        "what was recorded is left, so that nothing is told. The responses hardly follow from the measured force: see "
        "whether force and responses are of the same test and on one time axis, whether the sensors are connected, and "
        "their units"
    )


def further_off(
    found: Diagnosis,
    errors: tuple[float, float] | None,
    what_to_do: str = REFINE,
    so: str = "it is not told",
    beginning: Diagnosis | None = None,
) -> str:
    """What has to be said where the final model is further from the recordings than the updated one, by its
    `plain_errors`, `so` what comes of it, and `what_to_do`; "" where not. Laws that were compared at the `beginning` of
    the recordings alone, in the window of this diagnosis, won by that."""
    if errors is None or errors[1] <= found.settings.worse * errors[0]:
        return ""
    before, after = (f"{plain(100 * e, 3)} %" for e in errors)
    after = after if errors[1] <= GROWN else "altogether"
    s = "" if found.further is not None else "s"
    return (
        f"{_laws(found)} {_nearer(beginning or found, s)}, but as a whole the recordings are {after} off with it and "
        f"{before} without it, so that {so}. {what_to_do}"
    )


def _nearer(found: Diagnosis, s: str) -> str:
    """By what laws won, with the `s` of a verb: what they leave in the window and the band of the diagnosis, where that
    is less than without them."""
    before, after = errors_in_band(found)
    if not after < before:
        return f"explain{s} the data that chose best"
    low, high = (plain(f, 3) for f in found.problem.band)
    first = ""
    if found.sigma > 0:
        shortest = min((r.n * r.dt for r in found.problem.records if r.frf is None), default=np.inf)
        first = f"about the first {seconds_seen(found.sigma, shortest)} s of "
    left, without = (f"{plain(100 * e, 3)} %" for e in (after, before))
    return f"leave{s} {left} of {first}the recordings from {low} to {high} Hz, where {without} is left without it"


def _laws(found: Diagnosis) -> str:
    """What was added, in words."""
    return "the laws found together" if found.further is not None else _named(found)


def _named(found: Diagnosis) -> str:
    """The law that was added, at its place."""
    at = "" if found.place is None else f" {found.place.place.where}"
    return f"{'' if found.best is None else found.best.name.replace('_', ' ')}{at}"
