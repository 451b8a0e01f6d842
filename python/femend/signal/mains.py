"""Hum of the mains on a channel: a line of 50 or 60 Hz, or of their multiples, that the force does not hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import TimeData

__all__ = ["Hum", "mains_hum"]

FloatArray = NDArray[np.float64]

MAINS = (50.0, 60.0)
# multiples that are looked at, and how far the mains' frequency is off at most: as a share, and in lines, by which a
# peak between them is read off
MULTIPLES, WANDERS, READ_OFF = 3, 0.0015, 0.2
# lines beside one in whose median it is compared with its neighbours, without the nearest ones, which it leaks into
BESIDE, NEAREST = 24, 3
# power over the neighbours' median from which a line is none of theirs, of noise one in 10^9, and that of a force below
# which it holds no such line
STANDS_OUT, HELD = 30.0, 8.0
# parts of a record in which the sinusoid is looked at, and how much of their squares one phase explains at least
PARTS, ONE_PHASE = 4, 0.9
# share of the response channels that show the same line from which it is taken for the structure's
SHOWN = 0.5


@dataclass(frozen=True, slots=True)
class Hum:
    """Hum of `freq` Hz on channel `row`, with the rms `level` in the channel's unit and the `share` of its rms."""

    row: int
    freq: float
    level: float
    share: float


def mains_hum(data: TimeData) -> list[Hum]:
    """The loudest hum on every response channel of `data`; none where a force drives the structure at its frequency.

    Lines are those of the record with a Hann window: noise and responses to it scatter about their neighbours, also
    near resonances that several lines lie on; hum is one line. Of a sharp resonance that is one line too it differs by
    its phase, which is the same from beginning to end, its frequency, and in that a resonance is in most channels.
    """
    n, forces = data.values.shape[1], set(data.rows("force"))
    values = data.values - data.values.mean(axis=1, keepdims=True)
    freq, window = np.fft.rfftfreq(n, data.dt), np.hanning(n)
    spectrum = np.fft.rfft(values * window, axis=1)
    power = np.abs(spectrum) ** 2
    found: dict[int, Hum] = {}
    for f in sorted({m * k for m in MAINS for k in range(1, MULTIPLES + 1)}):
        off = max(WANDERS * f, READ_OFF * freq[1])
        near = np.flatnonzero(np.abs(freq - f) <= off + 0.5 * freq[1])
        if not near.size or near[0] < BESIDE or near[-1] + BESIDE >= freq.size:
            continue
        ratio = [_standing_out(row, near) for row in power]
        if any(ratio[i][0] > HELD for i in forces):
            continue
        shown = [i for i, (over, _) in enumerate(ratio) if i not in forces and over >= STANDS_OUT]
        if len(shown) > max(1, SHOWN * (len(ratio) - len(forces))):
            continue
        for row in shown:
            at = ratio[row][1]
            own = _between_lines(np.sqrt(power[row]), at) * float(freq[1])
            if abs(own - f) > off or _one_phase(values[row], own * data.dt) < ONE_PHASE:
                continue
            # a Hann window spreads a sinusoid over three lines, whose squares add to 3/2 of the middle one's
            level = float(np.sqrt(2 * power[row, at - 1 : at + 2].sum() / 1.5) / window.sum())
            if row not in found or level > found[row].level:
                found[row] = Hum(row, own, level, level / max(float(values[row].std()), 1e-300))
    return [found[row] for row in sorted(found)]


def _between_lines(size: FloatArray, at: int) -> float:
    """Position, in lines, of a sinusoid's peak of which a Hann window shows line `at` best: (2 r - 1) / (r + 1) on the
    side of its larger neighbour, r times as large (Rife and Vincent, Bell Syst. Tech. J. 49, 1970)."""
    side = 1 if size[at + 1] > size[at - 1] else -1
    r = float(size[at + side] / size[at])
    return at + side * (2 * r - 1) / (r + 1)


def _one_phase(y: FloatArray, cycles: float) -> float:
    """Share of the squares of a sinusoid of so many `cycles` a sample in parts of `y` (n,) that one phase explains."""
    turned = y * np.exp(-2j * np.pi * cycles * np.arange(y.size))
    parts = np.array([(p * np.hanning(p.size)).sum() for p in np.array_split(turned, PARTS)])
    return float(np.abs(parts.sum()) ** 2 / (PARTS * (np.abs(parts) ** 2).sum()))


def _standing_out(power: FloatArray, near: NDArray[np.int64]) -> tuple[float, int]:
    """Power of the loudest of the lines `near` over the median of its neighbours, and which it is."""
    at = int(near[np.argmax(power[near])])
    beside = np.r_[at - BESIDE : at - NEAREST + 1, at + NEAREST : at + BESIDE + 1]
    middle = float(np.median(power[beside]))
    return (float(power[at]) / middle if middle > 0 else 0.0), at
