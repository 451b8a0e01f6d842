"""Speed and angle of a shaft from its tacho."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, CubicSpline

from femend.data import Speed, TimeData
from femend.errors import SignalError
from femend.numerals import plain
from femend.signal.curve import smooth_curve
from femend.signal.pulses import PulseTrain, find_edges, find_jump, repair_pulses
from femend.signal.tacho_doubts import sampled_too_slowly, varies_slowly
from femend.signal.waveform import (
    align_waveform,
    flank_share,
    is_band_limited,
    refined,
    samples_per_pulse,
    thinned,
    zero_where_it_rises,
)

__all__ = ["speed_from_edges", "speed_from_profile", "tacho_speed"]

FloatArray = NDArray[np.float64]

# samples of the speed per pulse, and pulses beyond which the spline is fitted on every k-th
PER_PULSE, MOST_KNOTS = 4, 2000
# samples per pulse below which edges are not interpolated but the waveform is fitted, and pulses per revolution up to
# which: many average out by themselves
FEW_SAMPLES, FEW_PULSES = 40.0, 8
# samples that a pulse lasts, with its flanks, to which a tacho that its samples determine is refined, and samples of
# the whole record that this may take (160 MB)
DENSE, MOST_REFINED = 80, 20_000_000
# share of the time on the middle half of the flanks from which they are soft: noise of 1 % of the range moves the level
# by a tenth of a degree of a turn there
SOFT = 0.025
# smoothing with which the waveform is fitted: over some ten pulses. Cross validation would follow what single pulses
# are wrong by, which is alike in neighbours
START = 10.0
# edges by which a tacho that is refused may be sampled too slowly, and the percentile of their intervals that is short
FEWEST_EDGES, SHORT = 20, 10
# edges that make a speed
FEWEST = 4


def tacho_speed(
    data: TimeData,
    channel: str | int | None = None,
    *,
    pulses_per_revolution: int = 1,
    level: float | None = None,
    hysteresis: float | None = None,
    falling: bool = False,
    smoothing: float | None = None,
) -> Speed:
    """Speed from a tacho channel of `data` (its name or row; by default the one channel of quantity "tacho").

    Edges through `level` are interpolated between samples, bounces thrown out and lost pulses put in (`repair_pulses`),
    both counted. With several `pulses_per_revolution` the teeth's uneven spacing is estimated and taken out, and angle
    0 is at the first pulse's tooth. Where no `level` is given, and up to eight pulses make a revolution, pulses with
    soft flanks, whose crossing of a level noise and a filter move, are fitted as a whole waveform
    (`femend.signal.waveform`), and so are those that last fewer than forty samples on average, since their edges cannot
    be interpolated, with a smoothing over some ten pulses. Angle 0 is then where the waveform rises through its middle.
    Where a recorder's filter has limited them in band, such pulses are sampled more finely first (Whittaker-Shannon
    interpolation), and their edges count unless they are soft. `smoothing`
    is that of `speed_from_edges`; `hysteresis` and `falling` are those of `find_edges`. Raises SignalError, naming
    channel and time, for a tacho that is missing, stands still, bounces too often or pauses.
    """
    row = _tacho_row(data, channel)
    name = data.channels[row].text
    x, t = data.values[row], data.t
    edges = np.zeros(0)
    try:
        edges = find_edges(x, data.dt, data.t0, level=level, hysteresis=hysteresis, falling=falling)
        whole = level is None and pulses_per_revolution <= FEW_PULSES
        few = whole and samples_per_pulse(x, edges.size) < FEW_SAMPLES
        step = _denser(x, edges) if few and is_band_limited(x) else 1  # what lies between the samples is known
        if step > 1:
            few, t = False, np.asarray(data.t0 + data.dt / step * np.arange((x.size - 1) * step + 1))
            x = refined(x, step)
            edges = find_edges(x, data.dt / step, data.t0, hysteresis=hysteresis, falling=falling)
        # sharp pulses are left to their edges: a waveform has no bins for what lasts a hundredth of a turn
        soft = whole and not few and flank_share(x) > SOFT
        if smoothing is None and (few or (soft and step > 1)):
            smoothing = START
        fit = _fit_edges(edges, pulses_per_revolution, smoothing)
        if few or soft:
            fit = fit.aligned(-x if falling else x, t, smoothing, soft=soft)
        return fit.speed(name)
    except SignalError as error:
        slow = _slow(data.values[row], data.dt, edges, pulses_per_revolution)
        what = f"{slow}. What shows it first: {str(error).split(';')[0]}" if slow else str(error)
        message = f"recording {data.name!r}, channel {name}: {what}"
        raise SignalError(message, recording=data.name, channel=name, time=error.time) from None


def _denser(x: FloatArray, edges: FloatArray) -> int:
    """Samples for one of x (n,) with which the pulses at `edges` (n_edges,) s last DENSE of them where they come
    fastest, or as many as memory has; 1 where they cannot be more."""
    if edges.size < FEWEST:
        return 1
    intervals = np.diff(edges)
    shortest = float(np.percentile(intervals, SHORT) / intervals.mean()) * samples_per_pulse(x, edges.size)
    return int(min(np.ceil(DENSE / max(shortest, 1.0)), MOST_REFINED // x.size))


def _slow(x: FloatArray, dt: float, edges: FloatArray, pulses_per_revolution: int) -> str:
    """A clause on pulses of a tacho x (n,) that come too fast for its sampling, by the times of their `edges`; nothing
    where they do not."""
    if edges.size < FEWEST_EDGES:
        return varies_slowly(x) if edges.size < FEWEST else ""
    fastest = 1.0 / float(np.percentile(np.diff(edges), SHORT))
    return sampled_too_slowly(x, dt, fastest, fastest / max(int(pulses_per_revolution), 1))


def _tacho_row(data: TimeData, channel: str | int | None) -> int:
    if isinstance(channel, str):
        return data.index(channel)
    if channel is not None:
        return int(channel)
    rows = data.rows("tacho")
    if len(rows) == 1:
        return rows[0]
    there = ", ".join(c.text for c in data.channels[:12])
    raise SignalError(
        f"recording {data.name!r} has {len(rows)} tacho channels; name the one to use, or refine a rough speed from "
        f"the orders (refine_speed). Its channels are {there}",
        recording=data.name,
    )


def speed_from_edges(
    edges: FloatArray, *, pulses_per_revolution: int = 1, smoothing: float | None = None, source: str = "tacho"
) -> Speed:
    """Speed from the times `edges` (n,) s of a tacho's pulses, `pulses_per_revolution` of them each turn.

    The angle is a cubic smoothing spline through the pulses: it minimises the squared deviations at the pulses, in
    pulses, plus `smoothing` times the integral of its squared second derivative beside that of a cubic polynomial,
    over t counted in mean intervals.
    None lets generalised cross validation choose (Wahba, Spline Models for Observational Data, SIAM 1990, eq. 4.3.1);
    0 passes through every pulse. `source` names it in messages. Raises SignalError as `repair_pulses` does.
    """
    return _fit_edges(edges, pulses_per_revolution, smoothing).speed(source)


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """Pulse number as a spline `curve` over t / `interval`, from the pulses `train`, `ppr` to a revolution."""

    train: PulseTrain
    ppr: int
    interval: float
    curve: BSpline | CubicSpline
    waveform: str = ""

    def aligned(self, x: FloatArray, t: FloatArray, smoothing: float | None, *, soft: bool = False) -> _Fit:
        """The fit to the whole waveform `x` (n,) at `t` (n,) s between the first and the last pulse; pulses have few
        samples, or `soft` flanks."""
        inside = (t >= self.train.t[0]) & (t <= self.train.t[-1])
        if not isinstance(self.curve, BSpline):  # asked to pass through every pulse
            return self
        x, t = x[inside], t[inside]
        if soft:
            x, t = thinned(x, t, self.train.t.size)
            if smoothing is None and self.train.t.size > MOST_KNOTS:  # as neighbours are averaged there
                smoothing = START
        curve, better = align_waveform(x, t, self.curve, self.interval, self.ppr, smoothing, soft=soft)
        if not better:  # the edges are as even as the waveform makes them, but at a level that noise moves
            curve = zero_where_it_rises(x, t, self.curve, self.interval, self.ppr)
        return replace(self, curve=curve, waveform="of soft flanks" if soft else "of few samples")

    def speed(self, source: str) -> Speed:
        t = _fine(self.train)
        angle = self.curve(t / self.interval) * 2 * np.pi / self.ppr
        rev = self.curve.derivative()(t / self.interval) / (self.ppr * self.interval)
        if rev.min() <= 0:
            at = float(t[np.argmin(rev)])
            message = f"{source}: the smoothed speed is {plain(rev.min())} rev/s at {at:.6g} s; smooth more"
            raise SignalError(message, time=at)
        events = self.train.events
        notes = tuple(f"{text} at {time:.4f} s" for time, text in events[:20])
        if len(events) > 20:
            notes += (f"and {len(events) - 20} more repairs",)
        jump = find_jump(self.train)
        if jump is not None:
            when, times = plain(jump[0], 4), jump[1]
            notes += (f"from about {when} s on pulses are {times:.2f} times as far apart as before, at once",)
        if self.waveform:
            told = "the angle fits the whole waveform, 0 where it rises through its middle"
            notes += (f"pulses {self.waveform}: {told}",)
        return Speed(t, rev, angle, source, int(self.train.t.size), self.train.missed, self.train.doubled, notes)


def _fit_edges(edges: FloatArray, pulses_per_revolution: int, smoothing: float | None) -> _Fit:
    ppr = int(pulses_per_revolution)
    if ppr < 1:
        raise SignalError(f"{pulses_per_revolution} pulses per revolution are none; it is a whole number from 1 on")
    train = repair_pulses(edges, pulses_per_revolution=ppr)
    number = train.number.astype(float)
    if ppr > 1:
        number = number + _tooth_offsets(train, ppr)
    interval = float(np.median(np.diff(train.t) / np.diff(train.number)))
    return _Fit(train, ppr, interval, _smooth(train.t / interval, number, smoothing))


def _fine(train: PulseTrain) -> FloatArray:
    """Times PER_PULSE to every pulse, from the first to the last one."""
    count = int(train.number[-1]) * PER_PULSE
    return np.interp(np.arange(count + 1) / PER_PULSE, train.number, train.t)


def _smooth(x: FloatArray, y: FloatArray, smoothing: float | None) -> BSpline | CubicSpline:
    if smoothing == 0 or x.size < 6:
        return CubicSpline(x, y)
    step = -(-x.size // MOST_KNOTS)
    if step > 1:  # means of neighbouring pulses carry the same curve with less jitter
        whole = x.size // step * step
        inner_x, inner_y = x[:whole].reshape(-1, step).mean(axis=1), y[:whole].reshape(-1, step).mean(axis=1)
        x, y = np.concatenate([[x[0]], inner_x, [x[-1]]]), np.concatenate([[y[0]], inner_y, [y[-1]]])
    return smooth_curve(x, y, lam=smoothing)


def _tooth_offsets(train: PulseTrain, ppr: int) -> FloatArray:
    """What to add to every pulse's number so that unevenly spaced teeth give an even angle; tooth 0 stays.

    The angle is taken as even over whole revolutions (interpolated between pulses of tooth 0), which leaves the mean
    place of every tooth between them.
    """
    tooth = train.number % ppr
    zero = np.flatnonzero(tooth == 0)
    if zero.size < 4:
        return np.zeros(train.number.size)
    turns = CubicSpline(train.t[zero], train.number[zero])
    inside = (train.t >= train.t[zero[0]]) & (train.t <= train.t[zero[-1]])
    apart = turns(train.t) - train.number
    offsets = np.zeros(ppr)
    for k in range(1, ppr):
        own = inside & (tooth == k)
        offsets[k] = float(np.median(apart[own])) if own.any() else 0.0
    return np.asarray(offsets[tooth])


def speed_from_profile(t: FloatArray, rev_per_s: FloatArray, *, source: str = "profile") -> Speed:
    """Speed given as `rev_per_s` (n,) over `t` (n,) s, its angle integrated from 0; `source` names it.

    A motor's voltage or a controller's set value gives such a profile: its phases are not those of a tacho. Raises
    SignalError for a speed that is not positive.

    >>> speed_from_profile(np.array([0.0, 1.0, 2.0]), np.array([1.0, 2.0, 3.0])).angle / (2 * np.pi)
    array([0. , 1.5, 4. ])
    """
    t, rev = np.asarray(t, float), np.asarray(rev_per_s, float)
    if rev.size and not rev.min() > 0:
        at = float(t[int(np.argmin(rev))])
        raise SignalError(
            f"{source}: the speed is {rev.min():.6g} rev/s at {at:.6g} s; cut the standstill out", time=at
        )
    angle = 2 * np.pi * np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (rev[1:] + rev[:-1]))])
    return replace(Speed(t, rev, angle, source), notes=("angle counted from the first sample: no tacho",))
