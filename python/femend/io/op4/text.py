"""ASCII OUTPUT4: integers in fields of 8 (or 16) columns, terms in the Fortran format that the header names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.errors import FormatError
from femend.io.op4.matrix import STRING_UNIT, Columns, Header, Op4Matrix, broken

__all__ = ["read_text"]

# 1P,5E16.9: five numbers of 16 columns a line
_FORMAT = re.compile(rb"(\d{1,2})[EDed](\d{1,2})\.(\d{1,2})")
# digits behind the point that single precision fills
SINGLE_DIGITS = 9
# a line of numbers: what a header or integers cannot be
_NUMBERS = re.compile(rb"[ 0-9+\-EDed]*\.[ 0-9.+\-EDed]*")
# Fortran leaves the E out before an exponent of three digits
_BARE_EXPONENT = re.compile(rb"(?<=[0-9.])([+-]\d{3})$")


@dataclass(frozen=True, slots=True)
class _Format:
    """Columns of a number, and whether it needs double precision."""

    width: int
    double: bool


class _Lines:
    """The lines of a file with their numbers (from 1); one line can be looked at before it is taken."""

    def __init__(self, path: Path) -> None:
        self.file, self.size = str(path), path.stat().st_size
        self.stream = path.open("rb")
        self.number = 0
        self.matrix: str | None = None
        self._read = 0
        self._ahead: bytes | None = None

    @property
    def place(self) -> str:
        return f"line {self.number}"

    def broken(self, what: str) -> FormatError:
        return broken(self.file, what, at=self.place, matrix=self.matrix, record=self.number)

    def peek(self) -> bytes:
        """The next line with anything on it, without its end; empty at the end of the file."""
        while self._ahead is None:
            line = self.stream.readline()
            self._read += 1
            if not line or line.strip():
                self._ahead = line.rstrip()
        return self._ahead

    def take(self) -> bytes:
        line = self.peek()
        self.number = self._read
        if line:
            self._ahead = None
        return line

    def integers(self, n: int) -> list[int]:
        """The next line as `n` integers."""
        line = self.take()
        if not line:
            raise self.broken("the file ends within a matrix")
        found = _fields(line, n)
        if found is None:
            raise self.broken(f"'{_shown(line)}' where {n} integers are due")
        return found


def _shown(line: bytes) -> str:
    return line[:60].decode("ascii", "replace")


def _fields(line: bytes, n: int) -> list[int] | None:
    """The `n` integers that fill a line: with blanks between, or in fields of 8 columns, or of 16."""
    words = line.split()
    for cells in (words, *([line[i : i + width] for i in range(0, len(line), width)] for width in (8, 16))):
        try:
            found = [int(cell) for cell in cells]
        except ValueError:
            continue
        if len(found) == n:
            return found
    return None


def read_text(path: Path, names: set[str] | None) -> Iterator[Op4Matrix]:
    """Matrices of an ASCII file called `names` (all for None); raises FormatError."""
    lines = _Lines(path)
    with lines.stream:
        while lines.peek():
            lines.matrix = None
            header, format_ = _header(lines)
            lines.matrix = header.name
            matrix = _matrix(lines, header, format_, names is None or header.name.upper() in names)
            if matrix is not None:
                yield matrix


def _header(lines: _Lines) -> tuple[Header, _Format]:
    """Header and format of the numbers: NCOL, NR, NF, NTYPE (4I8 or 4I16), name (A8), format."""
    line = lines.take()
    for width in (8, 16):
        try:
            n_cols, n_rows, form, type_ = (int(line[i * width : (i + 1) * width]) for i in range(4))
        except ValueError:
            continue
        name = line[4 * width : 4 * width + 8].decode("ascii", "replace")
        header = Header.of(lines.file, name, (n_cols, n_rows, form, type_), at=lines.place, size=lines.size)
        lines.matrix = header.name
        found = _FORMAT.search(line[4 * width + 8 :])
        if found is None or not 0 < int(found[2]) < 100:
            raise lines.broken(f"'{_shown(line[4 * width + 8 :])}' names no format such as 1P,5E16.9")
        return header, _Format(int(found[2]), header.double or int(found[3]) > SINGLE_DIGITS)
    raise lines.broken(f"'{_shown(line)}' is no header of a matrix (neither is the file binary OUTPUT4)")


def _matrix(lines: _Lines, header: Header, format_: _Format, wanted: bool) -> Op4Matrix | None:
    columns = Columns(header, double=format_.double)
    while True:
        column, row, n_words = lines.integers(3)
        if column > header.n_cols:
            _numbers(lines, 0)
            return columns.matrix() if wanted else None
        columns.open(column, lines.place, lines.number)
        if n_words < 0:
            raise lines.broken(f"column {column} says {n_words} words")
        if row > 0:
            _dense(lines, columns, row, n_words, format_)
        else:
            _strings(lines, columns, n_words, format_)


def _dense(lines: _Lines, columns: Columns, row: int, n_words: int, format_: _Format) -> None:
    """A column without zeros left out. Writers count its numbers, or their words of 4 bytes."""
    head, reals = columns.header, _numbers(lines, format_.width)
    if len(reals) not in (n_words, n_words / 2 if head.double else n_words) or len(reals) % (2 if head.complex else 1):
        raise lines.broken(f"column {columns.column} has {len(reals)} numbers, its head says {n_words}")
    columns.add(row, _typed(reals, format_), lines.place, lines.number)


def _strings(lines: _Lines, columns: Columns, n_words: int, format_: _Format) -> None:
    """A sparse column of `n_words`, string headers included."""
    head = columns.header
    words = 2 if head.double else 1  # of one number
    while n_words > 0:
        if head.bigmat:
            length, row = lines.integers(2)
            length -= 1
        else:
            (packed,) = lines.integers(1)
            length, row = packed // STRING_UNIT - 1, packed % STRING_UNIT
        n_words -= length + (2 if head.bigmat else 1)
        reals = _numbers(lines, format_.width)
        if length <= 0 or n_words < 0 or len(reals) * words != length or len(reals) % (2 if head.complex else 1):
            what = f"a string of {length} words from row {row} in column {columns.column} has {len(reals)} numbers"
            raise lines.broken(what)
        columns.add(row, _typed(reals, format_), lines.place, lines.number)


def _typed(reals: NDArray[np.float64], format_: _Format) -> NDArray[np.floating]:
    with np.errstate(over="ignore"):  # what single precision cannot hold is refused as not finite
        return reals if format_.double else reals.astype(np.float32)


def _numbers(lines: _Lines, width: int) -> NDArray[np.float64]:
    """The numbers on the lines that follow, as many as have decimal points. `width` 0 passes over them."""
    text: list[bytes] = []
    while _NUMBERS.fullmatch(lines.peek()):
        line = lines.take()
        if width:
            if len(line) % width:
                raise lines.broken(f"'{_shown(line)}' is not cut into numbers of {width} columns")
            text.append(line)
    joined = b"".join(text)
    if not joined:
        return np.zeros(0)
    cells = np.frombuffer(joined, f"S{width}")
    try:
        return cells.astype(np.float64)
    except ValueError:
        pass
    try:
        return np.array([_number(cell) for cell in cells.tolist()])
    except ValueError as error:
        raise lines.broken(f"{error}, in the lines up to here") from None


def _number(cell: bytes) -> float:
    text = cell.strip().upper().replace(b"D", b"E")
    return float(text if b"E" in text else _BARE_EXPONENT.sub(rb"E\1", text))
