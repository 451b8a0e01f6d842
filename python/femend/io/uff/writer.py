"""Writing universal files: data sets 58 (binary and text), 55, 2411 or 15, 82, 2412 and 164."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import RecordingError
from femend.io.atomic import atomic_path
from femend.io.uff.geometry import Element2412, Lines82, Nodes, Units164
from femend.io.uff.header58 import Axis, Header58
from femend.io.uff.reader import UniversalFile
from femend.io.uff.set55 import lines_of_55
from femend.io.uff.set58 import Function58, text_widths

__all__ = ["write_uff"]

_SEPARATOR = b"    -1\n"
_BEAMS = (11, 21, 22, 23, 24)
# An axis counts as even where start and step as printed give its last value to this part of a step. Time records
# stay even as long as that does no harm: programs expect it, and rates that are integers are read back exactly.
_AXIS_TOLERANCE, _TIME_TOLERANCE = 1e-6, 1e-3


def write_uff(
    path: str | os.PathLike[str],
    content: UniversalFile | Iterable[Function58],
    *,
    binary: bool = True,
    allow_nan: bool = False,
) -> None:
    """Writes functions, or everything a UniversalFile holds, to `path`; an old file stands until the new is complete.

    `content` comes from `read_uff` or `functions_of`; `binary` samples are little endian. An axis whose start and
    step do not fit the header's columns is written uneven, in double precision. Raises RecordingError for NaN or
    infinity unless `allow_nan`, and for headers or axes that the format cannot hold.

    >>> write_uff("copy.uff", read_uff("high.uff"))       # doctest: +SKIP
    """
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        if isinstance(content, UniversalFile):
            for units in content.units:
                _write_164(file, units)
            for nodes in content.nodes:
                _write_nodes(file, nodes)
            for trace in content.lines:
                _write_82(file, trace)
            if content.elements:
                _write_2412(file, content.elements)
            for mode in content.modes:
                lines = "\n".join([*lines_of_55(mode), ""])
                file.write(_SEPARATOR + lines.encode("utf-8") + _SEPARATOR)
            content = content.functions
        for number, function in enumerate(content, start=1):
            _write_58(file, function, number, binary, allow_nan)


def short_number(value: float, width: int = 12) -> str:
    """The text of at most `width` characters that comes closest to `value` (a blank must remain in the column)."""
    best, error = f"{value:.5e}", float("inf")
    for digits in range(16, 0, -1):
        for text in (f"{value:.{digits}g}", f"{value:.{digits - 1}e}"):
            mantissa, mark, exponent = text.partition("e")
            text = f"{mantissa}e{int(exponent)}" if mark else text
            if len(text) <= width and abs(float(text) - value) < error:
                best, error = text, abs(float(text) - value)
        if error == 0.0:
            break
    return best if any(c in best for c in ".e") or len(best) >= width else best + "."


def _even(function: Function58) -> tuple[float, float] | None:
    """Start and step of the axis where it can be written evenly; None where it cannot."""
    x, n = function.x, function.x.size
    if n < 2:
        x0 = float(short_number(float(x[0]))) if n else 0.0
        return (x0, function.header.dx) if n == 0 or x0 == x[0] or function.header.even else None
    step = function.header.dx if function.header.even else (x[-1] - x[0]) / (n - 1)
    x0, dx = float(short_number(float(x[0]))), float(short_number(float(step)))
    part = _TIME_TOLERANCE if function.header.func_type in (0, 1) else _AXIS_TOLERANCE
    if not function.header.even:  # spaced by itself: only an axis that is even to the last digits becomes one
        part = 1e-9
    error = np.abs(x0 + dx * np.arange(n) - x).max()
    return (x0, dx) if dx > 0 and error <= part * dx else None


def _fit(text: str, width: int) -> str:
    return "".join(c if c.isprintable() else " " for c in text)[:width].ljust(width)


def _axis_line(axis: Axis) -> str:
    a, b, c = axis.exponents
    return f"{axis.type:10d}{a:5d}{b:5d}{c:5d} {_fit(axis.name, 20)} {_fit(axis.unit, 20)}"


def _header_lines(h: Header58, kind: int, n_points: int, even: tuple[float, float] | None) -> list[str]:
    for what, value, width in (("node", h.rsp_node, 10), ("reference node", h.ref_node, 10), ("id", h.func_id, 10)):
        if len(str(value)) > width:
            raise RecordingError(
                f"function {h.ids[0].strip()!r}: {what} {value} does not fit {width} columns of data set 58"
            )
    x0, dx = even if even is not None else (0.0, 0.0)
    numbers = "".join(f"{short_number(v):>13s}" for v in (x0, dx, h.z))
    return [
        *(_fit(line or "NONE", 80) for line in h.ids),
        f"{h.func_type:5d}{h.func_id:10d}{0:5d}{h.load_case:10d} {_fit(h.rsp_name or 'NONE', 10)}{h.rsp_node:10d}"
        f"{h.rsp_dir:4d} {_fit(h.ref_name or 'NONE', 10)}{h.ref_node:10d}{h.ref_dir:4d}",
        f"{kind:10d}{n_points:10d}{1 if even is not None else 0:10d}{numbers}",
        *(_axis_line(axis) for axis in (h.abscissa, h.ordinate, h.denominator, h.z_axis)),
    ]


def _write_58(file: IO[bytes], function: Function58, number: int, binary: bool, allow_nan: bool) -> None:
    h, y = function.header, function.y
    if not allow_nan:
        for what, array in (("value", y), ("abscissa", function.x)):
            bad = ~np.isfinite(array)
            if bad.any():
                at = int(np.flatnonzero(bad)[0])
                raise RecordingError(
                    f"function {number} ({h.ids[0].strip()}): {what} {at + 1} is {array[at]}; data set 58 has no sign "
                    "for missing samples: leave the function out, or pass allow_nan=True"
                )
    even = _even(function)
    is_complex = np.iscomplexobj(y)
    single = h.ord_data_type in (2, 5) and even is not None
    kind = (5 if is_complex else 2) if single else (6 if is_complex else 4)
    parts = ([] if even is not None else [function.x]) + ([y.real, y.imag] if is_complex else [y])
    table = np.column_stack(parts).astype(np.float64)
    header = _header_lines(h, kind, y.size, even)
    if binary:
        samples = np.ascontiguousarray(table, dtype="<f4" if single else "<f8").tobytes()
        start = f"    58b{1:6d}{2:6d}{11:12d}{len(samples):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    else:
        samples = _text_samples(table, kind, even is not None)
        start = "    58"
    file.write(_SEPARATOR + "\n".join([start, *header, ""]).encode("utf-8") + samples)
    file.write((b"\n" if binary else b"") + _SEPARATOR)


def _text_samples(table: NDArray[np.float64], kind: int, even: bool) -> bytes:
    if even:
        per_line = 4 if kind in (4, 6) else 6
        number = "%20.12E" if kind in (4, 6) else "%13.5E"
        flat: list[Any] = table.ravel().tolist()
        full, rest = divmod(len(flat), per_line)
        form = (number * per_line + "\n") * full + (number * rest + "\n" if rest else "")
        return (form % tuple(flat)).encode()
    # Uneven and double: the abscissa has 13 columns, which short_number uses to the last digit.
    per_point = len(text_widths(kind, False)) if kind == 6 else 2
    lines = []
    for i, row in enumerate(table.tolist()):
        point = f"{short_number(row[0]):>13s}" + "".join(f"{v:20.12E}" for v in row[1:])
        lines.append(point + ("\n" if per_point == 3 or i % 2 or i == len(table) - 1 else ""))
    return "".join(lines).encode()


def _write_164(file: IO[bytes], u: Units164) -> None:
    factors = [f"{v:25.17E}".replace("E", "D") for v in (u.length, u.force, u.temperature, u.temperature_offset)]
    text = f"   164\n{u.code:10d}{_fit(u.name, 20)}{2:10d}\n{''.join(factors[:3])}\n{factors[3]}\n"
    file.write(_SEPARATOR + text.encode() + _SEPARATOR)


def _write_nodes(file: IO[bytes], nodes: Nodes) -> None:
    lines = [f"{nodes.number:6d}"]
    for node, (definition, displacement), (x, y, z) in zip(
        nodes.ids.tolist(), nodes.systems.tolist(), nodes.xyz.tolist()
    ):
        head = f"{node:10d}{definition:10d}{displacement:10d}"
        if nodes.number == 15:
            lines.append(f"{head}{0:10d}{x:13.5E}{y:13.5E}{z:13.5E}")
        else:
            lines += [f"{head}{11:10d}", f"{x:25.16E}{y:25.16E}{z:25.16E}".replace("E", "D")]
    file.write(_SEPARATOR + "\n".join([*lines, ""]).encode() + _SEPARATOR)


def _columns(values: Iterable[int]) -> list[str]:
    listed = list(values)
    return ["".join(f"{v:10d}" for v in listed[i : i + 8]) for i in range(0, len(listed), 8)]


def _write_82(file: IO[bytes], trace: Lines82) -> None:
    lines = ["    82", f"{trace.trace:10d}{len(trace.nodes):10d}{0:10d}", _fit(trace.name or "NONE", 80)]
    file.write(_SEPARATOR + "\n".join([*lines, *_columns(trace.nodes), ""]).encode("utf-8") + _SEPARATOR)


def _write_2412(file: IO[bytes], elements: Iterable[Element2412]) -> None:
    lines = ["  2412"]
    for e in elements:
        lines += _columns([e.label, e.descriptor, e.physical, e.material, 7, len(e.nodes)])
        if e.descriptor in _BEAMS:
            lines += _columns([0, 1, 1])
        lines += _columns(e.nodes)
    file.write(_SEPARATOR + "\n".join([*lines, ""]).encode() + _SEPARATOR)
