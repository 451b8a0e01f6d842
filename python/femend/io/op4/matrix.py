"""A matrix of an OUTPUT4 file, and how it grows from the columns found there.

Source: MSC Nastran DMAP Programmer's Guide, module OUTPUT4, remarks 1 to 11 (records, string headers, forms, types).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import FormatError

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["FORMS", "STRING_UNIT", "TYPES", "Columns", "Header", "Op4Matrix", "broken"]

# NTYPE: what a term is; words of 4 bytes it takes
TYPES = {1: "real single", 2: "real double", 3: "complex single", 4: "complex double"}
FORMS = {1: "square", 2: "rectangular", 3: "diagonal", 4: "lower", 5: "upper", 6: "symmetric", 8: "identity"}
IDENTITY = 8
# a string header without BIGMAT is row + STRING_UNIT * (words + 1)
STRING_UNIT = 65536
# Null columns are not in the file, so that its size does not bound their number. A claim beyond both this and the
# number of bytes is a damaged header and would only fill the memory.
MAX_NULL_COLUMNS = 1_000_000
MAX_ROWS = 2**31 - 1


@dataclass(frozen=True, eq=False)
class Op4Matrix:
    """A named matrix as an OUTPUT4 file holds it.

    `data` is sparse (n_rows, n_cols), real or complex, in single precision where the file has it so; `form` is
    Nastran's number (1 square, 2 rectangular, 6 symmetric, 8 identity ...), `type` 1 real single, 2 real double,
    3 complex single, 4 complex double. What 64-bit Nastran calls single, with words of 8 bytes or more than nine
    digits, is double here. Values carry no units: they are those of the model that made them.
    """

    name: str
    data: csc_array
    form: int
    type: int

    @property
    def shape(self) -> tuple[int, int]:
        """(n_rows, n_cols)."""
        rows, cols = self.data.shape
        return int(rows), int(cols)

    def toarray(self) -> NDArray[Any]:
        """The matrix with its zeros, (n_rows, n_cols)."""
        return np.asarray(self.data.toarray())

    def __repr__(self) -> str:
        rows, cols = self.shape
        form = FORMS.get(self.form, f"form {self.form}")
        return f"Op4Matrix({self.name}, {rows} x {cols}, {form}, {TYPES[self.type]}, {self.data.nnz} terms)"


def broken(file: str, what: str, *, at: str, matrix: str | None = None, record: int | None = None) -> FormatError:
    """The error for what cannot be OUTPUT4: `at` is the place ("byte 48", "line 7"), `record` its number."""
    subject = f"{file}: matrix {matrix}" if matrix else file
    return FormatError(
        f"{subject}, {at}: {what}; the file is cut off or damaged, or is no OUTPUT4 file: copy it again in binary mode "
        "or write it anew",
        file=file,
        record=record,
    )


@dataclass(frozen=True, slots=True)
class Header:
    """What stands before the columns of a matrix. `n_rows` is positive, `bigmat` says that the file has it negative."""

    file: str
    name: str
    n_cols: int
    n_rows: int
    form: int
    type: int
    bigmat: bool
    at: str

    @classmethod
    def of(cls, file: str, name: str, numbers: tuple[int, int, int, int], *, at: str, size: int) -> Header:
        """Checked header from NCOL, NR, NF, NTYPE of a file of `size` bytes; raises FormatError."""
        n_cols, n_rows, form, type_ = numbers
        name = name.replace(" ", "").replace("\0", "")
        if not name or not name.isascii() or not name.isprintable():
            raise broken(file, f"{name!r} is no matrix name", at=at)
        if type_ not in TYPES:
            raise broken(file, f"type {type_} is none of 1 to 4", at=at, matrix=name)
        if not 0 < form < 100:
            raise broken(file, f"form {form} is unknown", at=at, matrix=name)
        if n_cols < 0 or abs(n_rows) > MAX_ROWS or n_cols > max(MAX_NULL_COLUMNS, size):
            what = f"a size of {abs(n_rows)} x {n_cols} in a file of {size} bytes"
            raise broken(file, what, at=at, matrix=name)
        return cls(file, name, n_cols, abs(n_rows), form, type_, n_rows < 0, at)

    @property
    def complex(self) -> bool:
        """Are the terms complex?"""
        return self.type >= 3

    @property
    def double(self) -> bool:
        """Are the terms in double precision?"""
        return self.type in (2, 4)


class Columns:
    """Collects the strings of a matrix, column by column; memory follows what is in the file, not what it claims."""

    def __init__(self, header: Header, *, double: bool) -> None:
        self.header = header
        self.type = (4 if double else 3) if header.complex else (2 if double else 1)
        self.starts: list[tuple[int, int, int]] = []  # column and first row from 0, number of terms
        self.values: list[NDArray[Any]] = []
        self.column = 0
        self.row = 0

    def open(self, column: int, at: str, record: int) -> None:
        """Begins column `column` (from 1); columns come in ascending order."""
        if not self.column < column <= self.header.n_cols:
            what = f"column {column} after column {self.column} of {self.header.n_cols}"
            raise broken(self.header.file, what, at=at, matrix=self.header.name, record=record)
        self.column, self.row = column, 0

    def add(self, row: int, reals: NDArray[Any], at: str, record: int) -> None:
        """Adds a string of terms, `reals` (n,), from `row` (from 1) on; of complex ones real and imaginary parts
        alternate."""
        head = self.header
        values = reals.view(np.complex64 if reals.dtype == np.float32 else np.complex128) if head.complex else reals
        if not self.row < row or row + len(values) - 1 > head.n_rows:
            what = f"rows {row} to {row + len(values) - 1} in column {self.column} of {head.n_rows} rows"
            what += f", after row {self.row}" if self.row else ""
            raise broken(head.file, what, at=at, matrix=head.name, record=record)
        if not np.isfinite(reals).all():
            what = f"column {self.column} has a term that is not finite"
            raise broken(head.file, what, at=at, matrix=head.name, record=record)
        self.row = row + len(values) - 1
        self.starts.append((self.column - 1, row - 1, len(values)))
        self.values.append(values)

    def matrix(self) -> Op4Matrix:
        """The matrix of all strings; zeros written between terms are not kept."""
        from scipy.sparse import csc_array, eye_array

        head = self.header
        dtype = {1: np.float32, 2: np.float64, 3: np.complex64, 4: np.complex128}[self.type]
        shape = (head.n_rows, head.n_cols)
        if head.form == IDENTITY and not self.starts and head.n_rows == head.n_cols:
            return Op4Matrix(head.name, csc_array(eye_array(head.n_rows).astype(dtype)), head.form, self.type)
        starts = np.array(self.starts, dtype=np.int64).reshape(-1, 3)
        terms = np.zeros(head.n_cols + 1, dtype=np.int64)
        np.add.at(terms, starts[:, 0] + 1, starts[:, 2])
        values = np.concatenate([np.zeros(0, dtype=dtype), *self.values]).astype(dtype, copy=False)
        rows = [np.arange(row, row + n) for _, row, n in self.starts]
        indices = np.concatenate([np.zeros(0, dtype=np.int64), *rows])
        data = csc_array((values, indices, np.cumsum(terms)), shape=shape)
        data.eliminate_zeros()
        return Op4Matrix(head.name, data, head.form, self.type)
