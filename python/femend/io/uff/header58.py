"""The header of data set 58 (functions at nodal DOFs): eleven lines in fixed columns, and the binary type line."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femend.errors import FormatError

__all__ = ["DATA_TYPES", "Axis", "Binary58", "Header58", "binary_header", "parse_header"]

Fail = Callable[[str], FormatError]
# ordinate data types of record 7
DATA_TYPES = {2: "real single", 4: "real double", 5: "complex single", 6: "complex double"}


@dataclass(frozen=True, slots=True)
class Binary58:
    """Type line of a binary set: `byte_order` 1 little or 2 big endian, `n_bytes` of samples as declared."""

    byte_order: int
    n_bytes: int


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis of data set 58: specific data `type`, `exponents` of length, force and temperature, name and unit."""

    type: int = 0
    exponents: tuple[int, int, int] = (0, 0, 0)
    name: str = "NONE"
    unit: str = "NONE"


@dataclass(frozen=True, slots=True)
class Header58:
    """Header of data set 58, names as in the format's description.

    `func_type` 0 general, 1 time, 2 auto spectrum, 3 cross spectrum, 4 FRF, 6 coherence, 9 PSD, 12 spectrum;
    `ord_data_type` 2 real single, 4 real double, 5 complex single, 6 complex double.
    """

    ids: tuple[str, str, str, str, str]
    func_type: int
    func_id: int
    load_case: int
    rsp_name: str
    rsp_node: int
    rsp_dir: int
    ref_name: str
    ref_node: int
    ref_dir: int
    ord_data_type: int
    n_points: int
    even: bool
    x0: float
    dx: float
    z: float
    abscissa: Axis
    ordinate: Axis
    denominator: Axis
    z_axis: Axis

    @property
    def is_complex(self) -> bool:
        """True where every point has a real and an imaginary part."""
        return self.ord_data_type in (5, 6)

    @property
    def item_size(self) -> int:
        """Bytes of one number in a binary set (uneven abscissas mostly have the size of the ordinates)."""
        return 8 if self.ord_data_type in (4, 6) else 4

    @property
    def n_values(self) -> int:
        """Numbers in the set, abscissas included."""
        return self.n_points * ((2 if self.is_complex else 1) + (0 if self.even else 1))

    def with_values(self, n_values: int) -> str:
        """The data types, in words, of which as many points take `n_values` numbers; nothing where none does."""
        n = n_values - (0 if self.even else self.n_points)
        kinds = {self.n_points: (2, 4), 2 * self.n_points: (5, 6)}.get(n, ()) if self.n_points else ()
        return " or ".join(f"{k} ({DATA_TYPES[k]})" for k in kinds)

    def with_bytes(self, n_bytes: int) -> str:
        """The data types, in words, of which as many points take `n_bytes`; nothing where none does."""
        like = [replace(self, ord_data_type=k) for k in DATA_TYPES if k != self.ord_data_type]
        kinds = [h.ord_data_type for h in like if h.n_points and h.n_values * h.item_size == n_bytes]
        return " or ".join(f"{k} ({DATA_TYPES[k]})" for k in kinds)

    def has_single_abscissa(self, n_bytes: int) -> bool:
        """True where `n_bytes` of samples are those of uneven abscissas in four bytes beside ordinates in eight.

        So the format has it to the letter (E13.5 beside E20.12), and some programs write it; most write eight for both.
        """
        return not self.even and self.item_size == 8 and 0 < n_bytes == 8 * self.n_values - 4 * self.n_points


def _integer(text: str, what: str, fail: Fail, default: int | None = None) -> int:
    text = text.strip()
    if not text and default is not None:
        return default
    try:
        return int(text)
    except ValueError:
        raise fail(f"{what} is {text!r}, not an integer; the header of data set 58 is damaged") from None


def _real(text: str, what: str, fail: Fail) -> float:
    try:
        value = float(text.strip().replace("D", "E").replace("d", "e") or 0.0)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise fail(f"{what} is {text.strip()!r}, not a number; the header of data set 58 is damaged")
    return value


