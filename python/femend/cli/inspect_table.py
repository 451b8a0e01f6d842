"""What `femend inspect` says of a table, which does not know itself where its columns were measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femend.errors import RecordingError
from femend.io.tables import Table, read_table
from femend.io.tables.axis import TIME, called_frequency, frequencies, named, time_axis
from femend.report.numbers import significant
from femend.report.text_table import table

__all__ = ["table_text"]

# step in s from which times are hardly seconds
SLOW = 1.0
MAP = (
    "In a study every column that is used is mapped, the axis is found: [[recording.channel]] with source (number or "
    "name), node, direction, quantity, unit."
)


def table_text(file: Path) -> str:
    """Columns of the table `file` with their sizes, and what is taken as its axis; raises FormatError for a damaged
    file."""
    found = read_table(file).with_pairs()
    head = f"{file}: table, {len(found.names)} columns; {_axis(found)}"
    rows = []
    for i, (name, column) in enumerate(zip(found.names, found.columns, strict=True)):
        good = column[np.isfinite(column)]
        level = [significant(float(np.sqrt(np.mean(np.abs(good) ** 2)))), significant(float(np.abs(good).max()))]
        kind = "complex" if np.iscomplexobj(column) else "real"
        missing = str(column.size - good.size) if good.size < column.size else ""
        rows.append([str(i), name, str(column.size), kind, *(level if good.size else ["", ""]), missing])
    shown = table(["source", "name", "rows", "kind", "rms", "peak", "not numbers"], rows, "rlrlrrr")
    notes = "".join(f"\nnote: {note}" for note in found.notes)
    return f"{head}\n\n{shown}{notes}\n\n{MAP}"


def _axis(found: Table) -> str:
    """The axis, as it would be found if no column were a channel: time where a column called so is even."""
    notes: list[str] = []
    n = max(column.size for column in found.columns)
    lines = any(np.iscomplexobj(column) for column in found.columns)
    try:
        if lines or (called_frequency(found, set()) and not _has_time(found, n)):
            freq = frequencies(found, set(), n, "", notes)
            return f"{n} lines from {freq[0]:.6g} to {freq[-1]:.6g} Hz"
        _, dt = time_axis(found, set(), n, "", notes)
    except RecordingError as error:
        return str(error).removeprefix("recording '': ")
    if dt >= SLOW:
        notes.append("less than a sample a second: a column that counts milliseconds is called 'time [ms]'")
    return f"{n} rows at {1 / dt:.6g} Hz, {n * dt:.6g} s" + "".join(f" ({note})" for note in notes)


def _has_time(found: Table, n: int) -> bool:
    """Whether a column called time is the axis of `n` rows."""
    try:
        return bool(named(found, set(), TIME)) and time_axis(found, set(), n, "", [])[1] > 0
    except RecordingError:
        return False
