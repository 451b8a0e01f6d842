"""Pulses of a tacho: edges between samples, bounces thrown out, missing pulses put in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import percentile_filter

from femend.errors import SignalError

__all__ = ["PulseTrain", "find_edges", "find_jump", "repair_pulses"]

FloatArray = NDArray[np.float64]

# share of the local interval below which the next edge is a bounce, how far a count of lost pulses may be from whole
BOUNCE, WHOLE = 0.45, 0.25
# numbers of unevenly spaced pulses to a turn that are thought of; turns from which their intervals are told to repeat
# themselves, and by how much each may be off what it is as a rule
TEETH, FEWEST_TURNS, ALIKE = (2, 3, 4, 5, 6, 8), 6, 0.15
# by how much of a mean interval they have to differ to be uneven
UNEVEN = 0.1
# intervals that are steady on either side of a jump, and by how much their ratio may be off a whole number
STEADY, MULTIPLE = 4, 0.07
# intervals over which the local interval is taken, and the quantile: bounces make many short ones, losses few long ones
REACH, QUANTILE = 15, 75
# shares of the tacho's range tried as level: pulses that are narrow against a sample do not reach its middle each time
LEVELS = (0.5, 0.3, 0.15, 0.07, 0.7, 0.85, 0.93)


@dataclass(frozen=True, slots=True, eq=False)
class PulseTrain:
    """Repaired pulses: times `t` (n,) s with running `number` (n,), which jumps where `missed` pulses were put in;
    `doubled` counts edges thrown out and `events` lists (time in s, what was done)."""

    t: FloatArray
    number: NDArray[np.int64]
    missed: int
    doubled: int
    events: tuple[tuple[float, str], ...]


def find_edges(
    values: FloatArray,
    dt: float,
    t0: float = 0.0,
    *,
    level: float | None = None,
    hysteresis: float | None = None,
    falling: bool = False,
) -> FloatArray:
    """Times (n_edges,) in s at which `values` (n_samples,), sampled every `dt` s from `t0` on, rise through `level`.

    Linear interpolation between the samples on both sides. An edge counts once the signal has been below level minus
    half of `hysteresis` before. By default the hysteresis is a quarter of the signal's range (less near its ends), and
    the level the share of 0.5, or one of 0.07 to 0.93, of the range whose edges come most evenly: pulses shorter than
    two samples do not reach the middle each time. `falling` takes the falling edges. Raises SignalError where the
    signal does not move.

    >>> find_edges(np.array([0.0, 0, 5, 5, 0, 0, 5, 5]), 0.1)
    array([0.15, 0.55])
    """
    x = -np.asarray(values, float) if falling else np.asarray(values, float)
    low, high = np.percentile(x, [1, 99])
    if high - low < 0.5 * np.ptp(x):  # pulses narrower than 1 % of the time
        low, high = float(np.median(x)), float(x.max())
    span = high - low
    if not span > 1e-9 * max(abs(low), abs(high)):
        raise SignalError(f"the tacho stays at {x[0] if not falling else -x[0]:.6g}; there are no pulses to find")
    if level is not None:
        return t0 + dt * _crossings(x, -level if falling else level, 0.25 * span if hysteresis is None else hysteresis)
    found = []
    for share in LEVELS:
        band = min(0.25, 0.4 * share, 0.4 * (1 - share)) * span if hysteresis is None else hysteresis
        found.append(_crossings(x, low + share * span, band))
    return t0 + dt * min(found, key=_uneven)


def _crossings(x: FloatArray, middle: float, band: float) -> FloatArray:
    """Fractional sample numbers at which x rises through `middle` after having been below it by half of `band`.

    On a slow flank noise crosses the level several times. The mean of the first and the last of these crossings is
    late as often as it is early, which each of them by itself is not.
    """
    state = np.zeros(x.size, np.int8)  # 1 above the band, -1 below, 0 inside: keeps the last one outside
    state[x > middle + 0.5 * band] = 1
    state[x < middle - 0.5 * band] = -1
    outside = np.flatnonzero(state)
    rise = np.flatnonzero((state[outside[1:]] == 1) & (state[outside[:-1]] == -1))
    below, above = outside[rise], outside[rise + 1]
    crossing = np.flatnonzero((x[:-1] <= middle) & (x[1:] > middle))
    if not crossing.size:
        return np.zeros(0)
    first, last = crossing[np.searchsorted(crossing, below)], crossing[np.searchsorted(crossing, above) - 1]
    between = [at + (middle - x[at]) / (x[at + 1] - x[at]) for at in (first, last)]
    return np.asarray(0.5 * (between[0] + between[1]))


def _uneven(edges: FloatArray) -> float:
    """Share of the intervals that are far from their neighbours' median; 2 where there are too few to tell."""
    if edges.size < 4:
        return 2.0
    intervals = np.diff(edges)
    ratio = intervals / _median(intervals)
    return float(((ratio < 0.7) | (ratio > 1.4)).mean())


