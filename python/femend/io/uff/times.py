"""Time functions of a universal file as time records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.data import TimeData
from femend.errors import RecordingError
from femend.io.channel_map import ChannelMap, converted
from femend.io.rounded import even_grid
from femend.io.uff.abscissa import abscissa_scale, last_digits
from femend.io.uff.labels import Context, channel_of, label_of, name_of
from femend.io.uff.reader import UniversalFile
from femend.io.uff.set58 import Function58
from femend.numerals import plain
from femend.units import SYSTEMS

# share of the mean step by which a step may be off it
_EVEN = 1e-3

__all__ = ["even_step", "printed_step", "time_data"]


def even_step(x: NDArray[np.float64], name: str) -> float:
    """Step of the evenly spaced axis `x` (n,) in s; raises RecordingError naming the worst step otherwise."""
    steps = np.diff(x)
    step = float((x[-1] - x[0]) / max(len(x) - 1, 1))
    if not np.isfinite(x).all():
        at = int(np.flatnonzero(~np.isfinite(x))[0])
        raise RecordingError(
            f"recording {name!r}: the time of sample {at} is {x[at]}; cut the record there or export it again",
            recording=name,
        )
    if len(x) > 1 and (step <= 0 or np.abs(steps - step).max() > _EVEN * step):
        worst = int(np.argmax(np.abs(steps - step)))
        raise RecordingError(
            f"recording {name!r}: the time axis is not even: step {worst} is {steps[worst]:.6g} s, the mean {step:.6g} "
            "s; resample the recording to an even step",
            recording=name,
        )
    return step


def printed_step(dx: float) -> float:
    """The step meant by a header's digits (six or more): 1/rate where exactly one integer rate prints as these.

    A header writes 1/1024 s as 9.76562e-04; over a minute the rounding would be 30 microseconds. Rates that are no
    integer stay as printed.
    """
    if not (np.isfinite(dx) and dx > 0):
        return dx
    digits = max(len(f"{dx:.16g}".split("e")[0].replace(".", "").lstrip("0")), 6)
    half = 0.5 * 10.0 ** (np.floor(np.log10(dx)) - digits + 1)
    rate = round(1.0 / dx)
    unique = 1.0 / (dx - half) - 1.0 / (dx + half) < 1.0
    if rate >= 1 and unique and abs(1.0 / rate - dx) <= half * (1 + 1e-6):
        return 1.0 / rate
    return dx


def _step(context: Context, function: Function58) -> tuple[float, float]:
    """Start and step of a time function in s."""
    h = function.header
    scale = abscissa_scale(context, function, "s")
    if h.even:
        return h.x0 * scale, printed_step(float(f"{h.dx * scale:.15g}"))
    x = function.x * scale
    try:
        return float(x[0]) if x.size else 0.0, even_step(x, context.name)
    except RecordingError:
        grid = even_grid(x, last_digits(function) * scale) if np.isfinite(x).all() else None
        if grid is None:
            raise
    context.say(
        f"times that are even but for their last digits are taken as even, with a step of {plain(grid[1], 7)} s"
    )
    return grid


def time_data(
    file: UniversalFile,
    functions: Sequence[Function58],
    name: str,
    units: str,
    maps: Sequence[ChannelMap] = (),
) -> tuple[TimeData, list[str]]:
    """Time functions as one TimeData in the unit system `units`, with notes on what was assumed.

    `maps` say it better than the headers of some channels do: their source is the number of the function among the
    time functions, from 0, or its name or the beginning of its id line.
    Raises RecordingError for unequal lengths or steps (naming the data sets), complex time records and everything
    TimeData refuses; UnitError for a unit label that cannot be read.
    """
    context = Context(file, name, SYSTEMS[units])
    first = functions[0]
    t0, dt = _step(context, first)
    channels, rows = [], []
    stated = _stated(functions, maps, name)
    for position, function in enumerate(functions):
        values = np.asarray(function.y.real, dtype=np.float64)
        if position in stated:
            channel, values = converted(stated[position], values, name_of(function), units)
            channel = replace(channel, label=label_of(function))
        else:
            channel, factor = channel_of(context, function, "rsp", function.header.ordinate)
            values = values * factor
        here = f"data set {function.record} ({label_of(function) or channel.text})"
        start, step = _step(context, function)
        if abs(step - dt) > 1e-6 * abs(dt) or abs(start - t0) > 1e-3 * abs(dt):
            raise RecordingError(
                f"recording {name!r}: {here} starts at {start:g} s with step {step:g} s, data set {first.record} at "
                f"{t0:g} s with {dt:g} s; bring the records to one time axis (femend.signal.merge does it), or make "
                "them two recordings",
                recording=name,
                channel=channel.text,
            )
        if function.y.size != first.y.size:
            raise RecordingError(
                f"recording {name!r}: {here} has {function.y.size} samples, data set {first.record} "
                f"({label_of(first)}) has {first.y.size}; cut the records to equal length",
                recording=name,
                channel=channel.text,
            )
        if np.iscomplexobj(function.y) and np.any(function.y.imag):
            raise RecordingError(f"recording {name!r}: {here} is a complex time record; export it as real")
        channels.append(channel)
        rows.append(values)
    printed = first.header.dx * abscissa_scale(context, first, "s")
    if first.header.even and abs(dt - printed) > 1e-12 * abs(dt):
        context.say(f"time step {printed:g} s taken as 1/{round(1 / dt)} s")
    return TimeData(name, dt, np.array(rows), tuple(channels), t0), context.notes


def _stated(functions: Sequence[Function58], maps: Sequence[ChannelMap], name: str) -> dict[int, ChannelMap]:
    """Position of a function -> the map that speaks of it."""
    names = [name_of(f) or label_of(f) for f in functions]
    stated: dict[int, ChannelMap] = {}
    for channel in maps:
        source = channel.source
        begins = [i for i, f in enumerate(functions) if isinstance(source, str) and label_of(f).startswith(source)]
        exact = [i for i, text in enumerate(names) if text == source]
        chosen = (exact or begins)[0] if len(exact or begins) == 1 else channel.find(names, name)
        if chosen in stated:
            raise RecordingError(f"recording {name!r}: two channels have the source {source!r}", recording=name)
        stated[chosen] = channel
    return stated
