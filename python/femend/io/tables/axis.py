"""Which column of a table is its axis, and what the axis says: start and step in s, or frequencies in Hz."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import RecordingError
from femend.io.rounded import even_grid, printed_unit
from femend.io.tables.table import Table
from femend.numerals import plain

__all__ = ["TIME", "called_frequency", "frequencies", "named", "time_axis"]

FloatArray = NDArray[np.float64]

TIME = re.compile(r"(?:.*[./])?(?:time|t|zeit|temps|tijd|seconds?)(?:[\s_\[(].*)?", re.IGNORECASE)
FREQ = re.compile(r"(?:.*[./])?(?:freq|frequency|frequencies|frequenz|f|hz|omega)(?:[\s_\[(].*)?", re.IGNORECASE)
_COUNTER = re.compile(r"(?:.*[./])?(?:index|sample|samples|no|nr|n|i|count|line|row|#)\W*", re.IGNORECASE)
# a unit at the end of a time column's name, and how many seconds it is
_UNIT = re.compile(r"[\[(_\s](ms|us|µs|μs)[\])]?$")
_SECONDS = {"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6}
# a step may be off the mean by this share of it, and two axes may be off each other
_EVEN = 1e-2


def named(table: Table, used: set[int], pattern: re.Pattern[str]) -> list[int]:
    """Columns that are no channel (`used`), hold more than one value and are called like the `pattern`."""
    return [
        i
        for i, text in enumerate(table.names)
        if i not in used and pattern.fullmatch(text.strip()) and table.columns[i].size > 1
    ]


def called_frequency(table: Table, used: set[int]) -> list[int]:
    """Columns called frequency that may be one: increasing from 0 or above. A force is often called F, too."""
    return [i for i in named(table, used, FREQ) if _from_zero_on(table.columns[i])]


def _from_zero_on(column: NDArray[Any]) -> bool:
    if not np.isfinite(column).all() or (np.iscomplexobj(column) and np.any(column.imag)):
        return False
    return bool(column[0].real >= 0 and np.diff(column.real).min() > 0)


def time_axis(table: Table, used: set[int], n: int, name: str, notes: list[str]) -> tuple[float, float]:
    """Start and step in s of `n` samples: of a column called time, else the step the table states, else of a column
    that increases evenly, which the `notes` then say.

    Raises RecordingError for less than two rows, where there is no axis, where it is not even or of another length, and
    where two columns called time have different steps.
    """
    if n < 2:
        raise RecordingError(
            f"recording {name!r}: {table.file} has {n} row of numbers, a recording at least 2; export it again",
            recording=name,
        )
    columns = named(table, used, TIME)
    if columns:
        return _of_named(table, columns, n, name, notes)
    if table.dt is not None:
        return 0.0, table.dt
    column = _increasing(table, used, n)
    if column is None:
        taken = [table.names[i] for i in sorted(used) if TIME.fullmatch(table.names[i].strip())]
        why = f"column {taken[0]!r} is mapped as a channel and no other" if taken else "no column"
        todo = "take it out of the channels" if taken else "add a time column"
        raise RecordingError(
            f"recording {name!r}: {table.file} has no time axis: {why} is called time or t, none increases evenly, "
            f"and no dt or fs is stated; {todo}",
            recording=name,
        )
    notes.append(f"column {table.names[column]!r}, which increases evenly, is taken as time in s")
    return _start_and_step(_seconds(table, column, n, name), name, table.names[column])


def _of_named(table: Table, columns: list[int], n: int, name: str, notes: list[str]) -> tuple[float, float]:
    found: list[tuple[int, float, float]] = []
    first: RecordingError | None = None
    for i in columns:
        try:
            values = _seconds(table, i, n, name)
            found.append((i, *_start_and_step(values, name, table.names[i], partial(_printed, table, i), notes)))
        except RecordingError as error:
            first = first or error
    if not found:
        assert first is not None
        raise first
    i, t0, dt = found[0]
    for k, _, other in found[1:]:
        if abs(other - dt) > _EVEN * dt:
            raise RecordingError(
                f"recording {name!r}: {table.file} has two time axes: column {i} ({table.names[i]!r}) has a step of "
                f"{dt:.6g} s and column {k} ({table.names[k]!r}) one of {other:.6g} s; rename or take out the one that "
                "is not the time of these channels",
                recording=name,
                channel=table.names[k],
            )
    return t0, dt


def _seconds(table: Table, column: int, n: int, name: str) -> FloatArray:
    values = _values(table, column) * _scale(table, column)
    if values.size != n:
        raise RecordingError(
            f"recording {name!r}: the time column has {values.size} rows and the channels {n}; cut them to one length",
            recording=name,
        )
    return values


def _scale(table: Table, column: int) -> float:
    """Seconds in the unit of a time column."""
    unit = _UNIT.search(table.names[column].strip())
    return _SECONDS[unit[1]] if unit is not None else 1.0


def _printed(table: Table, column: int) -> FloatArray:
    """What the last digits of a time column are worth, in s."""
    return printed_unit(_values(table, column)) * _scale(table, column)


def _values(table: Table, i: int) -> FloatArray:
    return np.asarray(table.columns[i].real, dtype=np.float64)


def _increasing(table: Table, used: set[int], n: int) -> int | None:
    """The first unused column of n values that increases evenly and does not just count samples."""
    for i, text in enumerate(table.names):
        column = table.columns[i]
        if i in used or column.size != n or n < 3 or _COUNTER.fullmatch(text.strip()):
            continue
        if np.iscomplexobj(column) and np.any(column.imag):
            continue
        steps = np.diff(column.real)
        mean = steps.mean()
        if mean > 0 and np.abs(steps - mean).max() <= _EVEN * mean:
            return i
    return None


def _start_and_step(
    values: FloatArray,
    name: str,
    column: str,
    printed: Callable[[], FloatArray] | None = None,
    notes: list[str] | None = None,
) -> tuple[float, float]:
    """Start and step in s of times `values` (n,); of those that are uneven for being rounded, each to `printed` (n,) s,
    the even step that they come from, which the `notes` then say."""
    if not np.isfinite(values).all():
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        raise RecordingError(
            f"recording {name!r}: the time column {column!r} has no number in row {at}; fill it in or cut the "
            "record there",
            recording=name,
            channel=column,
        )
    steps = np.diff(values)
    step = float((values[-1] - values[0]) / (values.size - 1))
    worst = int(np.argmax(np.abs(steps - step)))
    if step <= 0:
        raise RecordingError(
            f"recording {name!r}: the time column {column!r} does not increase: it goes from {values[0]:.9g} to "
            f"{values[-1]:.9g} s in {values.size} rows; export the time with more digits, or rename the column if it "
            "is no time",
            recording=name,
            channel=column,
        )
    if abs(steps[worst] - step) <= _EVEN * step:
        return float(values[0]), step
    unit = printed() if printed is not None else printed_unit(values)
    coarse, grid = float(unit.max()), even_grid(values, unit)
    if grid is not None and notes is not None:
        notes.append(
            f"the times of column {column!r} are rounded to {plain(coarse)} s: each is within half a last digit of an "
            f"even step of {plain(grid[1], 7)} s, which is taken"
        )
        return grid
    todo = "resample the recording to an even step"
    if coarse > _EVEN * step:
        todo = f"its last digits are worth up to {plain(coarse)} s: export the time with more digits, or {todo}"
    raise RecordingError(
        f"recording {name!r}: the time column {column!r} is not even: its step is {steps[worst]:.6g} s after row "
        f"{worst} and {step:.6g} s on average; {todo}",
        recording=name,
        channel=column,
    )


def frequencies(table: Table, used: set[int], n: int, name: str, notes: list[str]) -> FloatArray:
    """Frequencies (n,) in Hz of `n` lines, of a column called freq (the first that increases from 0 or above), else of
    one that increases evenly, which the `notes` then say; raises RecordingError where there is none."""
    columns = called_frequency(table, used) or named(table, used, FREQ)
    column = columns[0] if columns else _increasing(table, used, n)
    if not columns and column is not None:
        notes.append(f"column {table.names[column]!r}, which increases evenly, is taken as frequency in Hz")
    if column is None or table.columns[column].size != n:
        raise RecordingError(
            f"recording {name!r}: {table.file} has no frequency axis of {n} lines: no column is called freq, f or Hz "
            "and none increases evenly; add a frequency column",
            recording=name,
        )
    angular = re.search(r"rad/?s|omega", table.names[column], re.IGNORECASE) is not None
    return _values(table, column) / (2 * np.pi if angular else 1.0)