def repair_pulses(edges: FloatArray, *, most: float = 0.2, pulses_per_revolution: int = 1) -> PulseTrain:
    """`edges` (n,) s without bounces, with the numbers that lost pulses would have had.

    An edge that follows the last one by less than 0.45 of the local interval is a bounce; an interval of m local ones
    (within a quarter) has lost m - 1 pulses. Intervals that repeat themselves every `pulses_per_revolution`, however
    uneven, are those of its teeth, of which none is lost. Raises SignalError for fewer than four edges, and where more
    than the share `most` of the pulses had to be repaired or an interval is no whole number of local ones.
    """
    edges = np.sort(np.asarray(edges, float))
    if edges.size < 4:
        raise SignalError(
            f"the tacho has {edges.size} pulses; at least 4 are needed to tell a speed. Check level, wiring and channel"
        )
    if pulses_per_revolution > 1 and _spacing(edges, pulses_per_revolution) is not None:
        return PulseTrain(edges, np.arange(edges.size), 0, 0, ())
    try:
        return _repaired(edges, most)
    except SignalError as error:
        for n in TEETH:
            spacing = _spacing(edges, n)
            if spacing is None or n == pulses_per_revolution:
                continue
            told = " to ".join(f"{share:.2f}" for share in spacing)
            raise SignalError(
                f"its intervals repeat themselves every {n} pulses, as {told} of a turn: is pulses_per_revolution = "
                f"{n} instead of {pulses_per_revolution}? As they are, {error}",
                time=error.time,
            ) from None
        raise


