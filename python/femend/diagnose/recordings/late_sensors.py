"""Whether all sensors are on one time axis: some recorded late or early by times of their own, in all recordings.

The sensors of a second module that was started a sample later, of wireless nodes, or behind other filters show the
right motion at the wrong time. No parameter makes up for that and no force does, but a time for each sensor does. These
times are told by a model that is still far off, too: near a resonance it has the right shape, and what it has not, the
size and the phase of that shape on a line, is common to all sensors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.locate import Located
from femend.diagnose.recordings.mended import can_be_off, mended
from femend.diagnose.recordings.recorded_off import RecordedOff
from femend.diagnose.recordings.shown import Shown, shown_by
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel
from femend.estimate import Fit, FitRecord
from femend.model import Place
from femend.model.places.place import AXES
from femend.numerals import listed, plain

__all__ = ["SensorTimes", "late_sensors"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# share of what scaled shapes leave on every line that they leave at most with sensors moved
WORTH = 0.5
# the least time that is told, in samples, what is near enough for the next round, and the longest that is looked for,
# in periods of the band's low end
LEAST, CLOSE, LONGEST = 0.2, 0.02, 2.0
# times are read off so many to a sample; rounds in which shapes and times are found
FINE, ROUNDS = 20, 30
# sensors from which times of their own are told
FEWEST = 3
# sensors that are listed of those that are late by the same
MOST = 6


@dataclass(frozen=True)
class SensorTimes(RecordedOff):
    """The sensors at `rows` of the g-set show what moved `seconds` later than it did (earlier where negative)."""

    rows: tuple[int, ...]
    seconds: tuple[float, ...]

    def heard(self, record: FitRecord, y: FloatArray) -> FloatArray:
        """Responses y (n_out, n) of a record's sensors as these show them; before it begins the structure is at rest,
        unless it repeats itself."""
        late = self._of(record)
        if record.frf is not None or not late.any():
            return y
        return _moved(y, late / record.dt, record.n if record.period > 0 else 2 * record.n)

    def on(self, record: FitRecord) -> FitRecord:
        """The record with what its sensors show when it was, for fits: without the beginning or the end that some did
        not record. What moved in the beginning counts as free decays then."""
        late = self._of(record)
        if record.frf is not None or not late.any():
            return record
        samples = late / record.dt
        y = _moved(record.y, -samples, record.n)
        first, last = (0, 0) if record.period > 0 else (max(-samples.min(), 0.0), max(samples.max(), 0.0))
        heard = replace(record, y=np.ascontiguousarray(y))
        return heard.part(int(np.ceil(first)), record.n - int(np.ceil(last)), record.period)

    def _of(self, record: FitRecord) -> FloatArray:
        """Times (n_out,) in s by which the sensors of a record are late."""
        times = dict(zip(self.rows, self.seconds, strict=True))
        return np.array([times.get(row, 0.0) for row in record.out_rows.tolist()])

    def text(self, names: Sequence[str], node_ids: Sequence[int], dt: float) -> str:
        """What is said of it, as of `RecordedOff`."""
        alike: dict[str, list[str]] = {}
        for row, seconds in sorted(zip(self.rows, self.seconds, strict=True), key=lambda one: -abs(one[1])):
            samples, how = plain(abs(seconds) / dt, 2), "late" if seconds > 0 else "early"
            size = f"{plain(1e3 * abs(seconds), 3)} ms ({samples} sample{'' if samples == '1' else 's'}) {how}"
            alike.setdefault(size, []).append(f"node {int(node_ids[row // 6])} {AXES[row % 6]}")
        which = "; ".join(f"{size} {listed(sensors, MOST)}" for size, sensors in alike.items())
        return (
            f"sensors are not on one time axis: {which} (recordings {', '.join(repr(n) for n in names)}). They were "
            "moved by that, also for the predictions. See that all channels have one clock, one trigger and filters of "
            "one kind"
        )


def late_sensors(
    start: UpdatedModel, located: Sequence[Located], places: Sequence[Place], zeta: float, settings: Settings
) -> tuple[SensorTimes, UpdatedModel, list[Located]] | None:
    """The times by which sensors are late or early with which the updated model does far better, and better than with a
    force at one of the places `located`; with that model, and where something is missing in it, of all `places`. None
    elsewhere. `zeta` is the starting damping ratio."""
    records = start.problem.records
    rows = sorted({int(row) for r in records for row in r.out_rows})
    if len(rows) < FEWEST or not can_be_off(start, settings):
        return None
    shown, reach = shown_by(start.problem, start.null, records, rows), LONGEST / start.problem.band[0]
    first = _by_shapes(shown, len(rows), reach)
    if _left(shown, first) > WORTH * _left(shown, np.zeros(len(rows))):
        return None

    def read(fit: Fit) -> FloatArray:
        # against the force; those found first are against each other
        return _times(shown_by(start.problem, fit, records, rows), len(rows), reach)

    dt = min(r.dt for r in records)
    return mended(start, located, places, zeta, first, read, lambda times: _told(rows, times, dt), CLOSE * dt)


def _told(rows: Sequence[int], times: FloatArray, dt: float) -> SensorTimes | None:
    """The sensors whose times are told, at a step of `dt` (s); None where none is."""
    off = [(row, float(time)) for row, time in zip(rows, times, strict=True) if abs(time) > LEAST * dt]
    return SensorTimes(tuple(row for row, _ in off), tuple(time for _, time in off)) if off else None


def _moved_model(shown: Shown, times: FloatArray) -> ComplexArray:
    """The model's spectra (n_out, K) seen later by `times` (s) of all sensors."""
    return np.asarray(shown.M * np.exp(-1j * shown.omega * times[shown.at][:, None]))


