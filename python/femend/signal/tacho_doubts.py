"""What is doubtful about a tacho: pulses that come too fast for its sampling, and another number of them to a turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from femend.data import Speed, TimeData
from femend.data.recording import RESPONSES
from femend.numerals import plain

__all__ = [
    "PulseCount",
    "counted_otherwise",
    "sampled_too_slowly",
    "turns_per_pulse",
    "varies_slowly",
    "without_pulses",
]

FloatArray = NDArray[np.float64]

# samples a pulse below which edges that fall between two samples are off by a quarter of an interval, and samples below
# which a pulse, or the gap behind it, may fall between two of them
SAMPLES, LASTS = 4.0, 1.0
# pulses to a turn that are tried, and how far the order that they give has to be from 1
TRIED, APART = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 30, 36, 48, 60), 1.4
# turns that may go by for each pulse
LOST_TURNS = (2, 3, 4)
# pieces into which a record is cut, ranges that their means go through of what varies slowly (with noise), and their
# share that is on the way between its extremes
PIECES, SWINGS, ON_THE_WAY = 400, 10.0, 0.3
# longer pieces, of which noise moves the means by less, and ranges that these go through: up and down again, while two
# cycles go through four
LONG_PIECES, UP_AND_DOWN = 40, 2.5
# samples above its middle that a tacho shows for each pulse, at least, where those are pulses
HALF_SEEN = 0.5
# share of a record at one end without pulses from which it is told, and intervals of the pulses there, which it has to
# be longer than
BARE, INTERVALS = 0.02, 4.0
# turns over which an order is averaged, and the fewest of such stretches
TURNS, STRETCHES = 8, 6
# share of what channels show from which an order is theirs, and share of that up to which order 1 is nothing: of 40
# generated runs whose forces of order 2 are up to three times those of order 1 one has 0.16 %, the others more; of 42
# with a wrong number of pulses those with order 1 alone have 0.07 % and less
MOST, NOTHING = 0.5, 0.001
# share of the sampling rate up to which an order can be told
USABLE = 0.45


def varies_slowly(x: FloatArray) -> str:
    """A clause where a tacho x (n_samples,) has no pulses because it goes up and down slowly; nothing where it does
    not."""
    means = _means(x, PIECES)
    span = float(np.ptp(means))
    if not span > 0 or _way(means) > SWINGS * span or _way(_means(x, LONG_PIECES)) > UP_AND_DOWN * span:
        return ""
    level = (means - means.min()) / span
    if float(((level > 0.1) & (level < 0.9)).mean()) < ON_THE_WAY:  # a pulse or a step
        return ""
    return (
        f"it goes slowly between {plain(float(means.min()), 4)} and {plain(float(means.max()), 4)}, as a speed, an "
        "angle or a counter does, and pulses are needed: name the channel that holds them (in Python "
        "speed_from_profile takes a speed)"
    )


def _means(x: FloatArray, pieces: int) -> FloatArray:
    """Means of x (n,) over about as many pieces of one length."""
    step = max(1, x.size // pieces)
    return np.asarray(x[: x.size // step * step].reshape(-1, step).mean(axis=1))


def _way(values: FloatArray) -> float:
    """What `values` (n,) go up and down by altogether."""
    return float(np.abs(np.diff(values)).sum())


def sampled_too_slowly(x: FloatArray, dt: float, pulses_per_s: float, rev_per_s: float | None = None) -> str:
    """A clause where the pulses of a tacho x (n_samples,), sampled every `dt` s, come too fast for its sampling at
    `pulses_per_s`; nothing where they do not. `rev_per_s` is the speed at which they do, where it is known."""
    samples = 1.0 / (pulses_per_s * dt)
    share = _share_above(x, samples)
    lasts = min(share, 1 - share) * samples
    if samples >= SAMPLES and lasts >= LASTS:
        return ""
    at = "" if rev_per_s is None else f"at {plain(rev_per_s, 3)} rev/s "
    short = f", of which the pulse or the gap lasts {plain(lasts, 2)}" if lasts < LASTS else ""
    return (
        f"{at}{plain(pulses_per_s, 3)} pulses/s come at {plain(1 / dt)} samples/s ({plain(samples, 2)} samples a "
        f"pulse{short}), so that some are not seen: sample the tacho faster, or use fewer or longer pulses"
    )


def _share_above(x: FloatArray, samples: float) -> float:
    """Share of the time above the middle of a tacho whose pulses come every `samples` samples: between its first and
    last hundredth, or its extremes where pulses are narrower than that."""
    low, high = (float(v) for v in np.percentile(x, [1, 99]))
    if high - low < 0.5 * float(np.ptp(x)):
        above = float((x > 0.5 * (float(np.median(x)) + float(x.max()))).mean())
        if above > HALF_SEEN / samples:  # spikes are fewer than the pulses
            return above
    return float((x > 0.5 * (low + high)).mean())


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
    tried = {pulses / n: n for n in TRIED}
    found = _likeliest(data, speed, tuple(tried))
    return None if found is None else PulseCount(tried[found[0]], *found)


def turns_per_pulse(data: TimeData, speed: Speed) -> PulseCount | None:
    """That the responses of `data` follow a shaft which turns several times for each pulse that `speed` was taken with
    one to a turn: every second pulse is lost, or an output toggles with them. `pulses` are then those turns. None where
    they do not, or where turns are too few to tell."""
    found = _likeliest(data, speed, LOST_TURNS)
    return None if found is None else PulseCount(round(found[0]), *found)


def _likeliest(data: TimeData, speed: Speed, orders: Sequence[float]) -> tuple[float, float, float] | None:
    """The one of the `orders` that the responses lie at, their share of power there, and that at order 1, which is next
    to nothing; None where there is none, or where turns are too few to tell."""
    rows = [i for i, c in enumerate(data.channels) if c.quantity in RESPONSES]
    t = data.t
    inside = (t >= speed.start) & (t <= speed.stop)
    if not rows or not inside.any():
        return None
    rev, angle = speed.at(t[inside])
    y = data.values[rows][:, inside]
    y = y - y.mean(axis=1, keepdims=True)
    first = _share(y, angle)
    if first is None or first > NOTHING:
        return None
    found = []
    for order in orders:
        fast = order * float(rev.max()) > USABLE * data.rate
        if 1 / APART < order < APART or fast or (share := _share(y, order * angle)) is None:
            continue
        found.append((order, share, first))
    best = max(found, key=lambda one: one[1], default=None)
    return best if best is not None and best[1] >= MOST and first <= NOTHING * best[1] else None


def without_pulses(data: TimeData, edges: FloatArray) -> list[tuple[float, float]]:
    """Stretches (start, stop) in s at the beginning and the end of `data` in which its tacho, with pulses at `edges`
    (n,) s, shows none, though it does for several intervals as long as those next to it; none of fewer than two
    pulses, which have no interval."""
    if edges.size < 2:
        return []
    start, stop = float(data.t[0]), float(data.t[-1])
    gaps = np.diff(edges)
    near = min(gaps.size, 8)
    ends = [(start, float(edges[0]), gaps[:near]), (float(edges[-1]), stop, gaps[-near:])]
    return [
        (a, b)
        for a, b, beside in ends
        if b - a > BARE * (stop - start) and b - a > INTERVALS * float(np.max(beside, initial=0.0))
    ]


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
