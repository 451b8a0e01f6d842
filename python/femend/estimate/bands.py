"""The band in which records are compared with a model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.errors import RecordingError
from femend.estimate.frf import useful_band
from femend.estimate.lines import FitRecord
from femend.estimate.power import PASSED, holds_power, may_be_noise, smoothed

__all__ = ["further_band", "modelled_band", "used_band"]

FloatArray = NDArray[np.float64]

# the band ends below and above what it has to hold by these factors
WIDER_DOWN, WIDER_UP = 0.8, 1.02
# an FRF is used up to this multiple of the model's last natural frequency
BEYOND_MODES = 1.3
# responses stand clear of the noise where they are so many times as strong, and so strong a share of their mean
CLEAR, STRONG = 4.0, 0.05
# a force reaches down to 0 Hz where its low end is less than this share of its top; such a record is used from this
# share of the first frequency at which some response stands clear of its noise
REACHES_DOWN, BELOW_CLEAR = 0.01, 0.5
# a record is used to this share of its sampling rate at most
OF_RATE = 0.47
# a band goes on above the end of the forces' power as far as some response is so strong a share of its mean and no more
# than this share of the forces' power is noise, by a factor of at least and at most
RESONANT, NOISE_OF_FORCE, WORTH, AT_MOST = 0.3, 0.01, 1.05, 1.5
# coherence of all recordings there, over lines with strong responses, from which these answer the force: of resonances
# it is 0.95 and more, of harmonics of what is nonlinear below 0.8 at most (generated cases, two and three recordings)
COHERENT = 0.9


def used_band(records: Sequence[FitRecord]) -> tuple[float, float]:
    """Band (Hz) that holds the measured forces' power but for half a per cent at the low end and one at the top.

    A blow has power down to 0 Hz, where a structure that is held hardly accelerates: the band begins no lower than an
    octave below the first response that stands clear of the noise. Of FRFs, and where no force was recorded, it is the
    band whose responses do. Raises RecordingError for a force that is hardly more than its mean.
    """
    low, high = [], []
    for r in records:
        if r.frf is not None:
            first, last = useful_band(r.frf)
            low.append(first / WIDER_DOWN)
            high.append(last / WIDER_UP)
            continue
        freq = np.fft.rfftfreq(r.n, r.dt)
        if not r.driven:
            first, last = _standing_clear(r)
            low.append(freq[first])
            high.append(min(freq[last], OF_RATE / r.dt))
            continue
        begin, end = holds_power(r.u, r.dt)
        if end == 0:
            raise RecordingError(
                f"recording {r.name!r}: all but 1 % of the force's power is its mean, which excites nothing: take it "
                "off before",
                recording=r.name,
            )
        if begin < REACHES_DOWN * end:
            begin = max(begin, BELOW_CLEAR * float(freq[_standing_clear(r, 0.0)[0]]))
        low.append(begin)
        high.append(min(end, OF_RATE / r.dt))
    return WIDER_DOWN * float(np.median(low)), WIDER_UP * float(np.median(high))


def further_band(band: tuple[float, float], records: Sequence[FitRecord]) -> tuple[float, float]:
    """The `band` (Hz) of `used_band` and what lies above it of strong answers to a force that is still known; the same
    one where that is not worth it, or cannot be told from what a nonlinear structure does by itself there: by several
    recordings alike in force, sensors and length.

    A resonance just above the end of a force's power is driven by the little that the force has there, and may be
    among the strongest of a record.
    """
    first = records[0]
    if len(records) < 2 or not all(r.frf is None and len(r.u) == 1 and _alike(r, first) for r in records):
        return band
    plain = band[1] / WIDER_UP
    end = float(np.median([_known_to(r, plain) for r in records]))
    if end <= WORTH * plain or _coherence(records, (plain, end)) < COHERENT:
        return band
    return band[0], WIDER_UP * end


def _alike(a: FitRecord, b: FitRecord) -> bool:
    """Whether two time records are of the same force and sensors on the same axis."""
    same = np.array_equal(a.out_rows, b.out_rows) and np.array_equal(a.in_rows, b.in_rows)
    return bool(a.n == b.n and a.dt == b.dt and same)


def _known_to(record: FitRecord, end: float) -> float:
    """Frequency (Hz), not below the `end` of a force's power, up to which a record has strong responses and a known
    force."""
    freq = np.fft.rfftfreq(record.n, record.dt)
    unknown = freq[(freq > end) & (may_be_noise(record.u, record.dt) > NOISE_OF_FORCE)]
    limits = [
        AT_MOST * end,
        PASSED / record.dt,
        float(freq[_standing_clear(record, RESONANT)[1]]),
        *unknown[:1].tolist(),
    ]
    return max(end, min(limits))


def _coherence(records: Sequence[FitRecord], band: tuple[float, float]) -> float:
    """Mean coherence of the responses of several recordings with their one force, on the lines of a `band` (Hz) with
    strong responses; 0 where none are."""
    freq = np.fft.rfftfreq(records[0].n, records[0].dt)
    inside = within_band(freq, band)
    crossed, forces, responses = np.zeros(1, dtype=complex), np.zeros(1), np.zeros(1)
    for r in records:
        U, Y = np.fft.rfft(r.u, axis=1), np.fft.rfft(r.y, axis=1)
        level = (np.abs(U) ** 2).mean()
        crossed = crossed + Y * U.conj() / level
        forces, responses = forces + np.abs(U) ** 2 / level, responses + np.abs(Y) ** 2 / level
    of_lines = np.abs(crossed) ** 2 / np.maximum(forces * responses, 1e-300)
    strong = np.any([_clear(r, RESONANT) for r in records], axis=0) & inside
    return float(of_lines[strong].mean()) if strong.any() else 0.0


def _standing_clear(record: FitRecord, strong: float = STRONG) -> tuple[int, int]:
    """First and last line, but for half a per cent at the low end and one at the top, on which some response is clear
    of the noise and `strong`."""
    clear = _clear(record, strong)
    lines = np.flatnonzero(clear.any(axis=0))
    if len(lines) == 0:
        return 0, clear.shape[1] - 1
    return int(lines[int(0.005 * len(lines))]), int(lines[int(0.99 * (len(lines) - 1))])


def _clear(record: FitRecord, strong: float) -> NDArray[np.bool_]:
    """Where the smoothed power of a response is (n_out, K) `CLEAR` times as strong as its noise and `strong` times as
    its own mean: what a force's end that nobody recorded leaves in other lines is above the noise, too."""
    power = smoothed(np.abs(np.fft.rfft(record.y, axis=1)) ** 2)
    least = np.maximum(CLEAR**2 * record.n * record.noise**2, strong**2 * power.mean(axis=1))
    return np.asarray(power > least[:, None])


def modelled_band(band: tuple[float, float], records: Sequence[FitRecord], freq: FloatArray) -> tuple[float, float]:
    """The band (Hz) up to a little above the model's last natural frequency where all records are FRFs.

    An FRF often reaches far beyond the modes of a model with few degrees of freedom, which has nothing to say there.
    `freq` (r,) are the model's natural frequencies, Hz.
    """
    if any(r.frf is None for r in records) or not len(freq):
        return band
    end = BEYOND_MODES * float(np.max(freq))
    return (band[0], min(band[1], end)) if end > band[0] else band
