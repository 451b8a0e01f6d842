"""Arrays in MATLAB (v5 to v7.3) and HDF5 files as columns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import FormatError
from femend.io.tables.table import Table, step_from
from femend.numerals import listed

__all__ = ["read_hdf5", "read_mat"]

# arrays that a message names
SHOWN = 6


class _Columns:
    """Collects the columns of named arrays: a vector is one, a matrix has its samples along the longer side."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.names: list[str] = []
        self.columns: list[NDArray[Any]] = []
        self.dt: float | None = None
        self.notes: list[str] = []
        # what is there and gives no column
        self.others: list[str] = []

    def add(self, name: str, value: Any) -> None:
        array = np.asarray(value)
        if array.dtype.names is not None and {x.lower() for x in array.dtype.names} in ({"real", "imag"}, {"r", "i"}):
            real, imaginary = sorted(array.dtype.names, key=lambda x: x.lower() in ("imag", "i"))
            array = array[real] + 1j * array[imaginary]
        if array.dtype.kind not in "biufc":
            self.others.append(f"{name} (not of numbers)")
            return
        if array.size < 2:
            self.dt = self.dt or step_from(name, array)
            self.others.append(f"{name} ({'one number' if array.size else 'empty'})")
            return
        array = np.squeeze(array)
        if array.ndim > 2:
            self.others.append(f"{name} (of shape {array.shape})")
            self.notes.append(f"{name} of shape {array.shape} passed over: femend takes vectors and matrices")
            return
        array = array.astype(np.complex128 if array.dtype.kind == "c" else np.float64)
        if array.ndim == 1:
            self.names.append(name)
            self.columns.append(array)
            return
        rows = array if array.shape[1] >= array.shape[0] else array.T
        for i, row in enumerate(rows):
            self.names.append(f"{name}[{i}]")
            self.columns.append(np.ascontiguousarray(row))

    def table(self) -> Table:
        if not self.columns:
            there = listed(self.others, SHOWN) if self.others else "nothing"
            raise FormatError(
                f"{self.file}: holds no column of numbers; there is {there}. Save the channels as vectors, or as "
                "matrices with a channel in each row or column",
                file=self.file,
            )
        return Table(self.file, tuple(self.names), tuple(self.columns), self.dt, tuple(self.notes))


def read_mat(path: Path) -> Table:
    """The arrays of a MATLAB file `path` as columns; fields of structs are named ``struct.field``.

    Matrices give columns ``name[0]``, ``name[1]``, ... with samples along the longer side. A scalar dt or fs is the
    step. Raises FormatError for a damaged file.
    """
    from scipy.io import loadmat

    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError:  # v7.3 is HDF5
        return read_hdf5(path)
    except Exception as error:  # scipy raises many kinds for damaged files
        try:
            return read_hdf5(path)
        except FormatError:
            raise FormatError(
                f"{path}: is no MATLAB file that can be read ({error}); save it again", file=str(path)
            ) from error
    columns = _Columns(str(path))

    def visit(name: str, value: Any) -> None:
        fields = getattr(value, "_fieldnames", None)
        if fields is not None:
            for field in fields:
                visit(f"{name}.{field}", getattr(value, field))
        elif not isinstance(value, str | bytes):
            columns.add(name, value)

    for name, value in content.items():
        if not name.startswith("__"):
            visit(name, value)
    return columns.table()


def read_hdf5(path: Path) -> Table:
    """The data sets of an HDF5 file `path` as columns, named ``group/name``; matrices as in `read_mat`.

    The step comes from a scalar data set or attribute called dt or fs. Raises FormatError for a damaged file.
    """
    import h5py

    columns = _Columns(str(path))

    def visit(name: str, item: Any) -> None:
        for key, value in item.attrs.items():
            columns.dt = columns.dt or step_from(str(key), value)
        if not isinstance(item, h5py.Dataset) or name.startswith("#refs#"):
            return
        if item.dtype.kind in "biufcV":
            columns.add(name, item[()])
        else:
            columns.others.append(f"{name} (not of numbers)")

    try:
        with h5py.File(path, "r") as file:  # type: ignore[no-untyped-call]
            for key, value in file.attrs.items():
                columns.dt = columns.dt or step_from(str(key), value)
            file.visititems(visit)
    except OSError as error:
        raise FormatError(
            f"{path}: is no HDF5 file that can be read ({error}); it may be cut off: copy it again", file=str(path)
        ) from error
    return columns.table()
