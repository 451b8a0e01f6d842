"""Writing OUTPUT4 files that Nastran (INPUTT4) and its companions read."""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from femend.errors import FormatError
from femend.io.atomic import atomic_path
from femend.io.op4.matrix import STRING_UNIT, Op4Matrix

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["write_op4"]

Layout = Literal["dense", "sparse", "bigmat"]

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]{0,7}")
_TYPES = {np.dtype(t): i for i, t in enumerate((np.float32, np.float64, np.complex64, np.complex128), 1)}
SQUARE, RECTANGULAR, SYMMETRIC = 1, 2, 6
# without BIGMAT row and words share one integer of 32 bits
MAX_SPARSE_ROWS = 65535
MAX_STRING_WORDS = 32766
# integers of an ASCII file have 8 columns
MAX_TEXT_SIZE = 9_999_999
# digits behind the point that bring single and double precision back as they were
DIGITS = {4: 9, 8: 16}


def write_op4(
    path: str | os.PathLike[str],
    matrices: Mapping[str, Any] | Iterable[Op4Matrix],
    *,
    text: bool = False,
    layout: Layout = "sparse",
    byte_order: Literal["little", "big"] = "little",
) -> None:
    """Writes matrices to a Nastran OUTPUT4 file, complete or not at all.

    `matrices` are arrays or sparse arrays (n_rows, n_cols) by name, or `Op4Matrix` as `read_op4` gives them. Precision
    follows the arrays (float32, float64, complex64, complex128; integers become float64); the form is symmetric,
    square or rectangular as the values are, or that of the `Op4Matrix`. `text` writes ASCII; `layout` is "dense"
    (zeros between the first and last term of a column included), "sparse" or "bigmat" (needed beyond 65535 rows).
    All of it reads back exactly. Units are those of the values.

    Raises FormatError for a name that is none (a letter and up to seven letters and digits), for what is not a matrix
    of finite numbers, and for a size the layout cannot hold; ValueError for an unknown `layout` or `byte_order`.
    Source: MSC Nastran DMAP Programmer's Guide, OUTPUT4.

    >>> write_op4("se.op4", {"KXX": K, "MXX": M})  # doctest: +SKIP
    """
    if layout not in ("dense", "sparse", "bigmat"):
        raise ValueError(f"layout {layout!r} is none of dense, sparse and bigmat")
    if byte_order not in ("little", "big"):
        raise ValueError(f"byte_order {byte_order!r} is neither little nor big")
    given = [_matrix(name, a) for name, a in matrices.items()] if isinstance(matrices, Mapping) else list(matrices)
    if not given:
        raise FormatError(f"{os.fspath(path)}: no matrix to write; give at least one", file=os.fspath(path))
    for matrix in given:
        _check(matrix, text, layout)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        for matrix in given:
            if text:
                _write_text(file, matrix, layout)
            else:
                _write_binary(file, matrix, layout, "<" if byte_order == "little" else ">")


def _matrix(name: str, values: Any) -> Op4Matrix:
    from scipy.sparse import csc_array, issparse

    if not issparse(values):
        values = np.asarray(values)
    if values.ndim != 2:
        raise FormatError(f"matrix {name} has shape {values.shape}; give an array of two dimensions")
    if values.dtype not in _TYPES:
        if values.dtype.kind not in "biuf":
            raise FormatError(f"matrix {name} holds {values.dtype}; give real or complex numbers")
        values = values.astype(np.float64)
    data = csc_array(values)
    if data.shape[0] != data.shape[1]:
        form = RECTANGULAR
    else:
        form = SYMMETRIC if np.count_nonzero((data - data.T).data) == 0 else SQUARE
    return Op4Matrix(name.upper() if isinstance(name, str) else str(name), data, form, _TYPES[data.dtype])


def _check(matrix: Op4Matrix, text: bool, layout: Layout) -> None:
    if not _NAME.fullmatch(matrix.name):
        raise FormatError(f"{matrix.name!r} is no matrix name; give a letter and up to seven letters and digits")
    if not np.isfinite(matrix.data.data).all():
        raise FormatError(f"matrix {matrix.name} has terms that are not finite; write finite numbers")
    rows, cols = matrix.shape
    if layout == "sparse" and rows > MAX_SPARSE_ROWS:
        raise FormatError(f"matrix {matrix.name} has {rows} rows; more than {MAX_SPARSE_ROWS} need layout='bigmat'")
    if text and max(rows, cols) > MAX_TEXT_SIZE:
        raise FormatError(f"matrix {matrix.name} is {rows} x {cols}, too large for the fields of an ASCII file")


