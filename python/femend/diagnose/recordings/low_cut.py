"""Whether sensors follow slow motion: the low cut-off of amplifiers that do not couple direct current.

Piezoelectric accelerometers and their conditioners fall off below a frequency (first order, -3 dB there), which turns
the phase far above it: at five times that frequency by 11 degrees. Stiffness and damping of the lowest modes make up
for it as well as they can, and what they cannot looks like something missing.
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
from femend.numerals import plain

__all__ = ["LowCut", "low_cut"]

FloatArray = NDArray[np.float64]

# a cut-off that is told, as a share of the band's low end at least, and how near it is found, as the same
LEAST, CLOSE = 0.02, 0.002


@dataclass(frozen=True)
class LowCut(RecordedOff):
    """All sensors are cut off below `frequency` (Hz), by a high-pass filter of the first order."""

    frequency: float

    def heard(self, record: FitRecord, y: FloatArray) -> FloatArray:
        """Responses y (n_out, n) of a record's sensors as these show them, from rest unless the record repeats
        itself."""
        if record.frf is not None:
            return y
        n = record.n if record.period > 0 else 2 * record.n
        f = np.fft.rfftfreq(n, record.dt)
        passed = 1j * f / (1j * f + self.frequency)
        return np.ascontiguousarray(np.fft.irfft(np.fft.rfft(y, n, axis=1) * passed, n, axis=1)[:, : y.shape[1]])

    def on(self, record: FitRecord) -> FitRecord:
        """The record with what its sensors would show without the cut-off, for fits."""
        if record.frf is not None:
            return record
        if record.period > 0:
            f = np.fft.rfftfreq(record.n, record.dt)
            gain = 1 - 1j * np.divide(self.frequency, f, out=np.zeros_like(f), where=f > 0)
            return replace(record, y=np.ascontiguousarray(np.fft.irfft(np.fft.rfft(record.y, axis=1) * gain, record.n)))
        # trapezes, from rest
        sums = np.cumsum(record.y, axis=1) - 0.5 * (record.y + record.y[:, :1])
        return replace(record, y=record.y + 2 * np.pi * self.frequency * record.dt * sums)

    def text(self, names: Sequence[str], node_ids: Sequence[int], dt: float) -> str:
        """What is said of it, as of `RecordedOff`."""
        return (
            f"all sensors follow motion as if cut off below {plain(self.frequency, 3)} Hz (first order; recordings "
            f"{', '.join(repr(n) for n in names)}), as piezoelectric sensors and amplifiers without direct current do: "
            "recordings were corrected for that, predictions are of what such sensors show. Compare with the low "
            "cut-off on the data sheets, or record with sensors that reach lower"
        )


def low_cut(
    start: UpdatedModel, located: Sequence[Located], places: Sequence[Place], zeta: float, settings: Settings
) -> tuple[LowCut, UpdatedModel, list[Located]] | None:
    """The low cut-off of all sensors with which the updated model does far better, and better than with a force at one
    of the places `located`; with that model, and where something is missing in it, of all `places`. None elsewhere.
    `zeta` is the starting damping ratio."""
    if not can_be_off(start, settings):
        return None
    records, low = start.problem.records, start.problem.band[0]
    rows = sorted({int(row) for r in records for row in r.out_rows})

    def read(fit: Fit) -> FloatArray:
        return np.array([_cut_off(shown_by(start.problem, fit, records, rows))])

    def made(cut: FloatArray) -> LowCut | None:
        return LowCut(float(cut[0])) if cut[0] > LEAST * low else None

    return mended(start, located, places, zeta, read(start.null), read, made, CLOSE * low)


def _cut_off(shown: Sequence[Shown]) -> float:
    """The cut-off (Hz) that leaves least, by weighted squares: Y (1 + f_c / (i f)) is what the model says."""
    along = size = 0.0
    for one in shown:
        per_cut = one.Y / (1j * one.omega / (2 * np.pi))
        along += float(((np.conj(per_cut) * (one.M - one.Y)).real * one.weight).sum())
        size += float((np.abs(per_cut) ** 2 * one.weight).sum())
    return max(along / max(size, 1e-300), 0.0)
