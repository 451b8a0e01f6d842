"""Text tables: the separator, decimal comma, header lines and complex numbers are found by looking."""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import FormatError
from femend.io.tables.table import Table, step_from

__all__ = ["read_delimited"]

_MISSING = {"", "nan", "n/a", "na", "#n/a", "null", "none", "inf", "-inf", "+inf"}
_PROBE_LINES = 200
# a time of day, or a date with one
_CLOCK = re.compile(r"(?:\d{2,4}[-./]\d{1,2}[-./]\d{1,4}[T ])?\d{1,2}:\d{2}(?::\d{2}(?:\.\d+)?)?")


@dataclass(frozen=True, slots=True)
class _Style:
    separator: str | None  # None: any white space
    comma: bool  # decimal comma
    closed: bool = False  # every line ends with the separator

    def fields(self, line: str) -> list[str]:
        parts = line.split(self.separator)
        if self.closed and len(parts) > 1 and not parts[-1].strip():
            parts.pop()
        return [p.strip().strip('"') for p in parts]

    def plain(self, text: str) -> str:
        return text.replace(",", ".") if self.comma else text


def _number(field: str) -> complex:
    text = field.strip().strip("()").replace(" ", "").replace("i", "j").replace("D", "E").replace("d", "e")
    return complex(text)


def _numeric(fields: list[str], style: _Style, *, gaps: bool = False) -> bool:
    """True where every field is a number (with `gaps`: or missing, if one at least is a number)."""
    seen = False
    for field in fields:
        if field.lower() in _MISSING:
            if gaps:
                continue
            if field == "":
                return False
        try:
            _number(style.plain(field))
        except ValueError:
            return False
        seen = True
    return seen


def _style(lines: list[str]) -> tuple[_Style, int]:
    """The style in which most lines are numbers, and how many columns they have; (style, 0) where none are."""
    best, best_score, columns = _Style(",", False), (0, 0), 0
    styles = [(";", False), (";", True), ("\t", False), ("\t", True), (",", False), (None, False), (None, True)]
    for separator, comma in styles:
        data = [x.rstrip(" ") for x in lines if re.match(r"\s*[\d+\-.(]", x)]
        closed = separator is not None and all(x.endswith(separator) for x in data)
        style = _Style(separator, comma, closed)
        counts: dict[int, int] = {}
        for line in lines:
            fields = style.fields(line)
            if comma and any(f.endswith(",") for f in fields):
                continue
            if _numeric(fields, style, gaps=len(fields) > 1):
                counts[len(fields)] = counts.get(len(fields), 0) + 1
        if counts:
            width = max(counts, key=lambda n: (counts[n], n))
            score = (counts[width], width)
            if score > best_score:
                best, best_score, columns = style, score, width
    return best, columns


def read_delimited(path: Path) -> Table:
    """The columns of a text table (.csv .txt .dat .tsv).

    Separator `;`, tab, comma or blanks; decimal point or (not with comma as separator) decimal comma; any number of
    header lines, of which the first as wide as the data right before it names the columns; complex numbers as
    ``1+2j``. Missing fields become NaN. Raises FormatError with the line for text among the numbers or a line of
    another width.
    """
    lines = _without_end_notes(_text(path).splitlines())
    filled = [line for line in lines if line.strip()]
    if not filled:
        raise FormatError(f"{path} is empty; export it again", file=str(path))
    style, width = _style(_probe(filled))
    if width == 0:
        raise FormatError(
            f"{path}: no line of the file is a row of numbers separated by ';', tab, ',' or "
            f"blanks{_no_numbers(filled)}",
            file=str(path),
        )
    first = next(i for i, x in enumerate(lines) if x.strip() and _is_row(style.fields(x), style, width))
    _refuse_both_commas(path, lines, first, style, width)
    dt = None
    for line in lines[:first]:
        parts = re.split(r"[:=;\t,]", line, maxsplit=1)
        if len(parts) == 2:
            dt = dt or step_from(parts[0].strip('"# '), style.plain(parts[1]).strip())
    names = _names(lines[:first], style, width)
    table = _values(path, lines, first, style, width)
    for column, text in enumerate(names):  # a column "Fs" that holds the rate in its first row, or everywhere
        rest = table[1:, column]
        if dt is None and (np.isnan(rest).all() or (rest == table[0, column]).all()):
            dt = step_from(text, table[0, column].real)
    return Table(str(path), names, tuple(np.ascontiguousarray(c) for c in table.T), dt)


