"""The abscissa of a function in s or Hz, whatever unit its header states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.errors import RecordingError, UnitError
from femend.io.rounded import printed_unit
from femend.io.uff.labels import Context, is_blank, label_of
from femend.io.uff.set58 import Function58
from femend.units import parse_unit

__all__ = ["AxisKey", "abscissa_scale", "axis_key", "frequencies", "last_digits"]

_TIME, _FREQUENCY = (0, 0, 1, 0), (0, 0, -1, 0)
# number of lines, first, last, and all where they are uneven
AxisKey = tuple[int, float, float, bytes]
# what one unit of the abscissa has to be
_DIMS = {"s": _TIME, "Hz": _FREQUENCY}


def abscissa_scale(context: Context, function: Function58, unit: str) -> float:
    """How many `unit` ("s" or "Hz") one unit of the abscissa of `function` is: 0.001 of ms in s, 1/2π of rad/s in Hz.

    A label that is blank, or that nobody knows, counts as `unit`; the latter is noted. Raises RecordingError for one
    that measures something else, as Hz of a time record does.
    """
    label = function.header.abscissa.unit
    if is_blank(label):
        return 1.0
    try:
        stated = parse_unit(label)
    except UnitError:
        context.say(f"abscissas in {label!r}, which is unknown, are taken as {unit}")
        return 1.0
    if stated.dims != _DIMS[unit]:
        raise RecordingError(
            f"recording {context.name!r}: data set {function.record} ({label_of(function)}) has its abscissa in "
            f"{label!r} where it must be {'a time' if unit == 's' else 'a frequency'}; mend the label of record 8, or "
            "export the function again",
            recording=context.name,
        )
    # rad/s and 1/min are of the dimension of Hz, and a turn is 2 pi of theirs
    turning = unit == "Hz" and any(part in label.lower() for part in ("rad", "deg", "rpm"))
    return stated.factor / (2 * np.pi) if turning else stated.factor


def frequencies(context: Context, function: Function58) -> NDArray[np.float64]:
    """The abscissa (n_points,) in Hz; raises RecordingError where it is none of frequency."""
    return frozen(function.x * abscissa_scale(context, function, "Hz"))


def axis_key(context: Context, function: Function58) -> AxisKey:
    """Functions of the same key have the same frequencies: number of lines, first and last, and of uneven ones each."""
    freq = frequencies(context, function)
    every = b"" if function.header.even else freq.tobytes()
    return freq.size, float(freq[0]) if freq.size else 0.0, float(freq[-1]) if freq.size else 0.0, every


def last_digits(function: Function58) -> NDArray[np.float64]:
    """What the last digit of each abscissa (n_points,) of `function` is worth, in the unit of its header."""
    x = np.abs(function.x)
    if not function.binary:
        return printed_unit(x)
    single = bool(np.all(x == x.astype(np.float32)))  # also of a program that kept four bytes and wrote eight
    stored = np.maximum(x, x.max() / max(x.size, 1))  # 0 is exact, but to nothing of use
    return np.asarray(np.spacing(stored.astype(np.float32) if single else stored), dtype=np.float64)