def _columns(matrix: Op4Matrix, layout: Layout) -> Iterator[tuple[int, list[tuple[int, NDArray[Any]]]]]:
    """(column, strings of (first row, reals)) of every column that is not null, numbers from 1."""
    data: csc_array = matrix.data.copy()
    data.sum_duplicates()
    data.eliminate_zeros()
    dtype = np.dtype({1: np.float32, 2: np.float64, 3: np.complex64, 4: np.complex128}[matrix.type])
    real = np.float32 if matrix.type in (1, 3) else np.float64
    limit = MAX_STRING_WORDS // (dtype.itemsize // 4) if layout == "sparse" else matrix.shape[0] + 1
    for j in range(matrix.shape[1]):
        part = slice(data.indptr[j], data.indptr[j + 1])
        rows, values = data.indices[part], data.data[part].astype(dtype, copy=False)
        if not len(rows):
            continue
        if layout == "dense":
            full = np.zeros(rows[-1] - rows[0] + 1, dtype=dtype)
            full[rows - rows[0]] = values
            yield j + 1, [(int(rows[0]) + 1, full.view(real))]
            continue
        cuts = np.flatnonzero(np.diff(rows) > 1) + 1
        strings = []
        for run in np.split(np.arange(len(rows)), cuts):
            for start in range(0, len(run), limit):
                piece = run[start : start + limit]
                strings.append((int(rows[piece[0]]) + 1, np.ascontiguousarray(values[piece]).view(real)))
        yield j + 1, strings


def _heads(row: int, n_words: int, layout: Layout) -> tuple[int, ...]:
    """The string header: words and row in two integers with BIGMAT, else in one."""
    return (n_words + 1, row) if layout == "bigmat" else (row + STRING_UNIT * (n_words + 1),)


def _n_rows(matrix: Op4Matrix, layout: Layout) -> int:
    return -matrix.shape[0] if layout == "bigmat" else matrix.shape[0]


def _write_binary(file: BinaryIO, matrix: Op4Matrix, layout: Layout, order: Literal["<", ">"]) -> None:
    def record(content: bytes) -> None:
        length = struct.pack(f"{order}i", len(content))
        file.write(length + content + length)

    def integers(*values: int) -> bytes:
        return struct.pack(f"{order}{len(values)}i", *values)

    n_cols = matrix.shape[1]
    name = matrix.name.ljust(8).encode("ascii")
    record(integers(n_cols, _n_rows(matrix, layout), matrix.form, matrix.type) + name)
    for column, strings in _columns(matrix, layout):
        parts, words = [], 0
        for row, reals in strings:
            head = () if layout == "dense" else _heads(row, reals.nbytes // 4, layout)
            parts += [integers(*head), reals.astype(reals.dtype.newbyteorder(order)).tobytes()]
            words += len(head) + reals.nbytes // 4
        record(integers(column, strings[0][0] if layout == "dense" else 0, words) + b"".join(parts))
    end = struct.pack(f"{order}f" if matrix.type in (1, 3) else f"{order}d", 1.0)
    record(integers(n_cols + 1, 1, len(end) // 4) + end)


def _write_text(file: BinaryIO, matrix: Op4Matrix, layout: Layout) -> None:
    word = 4 if matrix.type in (1, 3) else 8
    digits = DIGITS[word]
    width = digits + 7
    per_line = 80 // width

    def line(*values: int, end: str = "\n") -> None:
        file.write(("".join(f"{v:8d}" for v in values) + end).encode("ascii"))

    def numbers(reals: NDArray[Any]) -> None:
        cells = [_number(float(v), digits).rjust(width) for v in reals]
        rows = ("".join(cells[i : i + per_line]) + "\n" for i in range(0, len(cells), per_line))
        file.write("".join(rows).encode("ascii"))

    n_cols = matrix.shape[1]
    head = f"{matrix.name:8s}1P,{per_line}E{width}.{digits}\n"
    line(n_cols, _n_rows(matrix, layout), matrix.form, matrix.type, end=head)
    for column, strings in _columns(matrix, layout):
        if layout == "dense":
            row, reals = strings[0]
            line(column, row, len(reals))
            numbers(reals)
            continue
        words = [len(reals) * word // 4 for _, reals in strings]
        line(column, 0, sum(words) + len(words) * (2 if layout == "bigmat" else 1))
        for (row, reals), n_words in zip(strings, words, strict=True):
            heads = _heads(row, n_words, layout)
            file.write(("".join(f"{v:{8 if layout == 'bigmat' else 12}d}" for v in heads) + "\n").encode("ascii"))
            numbers(reals)
    line(n_cols + 1, 1, 1)
    numbers(np.ones(1))


def _number(value: float, digits: int) -> str:
    """As Fortran writes it: without E before an exponent of three digits."""
    text = f"{value:.{digits}E}"
    mantissa, exponent = text.split("E")
    return mantissa + exponent if len(exponent) > 3 else text