def _sizes(shown: Shown, times: FloatArray) -> ComplexArray:
    """The factor (K,) of the model's shape on every line that is nearest to what was recorded, with sensors late by
    `times` (s)."""
    M = _moved_model(shown, times)
    along, size = (np.conj(M) * shown.Y * shown.weight).sum(axis=0), (np.abs(M) ** 2 * shown.weight).sum(axis=0)
    return np.asarray(along / np.maximum(size, 1e-300))


def _agreement(shown: Shown, sizes: ComplexArray, at: FloatArray) -> FloatArray:
    """How well every sensor agrees with the model's shape times `sizes` (K,) if it were late by times `at` (m,): no
    line counts more than the median one, for a resonance tells least of where it is."""
    P = np.conj(sizes * shown.M) * shown.Y
    size = np.abs(P)
    usual = np.maximum(np.median(size, axis=1, keepdims=True), 1e-300)
    P = P / np.maximum(size, usual) / P.shape[1]
    whole = np.zeros((len(P), shown.n * FINE // 2 + 1), dtype=np.complex128)
    whole[:, shown.first : shown.first + P.shape[1]] = P
    course = np.fft.fftshift(np.fft.irfft(whole, shown.n * FINE, axis=1), axes=1)
    t = (np.arange(course.shape[1]) - course.shape[1] // 2) * shown.dt / FINE
    return np.array([np.interp(at, t, one) for one in course])


def _by_shapes(shown: Sequence[Shown], n: int, reach: float) -> FloatArray:
    """Times (n,) within `reach` (s) by which sensors are late against most of them: by the model's shapes alone, whose
    sizes and times are found in turns."""
    times = np.zeros(n)
    for _ in range(ROUNDS):
        found = _times(shown, n, reach, [_sizes(one, times) for one in shown])
        found -= np.median(found)
        if np.array_equal(found, times):
            break
        times = found
    return times


def _times(
    shown: Sequence[Shown], n: int, reach: float, sizes: Sequence[ComplexArray | float] | None = None
) -> FloatArray:
    """Times (n,) within `reach` (s) at which sensors agree best with the model, its shapes scaled by `sizes`."""
    step = min(one.dt for one in shown) / FINE
    at = np.float64(step) * np.arange(-int(reach / step), int(reach / step) + 1, dtype=np.float64)
    agree = np.zeros((n, len(at)))
    for one, size in zip(shown, [1.0] * len(shown) if sizes is None else sizes, strict=True):
        agree[one.at] += _agreement(one, np.asarray(size, dtype=np.complex128), at)
    return at[np.argmax(agree, axis=1)]


def _left(shown: Sequence[Shown], times: FloatArray) -> float:
    """Weighted squares that shapes of the best size on every line leave, with sensors late by `times` (n,)."""
    left = [one.Y - _sizes(one, times) * _moved_model(one, times) for one in shown]
    return sum(float((np.abs(e) ** 2 * one.weight).sum()) for one, e in zip(shown, left, strict=True))


def _moved(y: FloatArray, samples: FloatArray, n: int) -> FloatArray:
    """Rows of y (n_out, n_y) later by `samples` (n_out,), as of a period of `n` samples; zeros follow shorter ones."""
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(n) * samples[:, None])
    return np.ascontiguousarray(np.fft.irfft(np.fft.rfft(y, n, axis=1) * turn, n, axis=1)[:, : y.shape[1]])