def binary_header(line: str, fail: Fail) -> Binary58:
    """The type line ``58b`` with byte order, floating format and byte count; raises FormatError through `fail`."""
    fields = line.split()
    if len(fields) < 5:
        raise fail(f"the type line {line.strip()!r} of a binary set lacks byte order and byte count; export it again")
    order, form = _integer(fields[1], "byte order", fail), _integer(fields[2], "floating point format", fail)
    if order not in (1, 2):
        raise fail(f"byte order {order} is neither 1 (little endian) nor 2 (big endian); the type line is damaged")
    if form != 2:
        names = {1: "DEC VMS", 3: "IBM 5/370"}
        raise fail(f"floating point format {form} ({names.get(form, 'unknown')}) is not IEEE 754; export it as text")
    return Binary58(order, _integer(fields[4], "byte count", fail))


def _dof_line(line: str, fail: Fail) -> tuple[int, int, int, str, int, int, str, int, int]:
    """Record 6 in its columns 2(I5,I10),2(1X,10A1,I10,I4); by blanks where the columns do not hold."""
    line = line.ljust(80)
    try:
        return (
            int(line[0:5]),
            int(line[5:15] or 0),
            int(line[20:30].strip() or 0),
            line[31:41].strip(),
            int(line[41:51].strip() or 0),
            int(line[51:55].strip() or 0),
            line[56:66].strip(),
            int(line[66:76].strip() or 0),
            int(line[76:80].strip() or 0),
        )
    except ValueError:
        pass
    match = re.fullmatch(
        r"\s*(\d+)\s+(\d+)\s+(\d+)\s+(\d+)\s+(.*?)\s+(\d+)\s+(-?\d+)\s+(.*?)\s+(\d+)\s+(-?\d+)\s*", line
    )
    if match is None:
        raise fail(f"record 6 (function type and DOFs) reads {line.strip()!r}; its fields are not in their columns")
    return (
        int(match[1]),
        int(match[2]),
        int(match[4]),
        match[5],
        int(match[6]),
        int(match[7]),
        match[8],
        int(match[9]),
        int(match[10]),
    )


def _axis(line: str, fail: Fail) -> Axis:
    line = line.ljust(80)
    try:
        kind = int(line[0:10].strip() or 0)
        exponents = (int(line[10:15].strip() or 0), int(line[15:20].strip() or 0), int(line[20:25].strip() or 0))
        return Axis(kind, exponents, line[26:46].strip() or "NONE", line[47:67].strip() or "NONE")
    except ValueError:
        pass
    match = re.match(r"\s*(\d+)\s+(-?\d+)\s+(-?\d+)\s+(-?\d+)\s*(\S*)\s*(.*?)\s*$", line)
    if match is None:
        raise fail(f"the axis record {line.strip()!r} does not begin with four integers; the header is damaged")
    return Axis(int(match[1]), (int(match[2]), int(match[3]), int(match[4])), match[5] or "NONE", match[6] or "NONE")


def parse_header(lines: Sequence[str], fail: Fail) -> Header58:
    """The eleven lines after the type line of data set 58; raises FormatError, made by `fail`, for damaged ones."""
    if len(lines) < 11:
        raise fail(f"the header of data set 58 has {len(lines)} of 11 lines; the file is cut off: export it again")
    dofs = _dof_line(lines[5], fail)
    fields = lines[6].split()
    if len(fields) < 5:
        raise fail(f"record 7 (data form) reads {lines[6].strip()!r}; it needs type, points, spacing, start and step")
    kind = _integer(fields[0], "ordinate data type", fail)
    if kind not in (2, 4, 5, 6):
        raise fail(f"ordinate data type {kind} is none of 2, 4 (real), 5, 6 (complex); the header is damaged")
    n_points = _integer(fields[1], "number of points", fail)
    if n_points < 0:
        raise fail(f"number of points {n_points} is negative; the header is damaged")
    x0, dx = _real(fields[3], "abscissa minimum", fail), _real(fields[4], "abscissa increment", fail)
    ids = tuple(line.rstrip() for line in lines[:5])
    return Header58(
        (ids[0], ids[1], ids[2], ids[3], ids[4]),
        *dofs,
        kind,
        n_points,
        _integer(fields[2], "abscissa spacing", fail) != 0,
        x0,
        dx,
        _real(fields[5], "z axis value", fail) if len(fields) > 5 else 0.0,
        *(_axis(line, fail) for line in lines[7:11]),
    )
