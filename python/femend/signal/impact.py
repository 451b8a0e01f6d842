"""Impact tests: hits found, judged and averaged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel, TimeData
from femend.errors import SignalError
from femend.numerals import plain
from femend.signal.blocks import Blocks, density_scale
from femend.signal.frf import FrfEstimate, frf_of_blocks
from femend.signal.windows import exponential_window, force_window

__all__ = ["Hit", "ImpactEstimate", "find_hits", "impact_frf"]

FloatArray = NDArray[np.float64]

# a hit rises above this share of the largest one and this multiple of the force record's noise
RISE, OVER_NOISE = 0.1, 8.0
# a second peak above this share of the first is a double hit; a hit weaker than this share of the median is left out
DOUBLE, FEEBLE = 0.05, 0.2
# a recorder's filter rings to both sides around a short blow: so many widths of the pulse around, and samples at
# least, hold a swing of its ringing the other way, which is at least as large next to the blow
RINGING, LEAST_RINGING = 2, 4
# the force window reaches this many widths of the pulse beyond its end, and is at least this many samples
AFTER, LEAST = 2.0, 4
# samples on either side of the pulse that belong to it as far as they stand out of the noise: the filter's ringing
RUNG = 32
# share of its largest value to which a response must have fallen at the end not to be cut off
RUNG_OUT = 0.05


@dataclass(frozen=True, slots=True)
class Hit:
    """One hit: `time` s of its peak and `peak` force, `start` s of its block; kept or not, and why not."""

    record: str
    time: float
    peak: float
    start: float
    kept: bool
    reasons: tuple[str, ...] = ()

    def __str__(self) -> str:
        verdict = "kept" if self.kept else "rejected: " + "; ".join(self.reasons)
        return f"hit at {self.time:.4f} s in {self.record!r}, {plain(self.peak)} peak, {verdict}"


@dataclass(frozen=True, slots=True, eq=False)
class ImpactEstimate:
    """FRF of the kept `hits` with coherence and variance in `estimate`."""

    estimate: FrfEstimate
    hits: tuple[Hit, ...]

    @property
    def frf(self) -> FRF:
        """The averaged FRF."""
        return self.estimate.frf

    @property
    def decay(self) -> float:
        """Decay 1/s that the exponential window added to zeta omega of every mode; `without_window` takes it out."""
        return self.estimate.decay


def find_hits(
    data: TimeData,
    block: float,
    *,
    force: int | None = None,
    before: float = 0.02,
    full_scale: float | None = None,
    double: float = DOUBLE,
) -> tuple[Hit, ...]:
    """Hits in the force channel of `data` (row `force`, by default its one force), each with a block of `block` s.

    A block begins the share `before` of its length ahead of the peak. A hit is rejected, with the reason, for a second
    peak in its block above the share `double` of its own (double hit, or the next one coming too early; not what the
    recorder's filter rings, which swings the other way as far), a force or
    response that is clipped (a flat top of two samples or more at the record's extreme, or at `full_scale` of the
    force), a block that reaches beyond the record, and a peak below a fifth of the median of all.

    Raises SignalError for no force channel, a block longer than the record, and a force without a hit.
    """
    row = _force_row(data) if force is None else int(force)
    channel = data.channels[row].text
    x = data.values[row] - np.median(data.values[row])
    x = x if x.max() >= -x.min() else -x
    n = int(round(block / data.dt))
    if not 8 <= n <= data.n_samples:
        raise SignalError(
            f"recording {data.name!r} of {data.duration:.6g} s cannot be cut into blocks of {block:.6g} s ({n} "
            "samples); choose a shorter block",
            recording=data.name,
        )
    noise = 1.4826 * float(np.median(np.abs(x - np.median(x))))
    level = max(RISE * x.max(), OVER_NOISE * noise)
    if not x.max() > max(level, 0.0):
        raise SignalError(
            f"recording {data.name!r}: the force {channel} peaks at {plain(x.max())}, "
            f"{plain(x.max() / max(noise, 1e-300), 3)} times its noise; there is no hit in it",
            recording=data.name,
            channel=channel,
        )
    peaks = _peaks(x, level, n)
    median = float(np.median(x[peaks]))
    hits = []
    for at in peaks:
        first = int(at) - int(round(before * n))
        reasons = _reasons(data, row, x, int(at), first, n, double, full_scale)
        if x[at] < FEEBLE * median:
            reasons.append(f"peak of {plain(x[at])} against a median of {plain(median)}")
        start = data.t0 + first * data.dt
        time = data.t0 + int(at) * data.dt
        hits.append(Hit(data.name, time, float(x[at]), start, not reasons, tuple(reasons)))
    return tuple(hits)


def _force_row(data: TimeData) -> int:
    rows = data.rows("force")
    if len(rows) == 1:
        return rows[0]
    there = ", ".join(c.text for c in data.channels[:12])
    raise SignalError(
        f"recording {data.name!r} has {len(rows)} force channels, one is wanted; name its row. There are {there}",
        recording=data.name,
    )


def _peaks(x: FloatArray, level: float, n: int) -> NDArray[np.int64]:
    """First peaks above the level; what comes within one block of it belongs to it."""
    above = np.flatnonzero(x > level)
    peaks: list[int] = []
    end = -1
    width = max(3, n // 50)
    for i in above:
        if i < end:
            continue
        at = int(i) + int(np.argmax(x[i : i + width]))
        peaks.append(at)
        end = at + int(0.9 * n)
    return np.array(peaks, dtype=np.int64)


def _reasons(
    data: TimeData, row: int, x: FloatArray, at: int, first: int, n: int, double: float, full_scale: float | None
) -> list[str]:
    reasons = []
    if first < 0 or first + n > data.n_samples:
        reasons.append("its block reaches beyond the record")
    first, last = max(first, 0), min(first + n, data.n_samples)
    pulse_begin, pulse_end = _pulse_begin(x, at), _pulse_end(x, at)
    noise = OVER_NOISE * 1.4826 * float(np.median(np.abs(x)))
    rung = np.maximum(max(double * x[at], noise), _ringing(x, at, first, last))
    again = x[first:last] > rung
    again[max(pulse_begin - first, 0) : pulse_end - first] = False
    if again.any():
        second = first + int(np.argmax(np.where(again, x[first:last], 0.0)))
        reasons.append(
            f"second peak of {x[second] / x[at]:.0%} at {data.t0 + second * data.dt:.4f} s: a double hit, or the next"
        )
    for i, channel in enumerate(data.channels):
        y = data.values[i, first:last]
        whole = data.values[i]
        scale = full_scale if i == row else None
        flat = _flat_top(y, float(whole.max()), scale) or _flat_top(-y, float(-whole.min()), scale)
        if flat is not None and channel.quantity not in ("tacho", "voltage"):
            reasons.append(f"{channel.text} is overloaded at {data.t0 + (first + flat) * data.dt:.4f} s")
    return reasons


def _ringing(x: FloatArray, at: int, begin: int, last: int) -> FloatArray:
    """How far the force swings below 0 around each sample from `begin` to `last`: a hammer pushes, so that this is the
    recorder's anti-alias filter, whose swings the other way are no blows."""
    from scipy.ndimage import minimum_filter1d

    reach = max(LEAST_RINGING, RINGING * (_pulse_end(x, at) - _pulse_begin(x, at)))
    first = max(begin - reach, 0)
    below = minimum_filter1d(x[first : last + reach], 2 * reach + 1, mode="nearest")
    return np.asarray(np.maximum(-below[begin - first : last - first], 0.0))


def _pulse_end(x: FloatArray, at: int) -> int:
    """Sample after the peak where the force first goes below a fiftieth of it, or turns up again from below a half."""
    for i in range(at + 1, x.size):
        if x[i] < 0.02 * x[at] or (x[i] < 0.5 * x[at] and i + 1 < x.size and x[i + 1] > x[i] + 0.02 * x[at]):
            return i
    return int(x.size)


def _pulse_begin(x: FloatArray, at: int) -> int:
    """Sample before the peak where the force was last so low, seen from it backwards as `_pulse_end` forwards."""
    return at - _pulse_end(x[: at + 1][::-1], 0)


def _flat_top(y: FloatArray, extreme: float, full_scale: float | None) -> int | None:
    """First sample of two or more at the channel's extreme (or at full scale) that are entered by a real step."""
    if extreme <= 0:
        return None
    tolerance = 1e-9 * extreme
    top = y >= (min(extreme, full_scale) if full_scale is not None else extreme) - tolerance
    pairs = np.flatnonzero(top[:-1] & top[1:])
    for i in pairs:
        before = y[i] - y[i - 1] if i > 0 else 0.0
        if full_scale is not None or before > 0.01 * extreme:
            return int(i)
    return None


def impact_frf(
    records: TimeData | Sequence[TimeData],
    block: float,
    *,
    end: float = 1.0,
    estimator: str = "H1",
    force: int | None = None,
    before: float = 0.02,
    full_scale: float | None = None,
    double: float = DOUBLE,
    window_force: bool = True,
) -> ImpactEstimate:
    """FRF from repeated hits at one point: all kept hits of `records` averaged, blocks of `block` s each.

    `records` are one recording with several hits or several with the same channels. The force outside its pulse is set
    to zero where `window_force` (ISO 7626-5, 7.4.1). `end` below 1 puts an exponential window on force and response
    that falls to it at the block's end; what that adds to the damping is `decay` of the result. `estimator`, `force`,
    `before`, `full_scale` and `double` are those of `estimate_frf` and `find_hits`. Notes tell responses that have not
    died out at the end of the block.

    Raises SignalError where no hit is kept (with every reason), or the records' channels or rates differ.
    """
    several = [records] if isinstance(records, TimeData) else list(records)
    _refuse_unlike(several)
    row = _force_row(several[0]) if force is None else int(force)
    n = int(round(block / several[0].dt))
    hits: list[Hit] = []
    cut: list[FloatArray] = []
    for data in several:
        found = find_hits(data, block, force=row, before=before, full_scale=full_scale, double=double)
        hits += found
        cut += [_cut(data, row, hit, n, window_force) for hit in found if hit.kept]
    if not cut:
        listed = "; ".join(str(hit) for hit in hits[:8])
        raise SignalError(f"none of {len(hits)} hits can be used: {listed}", recording=several[0].name)
    dt = several[0].dt
    window = exponential_window(n, dt, end)
    x = np.array(cut)
    notes = _cut_off(x * window.values, several[0].channels, row)
    X = np.fft.rfft(x * window.values, axis=2)
    freq = np.asarray(np.fft.rfftfreq(n, dt), dtype=np.float64)
    blocks = Blocks(freq, X, density_scale(n, dt, window.power), float(len(cut)), window.decay)
    outs = [i for i, c in enumerate(several[0].channels) if i != row and c.dof is not None and c.quantity != "force"]
    found_frf = frf_of_blocks(several[0].name, several[0].channels, blocks, [row], outs, estimator)
    return ImpactEstimate(replace(found_frf, notes=(*found_frf.notes, *notes)), tuple(hits))


def _refuse_unlike(records: Sequence[TimeData]) -> None:
    first = records[0]
    for other in records[1:]:
        same = [c.dof for c in other.channels] == [c.dof for c in first.channels]
        if not same or abs(other.dt / first.dt - 1) > 1e-9:
            raise SignalError(
                f"recording {other.name!r} has {len(other.channels)} channels at {other.rate:.9g} Hz, {first.name!r} "
                f"{len(first.channels)} at {first.rate:.9g} Hz; hits are averaged over equal channels and rates",
                recording=other.name,
            )


def _cut(data: TimeData, row: int, hit: Hit, n: int, window_force: bool) -> FloatArray:
    """Block (n_ch, n) of a hit: offsets before it taken out, the force without what is not its pulse."""
    first = int(round((hit.start - data.t0) / data.dt))
    at = int(round((hit.time - data.t0) / data.dt))
    block = np.array(data.values[:, first : first + n])
    quiet = max(1, int(0.8 * (at - first)))
    block -= np.median(block[:, :quiet], axis=1, keepdims=True) if quiet >= 5 else block.mean(axis=1, keepdims=True)
    if window_force:
        x = data.values[row] - np.median(data.values[row])
        x = x if x.max() >= -x.min() else -x
        begin, stop = _pulse_begin(x, at), _pulse_end(x, at)
        more = max(LEAST, int(AFTER * (stop - begin)))
        begin, stop = _with_ringing(x, begin, stop)
        keep = force_window(n, max(0, begin - first - LEAST), min(n, stop - first + more), more)
        block[row] *= keep.values
    return block


def _with_ringing(x: FloatArray, begin: int, stop: int) -> tuple[int, int]:
    """The pulse from `begin` to before `stop` with what rings around it, without which the force lacks its highest
    frequencies."""
    first = max(begin - RUNG, 0)
    noise = OVER_NOISE * 1.4826 * float(np.median(np.abs(x)))
    rings = first + np.flatnonzero(np.abs(x[first : stop + RUNG]) > noise)
    return min(begin, int(rings[0])), max(stop, int(rings[-1]) + 1)


def _cut_off(x: FloatArray, channels: Sequence[Channel], row: int) -> list[str]:
    """Notes on responses that have not died out at the end of their blocks."""
    last = max(1, x.shape[2] // 20)
    left = np.sqrt((x[:, :, -last:] ** 2).mean(axis=(0, 2))) / np.maximum(np.abs(x).max(axis=(0, 2)), 1e-300)
    ringing = [int(i) for i in np.flatnonzero(left > RUNG_OUT) if i != row]
    if not ringing:
        return []
    names = ", ".join(channels[i].text for i in ringing[:6])
    return [
        f"{len(ringing)} responses still ring at {left[ringing].max():.0%} of their peak at the block's end ({names}): "
        "longer blocks or an exponential window (end < 1) avoid leakage"
    ]