def _spacing(edges: FloatArray, n: int) -> FloatArray | None:
    """Shares (n,) of the intervals of a turn of `n` pulses; None where intervals do not repeat themselves so, as where
    a pulse is lost or bounces."""
    intervals = np.diff(edges)
    if intervals.size < FEWEST_TURNS * n:
        return None
    turns = np.convolve(intervals, np.ones(n), "valid")  # from every pulse to the one a turn later
    middle = np.clip(np.arange(intervals.size) - n // 2, 0, turns.size - 1)
    shares = intervals / turns[middle]
    typical = np.array([float(np.median(shares[k::n])) for k in range(n)])
    alike = np.abs(shares / typical[np.arange(shares.size) % n] - 1) < ALIKE
    return typical if alike.all() and np.ptp(typical) * n > UNEVEN else None


def _repaired(edges: FloatArray, most: float) -> PulseTrain:
    kept, dropped = _without_bounces(edges)
    if kept.size < 4:
        raise SignalError(f"of {edges.size} tacho edges {kept.size} are left without bounces; at least 4 are needed")
    steps, lost = _steps(kept)
    missed = int(lost.sum())
    number = np.concatenate([[0], np.cumsum(steps)])
    events = [(float(t), "edge thrown out as a bounce") for t in dropped]
    events += [(float(kept[i]), f"{lost[i]} lost pulses put in") for i in np.flatnonzero(lost)]
    share = (missed + dropped.size) / (kept.size + missed)
    if share > most:
        first = min(events)
        raise SignalError(
            f"{missed} of {kept.size + missed} tacho pulses are missing and {dropped.size} edges are bounces "
            f"({share:.0%}, first at {first[0]:.6g} s); set level and hysteresis, or refine a rough speed",
            time=first[0],
        )
    return PulseTrain(kept, number, missed, int(dropped.size), tuple(sorted(events)))


def _local(intervals: FloatArray) -> FloatArray:
    # mirrored at the ends: of a shaft that stops the last interval by itself would make all before it bounces
    return np.asarray(percentile_filter(intervals, QUANTILE, size=min(REACH, intervals.size), mode="reflect"))


def _without_bounces(edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Edges kept and edges thrown out. Bounces shorten the local interval, so it is taken again until nothing goes."""
    kept = edges
    while True:
        intervals = np.diff(kept)
        short = np.flatnonzero(intervals < BOUNCE * _local(intervals))
        if not short.size:
            break
        # of a run of short intervals only the first ends with a bounce for certain
        first = short[np.concatenate([[True], np.diff(short) > 1])]
        kept = np.delete(kept, first + 1)
        if kept.size < 4:
            break
    return kept, np.setdiff1d(edges, kept)


def _steps(kept: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pulses per interval and how many of them were lost, by the local interval of the whole ones around."""
    intervals = np.diff(kept)
    steps = np.maximum(1, np.rint(intervals / np.maximum(_smallest(intervals), 1e-300))).astype(np.int64)
    for _ in range(3):  # intervals shared out among their pulses give a better local interval
        single = intervals / steps
        local = _median(single)
        steps = np.maximum(1, np.rint(intervals / local)).astype(np.int64)
    local = _median(intervals / steps)
    # of a shaft that starts or stops the local interval says too little: no pulse is lost in an interval that is as
    # long as one beside it
    single = np.pad(intervals / steps, 1, constant_values=0.0)
    beside = np.maximum(single[:-2], single[2:])
    steps = np.where(intervals < 1.5 * beside, 1, steps)
    for end in (slice(None), slice(None, None, -1)):  # from rest: a first interval 2.4 times as long as the second
        first = intervals[end][:4]
        if first.size == 4 and first[0] < 3 * first[1] and (first[1:3] > 1.1 * first[2:]).all():
            steps[end][0] = 1
    off = np.abs(intervals / local - steps)
    doubtful = np.flatnonzero((steps > 1) & (off > WHOLE + 0.01 * steps))
    if doubtful.size:
        at = int(doubtful[0])
        raise SignalError(
            f"the tacho pauses for {intervals[at]:.6g} s after {kept[at]:.6g} s, {intervals[at] / local[at]:.2f} of "
            "its intervals there; the angle across cannot be told, cut the recording into the parts before and after",
            time=float(kept[at]),
        )
    return steps, steps - 1


def find_jump(train: PulseTrain) -> tuple[float, float] | None:
    """The first time in s at which steady intervals of a `train` become a multiple of what they were, or a part, from
    one to the next, and by how much they do; None where they do not. A shaft has an interval on the way.

    The time is off by some intervals where pulses next to it were put in, or taken out."""
    single = np.diff(train.t) / np.diff(train.number)
    if single.size < 2 * STEADY:
        return None
    runs = np.lib.stride_tricks.sliding_window_view(single, STEADY)
    steady = np.ptp(runs, axis=1) < ALIKE * np.median(runs, axis=1)
    times = np.median(runs[STEADY:], axis=1) / np.median(runs[:-STEADY], axis=1)
    whole = np.maximum(times, 1 / times)
    whole = (whole > 1.5) & (np.abs(whole / np.rint(whole) - 1) < MULTIPLE)
    jumps = np.flatnonzero(steady[:-STEADY] & steady[STEADY:] & whole)
    return (float(train.t[jumps[0] + STEADY]), float(times[jumps[0]])) if jumps.size else None


def _median(values: FloatArray) -> FloatArray:
    return np.asarray(percentile_filter(values, 50, size=min(REACH, values.size), mode="nearest"))


def _smallest(intervals: FloatArray) -> FloatArray:
    return np.asarray(percentile_filter(intervals, 30, size=min(REACH, intervals.size), mode="nearest"))
