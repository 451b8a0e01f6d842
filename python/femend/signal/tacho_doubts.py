"""What is doubtful about a tacho: pulses that come too fast for its sampling, and another number of them to a turn."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from femend.data import Speed, TimeData
from femend.data.recording import RESPONSES
from femend.numerals import plain

__all__ = ["PulseCount", "counted_otherwise", "sampled_too_slowly"]

FloatArray = NDArray[np.float64]

# samples a pulse below which edges that fall between two samples are off by a quarter of an interval, and samples below
# which a pulse, or the gap behind it, may fall between two of them
SAMPLES, LASTS = 4.0, 1.0
# pulses to a turn that are tried, and how far the order that they give has to be from 1
TRIED, APART = (1, 2, 3, 4, 6, 8), 1.4
# turns over which an order is averaged, and the fewest of such stretches
TURNS, STRETCHES = 8, 6
# share of what channels show from which an order is theirs, and share of that up to which order 1 is nothing: of 40
# generated runs whose forces of order 2 are up to three times those of order 1 one has 0.16 %, the others more; of 42
# with a wrong number of pulses those with order 1 alone have 0.07 % and less
MOST, NOTHING = 0.5, 0.001
# share of the sampling rate up to which an order can be told
USABLE = 0.45


def sampled_too_slowly(x: FloatArray, dt: float, pulses_per_s: float, rev_per_s: float | None = None) -> str:
    """A clause where the pulses of a tacho x (n_samples,), sampled every `dt` s, come too fast for its sampling at
    `pulses_per_s`; nothing where they do not. `rev_per_s` is the speed at which they do, where it is known."""
    low, high = float(x.min()), float(x.max())
    share = float((x > 0.5 * (low + high)).mean())
    samples = 1.0 / (pulses_per_s * dt)
    lasts = min(share, 1 - share) * samples
    if samples >= SAMPLES and lasts >= LASTS:
        return ""
    at = "" if rev_per_s is None else f"at {plain(rev_per_s, 3)} rev/s "
    short = f", of which the pulse or the gap lasts {plain(lasts, 2)}" if lasts < LASTS else ""
    return (
        f"{at}{plain(pulses_per_s, 3)} pulses/s come at {plain(1 / dt)} samples/s ({plain(samples, 2)} samples a "
        f"pulse{short}), so that some are not seen: sample the tacho faster, or use fewer or longer pulses"
    )


@dataclass(frozen=True, slots=True)
class PulseCount:
    """The number of `pulses` to a turn that channels speak for: they hold the `share` of their power at the `order` of
    the speed that was assumed, and `first` at its order 1."""

    pulses: int
    order: float
    share: float
    first: float


def counted_otherwise(data: TimeData, speed: Speed, pulses: int) -> PulseCount | None:
    """Another number of pulses to a turn than `pulses`, which `speed` was taken with, that the responses of `data`
    follow: they lie at the order `pulses` / number, and next to nothing of them at order 1. None where there is none,
    or where turns are too few to tell.

    Shares are means over the channels, each by its own power.
    """
    rows = [i for i, c in enumerate(data.channels) if c.quantity in RESPONSES]
    t = data.t
    inside = (t >= speed.start) & (t <= speed.stop)
    if not rows or not inside.any():
        return None
    rev, angle = speed.at(t[inside])
    y = data.values[rows][:, inside]
    y = y - y.mean(axis=1, keepdims=True)
    first = _share(y, angle)
    if first is None:
        return None
    found = []
    for tried in TRIED:
        order = pulses / tried
        fast = order * float(rev.max()) > USABLE * data.rate
        if 1 / APART < order < APART or fast or (share := _share(y, order * angle)) is None:
            continue
        found.append(PulseCount(tried, order, share, first))
    best = max(found, key=lambda one: one.share, default=None)
    return best if best is not None and best.share >= MOST and first <= NOTHING * best.share else None


def _share(y: FloatArray, angle: FloatArray) -> float | None:
    """Share of the power of y (n_ch, n) that turns with the `angle` (n,) rad, in stretches of eight turns under a
    window of Hann; None for fewer than six stretches."""
    turn = (angle - angle[0]) / (2 * np.pi * TURNS)
    whole = int(turn[-1])
    if whole < STRETCHES:
        return None
    ends = np.searchsorted(turn, np.arange(whole + 1))
    held, total = np.zeros(len(y)), np.zeros(len(y))
    for a, b in pairwise(ends):
        window = np.sin(np.pi * (turn[a:b] - turn[a])) ** 2
        own = y[:, a:b]
        amplitude = 2 * (own * window) @ np.exp(-1j * angle[a:b]) / window.sum()
        held += 0.5 * np.abs(amplitude) ** 2 * (b - a)
        total += (own**2).sum(axis=1)
    moving = total > 0
    return float((held[moving] / total[moving]).mean()) if moving.any() else None
