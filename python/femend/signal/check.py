"""What is wrong with a record: gaps, dead, held and clipped channels, each with channel and time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import Channel, Remark, TimeData
from femend.errors import SignalError
from femend.numerals import plain

__all__ = ["FAULTS", "Fault", "check_signals", "find_gaps", "notes_of", "require_duration", "require_sound"]

FloatArray = NDArray[np.float64]

FAULTS = ("dead", "weak", "clipped", "held", "gap")

# a channel this much below the median rms of its quantity hears nothing
WEAK = 1e-3
# samples at one value: at the extreme it is a clip, elsewhere a hold
CLIP_RUN, HOLD_RUN = 3, 20
# step into a clip over the channel's smallest step: a crest that quantisation flattens is entered by one step
CLIP_STEP = 4.0
# quantities whose standing still says nothing
QUIET = ("tacho", "voltage", "force")


@dataclass(frozen=True, slots=True)
class Fault:
    """One finding: `kind` (one of FAULTS) on `channel`, row `row`, from `start` to `stop` in s on `count` samples."""

    kind: str
    channel: str
    row: int
    start: float
    stop: float
    count: int
    text: str

    def __str__(self) -> str:
        return self.text


def check_signals(data: TimeData) -> tuple[Fault, ...]:
    """Faults of every channel of `data`, in the order of the rows.

    - dead: one value throughout.
    - weak: rms, without mean, below 1e-3 of the median of three or more channels of the quantity: a cable is off.
    - clipped: three or more samples in a row at the channel's largest or smallest value, entered by a step of more than
      four times the smallest one. A saturation that noise was added to afterwards is not seen.
    - held: 20 or more equal samples in a row elsewhere, and five times as many as usual (not for force, tacho,
      voltage): the link or the logger dropped out.
    """
    rms = data.values.std(axis=1)
    faults: list[Fault] = []
    for row, channel in enumerate(data.channels):
        x = data.values[row]
        if np.ptp(x) == 0:
            faults.append(
                _fault(data, row, "dead", 0, data.n_samples, f"is {x[0]:.6g} in all {data.n_samples} samples")
            )
            continue
        peers = [i for i, c in enumerate(data.channels) if c.quantity == channel.quantity and rms[i] > 0]
        typical = float(np.median(rms[peers]))
        if len(peers) >= 3 and rms[row] < WEAK * typical and channel.quantity not in QUIET:
            text = f"has an rms of {plain(rms[row], 3)}, the median of its quantity is {plain(typical, 3)}"
            faults.append(_fault(data, row, "weak", 0, data.n_samples, text))
        faults += _runs(data, row, channel)
    return tuple(faults)


def require_sound(data: TimeData, allow: Sequence[str] = ("weak", "held")) -> TimeData:
    """`data` itself where it has no faults but of the kinds `allow`; raises SignalError naming channel and time."""
    for fault in check_signals(data):
        if fault.kind not in allow:
            raise SignalError(
                f"{fault.text}; leave the channel out or cut the stretch away",
                recording=data.name,
                channel=fault.channel,
                time=fault.start,
            )
    return data


def notes_of(data: TimeData, rows: Sequence[int]) -> tuple[str, ...]:
    """What `check_signals` finds on some `rows` of `data`, as notes of a result; raises SignalError for a dead one.

    A dead channel gives zeros that look like a node of every shape; the others give values that are wrong in part,
    which the user of the result has to know.
    """
    chosen = data.select(rows)
    faults = check_signals(chosen)
    for fault in faults:
        if fault.kind == "dead":
            raise SignalError(
                f"{fault.text}; leave the dead channel out",
                recording=data.name,
                channel=fault.channel,
                time=fault.start,
            )
    return tuple(fault.text for fault in faults)


def require_duration(data: TimeData, lowest: float, periods: float = 5.0) -> TimeData:
    """`data` itself where it holds `periods` periods of the frequency `lowest` (Hz); raises SignalError where not.

    Five periods leave a line every fifth of `lowest`, the least that tells two modes there apart.
    """
    if not lowest > 0:
        raise SignalError(f"a lowest frequency of {lowest} Hz is none; it must be positive", recording=data.name)
    if data.duration * lowest < periods:
        raise SignalError(
            f"recording {data.name!r} of {data.duration:.6g} s holds {plain(data.duration * lowest, 3)} periods of the "
            f"lowest wanted frequency {lowest:.6g} Hz; it takes {plain(periods, 3)}, so record "
            f"{plain(periods / lowest)} s",
            recording=data.name,
            time=data.t0,
        )
    return data


def find_gaps(t: FloatArray, values: FloatArray, channels: Sequence[Channel], *, name: str = "") -> tuple[Fault, ...]:
    """Gaps of a record that is no TimeData yet: `values` (n_ch, n) at stamps `t` (n,) s, labelled by `channels`.

    A gap is a stretch that is not finite on a channel, or a step between stamps of more than 1.5 times the median one
    (row -1, all channels). `name` is the recording's. Raises SignalError for shapes that do not fit and for stamps that
    do not increase.
    """
    t, values = np.asarray(t, float), np.atleast_2d(np.asarray(values, float))
    if values.shape != (len(channels), t.size) or t.size < 2:
        raise SignalError(f"recording {name!r}: values {values.shape}, {t.size} stamps, {len(channels)} channels")
    steps = np.diff(t)
    if not steps.min() > 0:
        at = float(t[int(np.argmin(steps))])
        raise SignalError(f"recording {name!r}: the time stamps turn back after {at:.6g} s; sort them", time=at)
    faults = []
    for row, channel in enumerate(channels):
        for first, last in _stretches(~np.isfinite(values[row])):
            text = (
                f"recording {name!r}: channel {channel.text} has no values from {t[first]:.6g} to {t[last - 1]:.6g} s"
            )
            faults.append(Fault("gap", channel.text, row, float(t[first]), float(t[last - 1]), last - first, text))
    usual = float(np.median(steps))
    for i in np.flatnonzero(steps > 1.5 * usual):
        lost = round(steps[i] / usual) - 1
        text = f"recording {name!r}: {lost} samples are missing on all channels after {t[i]:.6g} s"
        faults.append(Fault("gap", "all channels", -1, float(t[i]), float(t[i + 1]), lost, text))
    return tuple(faults)


def _fault(data: TimeData, row: int, kind: str, first: int, last: int, what: str) -> Fault:
    channel = data.channels[row].text
    start, stop = data.t0 + first * data.dt, data.t0 + (last - 1) * data.dt
    text = Remark(data.name, f"{what} (from {start:.6g} to {stop:.6g} s)", channel, _alike(kind, data.channels[row]))
    return Fault(kind, channel, row, start, stop, last - first, text)


def _alike(kind: str, channel: Channel) -> str:
    """The fault as sentences that tell the same have it: levels in a unit are told apart by it."""
    return f"{kind} in {channel.unit}" if kind in ("clipped", "held") else kind


def _stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First sample and the one after the last of every run of True."""
    change = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in change.reshape(-1, 2)]