def _text(path: Path) -> str:
    """What stands in the file, in UTF-8, in UTF-16 with its mark (a spreadsheet's "Unicode text") or in Latin-1."""
    data = path.read_bytes()
    encoding = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        raise FormatError(
            f"{path}: holds binary data, and a name that ends in {path.suffix!r} is read as a text table; export it as "
            "text, or correct the ending of its name",
            file=str(path),
        )
    return text


def _without_end_notes(lines: list[str]) -> list[str]:
    """The lines without what a program noted after the last row."""
    n = len(lines)
    while n and (not lines[n - 1].strip() or lines[n - 1].lstrip()[0] in "#%"):
        n -= 1
    return lines[:n]


def _no_numbers(filled: list[str]) -> str:
    """What stands in the way of numbers in the `filled` lines, and what to do about it."""
    for line in filled[len(filled) // 2 :]:
        clock = _CLOCK.search(line)
        if clock is not None:
            return f": {clock[0]!r} is a time of day; export the time in seconds, as a number"
    return f" (one reads {filled[len(filled) // 2][:60]!r}); check the file"


def _probe(filled: list[str]) -> list[str]:
    middle = len(filled) // 2
    return filled[:_PROBE_LINES] + filled[max(middle, _PROBE_LINES) : max(middle, _PROBE_LINES) + _PROBE_LINES]


def _is_row(fields: list[str], style: _Style, width: int) -> bool:
    return len(fields) == width and _numeric(fields, style, gaps=width > 1)


def _refuse_both_commas(path: Path, lines: list[str], first: int, style: _Style, width: int) -> None:
    """Decimal commas between columns that are separated by commas: up to twice as many fields as names, and no point
    in any of them."""
    if style.separator != "," or any("." in x for x in lines[first : first + _PROBE_LINES]):
        return
    words = (style.fields(x) for x in reversed(lines[:first]) if x.strip())
    names = next((w for w in words if not any(_numeric([field], style) for field in w)), [])
    if 1 < len(names) < width <= 2 * len(names):
        raise FormatError(
            f"{path}: {len(names)} columns are named, and the rows have {width} fields without a decimal point: commas "
            "that separate columns and decimal commas cannot be told apart; export it with ';' between columns, or "
            "with decimal points",
            file=str(path),
            record=first + 1,
        )


def _names(header: list[str], style: _Style, width: int) -> tuple[str, ...]:
    names: list[str] | None = None
    for line in reversed(header):
        fields = style.fields(line.lstrip("#% ") if names is None or line[:1] in "#%" else line)
        if len(fields) != width or any(_numeric([f], style) for f in fields):
            break
        names = fields
    return tuple(names) if names is not None else tuple(f"column {i}" for i in range(width))


def _values(path: Path, lines: list[str], first: int, style: _Style, width: int) -> NDArray[Any]:
    body = "\n".join(lines[first:])
    quick = style.plain(body)
    for kind in (np.float64, np.complex128):
        try:
            table = np.loadtxt(io.StringIO(quick), delimiter=style.separator, dtype=kind, ndmin=2, comments=None)
        except ValueError:
            continue
        if table.shape[1] == width:
            return table
    return _row_by_row(path, lines, first, style, width)


def _row_by_row(path: Path, lines: list[str], first: int, style: _Style, width: int) -> NDArray[Any]:
    """The slow and careful way, which knows the line of what is wrong."""
    rows: list[list[complex]] = []
    convert: Callable[[str], complex] = _number
    for at, line in enumerate(lines[first:], start=first + 1):
        if not line.strip():
            continue
        fields = style.fields(line)
        if len(fields) != width:
            raise FormatError(
                f"{path}:{at}: the line has {len(fields)} fields where the table has {width}; the file may be cut off: "
                "mend the line or export the file again",
                file=str(path),
                record=at,
            )
        row = []
        for column, field in enumerate(fields):
            if field.lower() in _MISSING:
                row.append(complex(float("nan")))
                continue
            try:
                row.append(convert(style.plain(field)))
            except ValueError:
                raise FormatError(
                    f"{path}:{at}: field {column} reads {field[:24]!r}, which is not a number; mend it or leave it "
                    "empty",
                    file=str(path),
                    record=at,
                ) from None
        rows.append(row)
    table = np.array(rows, dtype=np.complex128)
    return table if np.nan_to_num(table.imag).any() else table.real.copy()
