"""Binary OUTPUT4: Fortran records of words of 4 bytes, or of 8 where Nastran was run with 64-bit integers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from femend.errors import FormatError
from femend.io.op4.matrix import STRING_UNIT, Columns, Header, Op4Matrix, broken

__all__ = ["Layout", "binary_layout", "read_binary"]

HEADER_WORDS = 6  # NCOL, NR, NF, NTYPE and the name in two words


@dataclass(frozen=True, slots=True)
class Layout:
    """Byte order ("<" or ">") and bytes of a word (4 or 8)."""

    order: str
    word: int

    @property
    def integer(self) -> np.dtype[np.signedinteger]:
        """Integers of the records; the lengths around a record have 4 bytes always."""
        return np.dtype(f"{self.order}i{self.word}")

    def real(self, header: Header) -> np.dtype[np.floating]:
        """Reals of a matrix: with words of 8 bytes single precision has 8 too."""
        return np.dtype(f"{self.order}f{8 if header.double or self.word == 8 else 4}")


def binary_layout(start: bytes) -> Layout | None:
    """Layout of a file by its first bytes, None where it is not binary: its first record is a header of six words."""
    for order in "<>":
        length = int(np.frombuffer(start[:4], f"{order}i4")[0]) if len(start) >= 4 else 0
        if length in (HEADER_WORDS * 4, HEADER_WORDS * 8):
            return Layout(order, length // HEADER_WORDS)
    return None


class _Records:
    """The records of a file, one after the other."""

    def __init__(self, path: Path, layout: Layout) -> None:
        self.file, self.layout = str(path), layout
        self.data = np.memmap(path, dtype=np.uint8, mode="r")
        self.at = 0
        self.number = 0
        self.matrix: str | None = None

    @property
    def place(self) -> str:
        return f"byte {self.at} (record {self.number})"

    def broken(self, what: str) -> FormatError:
        return broken(self.file, what, at=self.place, matrix=self.matrix, record=self.number)

    def next(self) -> bytes:
        """Content of the next record; its length stands before and behind it."""
        self.number += 1
        left = len(self.data) - self.at - 8
        if left < 0:
            raise self.broken("the file ends within a matrix")
        length = self._length(self.at)
        if not 0 <= length <= left:
            raise self.broken(f"a record of {length} bytes where {max(left, 0)} are left")
        end = self.at + 4 + length
        if self._length(end) != length:
            raise self.broken(f"a record of {length} bytes ends with the length {self._length(end)}")
        content = self.data[self.at + 4 : end].tobytes()
        self.at = end + 4
        return content

    def _length(self, at: int) -> int:
        return int.from_bytes(
            self.data[at : at + 4].tobytes(), "little" if self.layout.order == "<" else "big", signed=True
        )

    def integers(self, content: bytes, n: int, start: int = 0) -> list[int]:
        """`n` integers of a record from byte `start` on."""
        word = self.layout.word
        if len(content) < start + n * word:
            raise self.broken(f"a record of {len(content)} bytes where at least {start + n * word} are needed")
        return [int(v) for v in np.frombuffer(content, self.layout.integer, n, start)]


def read_binary(path: Path, layout: Layout, names: set[str] | None) -> Iterator[Op4Matrix]:
    """Matrices of a binary file called `names` (all for None); raises FormatError."""
    records = _Records(path, layout)
    while records.at < len(records.data):
        records.matrix = None
        content = records.next()
        if len(content) != HEADER_WORDS * layout.word:
            raise records.broken(f"a record of {len(content)} bytes where a matrix begins")
        n_cols, n_rows, form, type_ = records.integers(content, 4)
        name = content[4 * layout.word :].decode("ascii", "replace")
        header = Header.of(records.file, name, (n_cols, n_rows, form, type_), at=records.place, size=len(records.data))
        records.matrix = header.name
        matrix = _matrix(records, header, names is None or header.name.upper() in names)
        if matrix is not None:
            yield matrix


def _matrix(records: _Records, header: Header, wanted: bool) -> Op4Matrix | None:
    """The columns up to the record with a column number beyond the last, which ends a matrix."""
    word = records.layout.word
    columns = Columns(header, double=records.layout.real(header).itemsize == 8)
    while True:
        content = records.next()
        column, row, n_words = records.integers(content, 3)
        if column > header.n_cols:
            return columns.matrix() if wanted else None
        if not wanted:
            continue
        columns.open(column, records.place, records.number)
        if n_words < 0 or 3 * word + n_words * word != len(content):
            raise records.broken(f"column {column} says {n_words} words in a record of {len(content)} bytes")
        if row > 0:
            _string(records, columns, row, content, 3 * word, n_words)
        else:
            _strings(records, columns, content)


def _strings(records: _Records, columns: Columns, content: bytes) -> None:
    """A sparse column: strings with their headers, (words + 1, row) with BIGMAT, else both in one integer."""
    word, bigmat = records.layout.word, columns.header.bigmat
    at = 3 * word
    while at < len(content):
        if bigmat:
            length, row = records.integers(content, 2, at)
            n_words = length - 1
        else:
            (packed,) = records.integers(content, 1, at)
            n_words, row = packed // STRING_UNIT - 1, packed % STRING_UNIT
        at += (2 if bigmat else 1) * word
        _string(records, columns, row, content, at, n_words)
        at += n_words * word


def _string(records: _Records, columns: Columns, row: int, content: bytes, at: int, n_words: int) -> None:
    header, word = columns.header, records.layout.word
    real = records.layout.real(header)
    term = real.itemsize * (2 if header.complex else 1)
    if n_words < 0 or at + n_words * word > len(content) or n_words * word % term:
        raise records.broken(f"a string of {n_words} words from row {row} in column {columns.column} does not fit")
    reals = np.frombuffer(content, real, n_words * word // real.itemsize, at)
    native = reals.astype(np.float64 if real.itemsize == 8 else np.float32)
    columns.add(row, native, records.place, records.number)