def _runs(data: TimeData, row: int, channel: Channel) -> list[Fault]:
    """Clips and holds of a channel."""
    if channel.quantity in ("tacho", "voltage"):
        return []
    x = data.values[row]
    steps = np.abs(np.diff(x))
    smallest = float(steps[steps > 0].min())
    tolerance = 1e-9 * float(np.ptp(x))
    faults = _clips(data, row, max(smallest, tolerance), tolerance)
    if channel.quantity in QUIET:
        return faults
    same = _stretches(np.diff(x) == 0)
    if same:
        lengths = np.array([b - a + 1 for a, b in same])
        usual = float(np.median(lengths)) if len(same) > 10 else 1.0
        for (a, b), length in zip(same, lengths, strict=True):
            at_extreme = x[a] >= x.max() - tolerance or x[a] <= x.min() + tolerance
            if length >= max(HOLD_RUN, 5 * usual) and not at_extreme:
                held = f"{x[a]:.6g} {channel.unit}".strip()
                faults.append(_fault(data, row, "held", a, b + 1, f"holds {held} on {length} samples"))
    return faults


def _clips(data: TimeData, row: int, smallest: float, tolerance: float) -> list[Fault]:
    """The clip of a channel whose smallest step is `smallest`, at one end of its range or at both."""
    x, unit = data.values[row], data.channels[row].unit
    sides: list[str] = []
    hard: list[tuple[int, int]] = []
    for extreme, side in ((float(x.max()), "largest"), (float(x.min()), "smallest")):
        runs = [r for r in _stretches(np.abs(x - extreme) <= tolerance) if r[1] - r[0] >= CLIP_RUN]
        here = [r for r in runs if _step_into(x, *r) > CLIP_STEP * smallest]
        if here:
            sides.append(f"its {side} value {extreme:.6g} {unit}".strip())
            hard += here
    if not hard:
        return []
    count, first, last = sum(b - a for a, b in hard), min(a for a, _ in hard), max(b for _, b in hard)
    text = f"stays at {' and '.join(sides)} on {count} samples in {len(hard)} stretches: it is clipped"
    found = _fault(data, row, "clipped", first, last, text)
    return [Fault("clipped", found.channel, row, found.start, found.stop, count, found.text)]


def _step_into(x: FloatArray, first: int, last: int) -> float:
    """The larger of the steps into and out of a run of equal samples."""
    before = abs(float(x[first] - x[first - 1])) if first > 0 else 0.0
    after = abs(float(x[last] - x[last - 1])) if last < x.size else 0.0
    return max(before, after)
