"""Tables of columns (CSV, MAT, HDF5, WAV, TDMS) as recordings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from femend.errors import FormatError
from femend.io.tables.arrays import read_hdf5, read_mat
from femend.io.tables.delimited import read_delimited
from femend.io.tables.mapping import table_data
from femend.io.tables.table import Table
from femend.io.tables.waves import read_tdms, read_wav

__all__ = ["EXTENSIONS", "Table", "read_table", "table_data"]

_READERS: dict[str, Callable[[Path], Table]] = {
    ".csv": read_delimited,
    ".txt": read_delimited,
    ".dat": read_delimited,
    ".tsv": read_delimited,
    ".mat": read_mat,
    ".h5": read_hdf5,
    ".hdf5": read_hdf5,
    ".wav": read_wav,
    ".tdms": read_tdms,
}
# how the names of tables end
EXTENSIONS = tuple(_READERS)


def read_table(path: Path) -> Table:
    """The columns of the file at `path`; raises FormatError where its extension is unknown or it is damaged."""
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise FormatError(
            f"{path}: the extension {path.suffix!r} is unknown; recordings are read from .uff .unv "
            f"{' '.join(_READERS)}; export it as one of these",
            file=str(path),
        )
    return reader(path)
