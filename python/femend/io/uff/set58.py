"""Samples of data set 58, text and binary, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.io.uff.header58 import DATA_TYPES, Fail, Header58, parse_header
from femend.io.uff.scan import RawSet, decode

__all__ = ["Function58", "read_58", "text_widths"]


@dataclass(frozen=True, slots=True, eq=False)
class Function58:
    """Data set 58: `header`, abscissa `x` (n_points,) and ordinate `y` (n_points,) real or complex, as in the file.

    `record` is the position of the data set in the file, from 1.
    """

    header: Header58
    x: NDArray[np.float64]
    y: NDArray[Any]
    record: int = 0
    binary: bool = False


def text_widths(ord_data_type: int, even: bool) -> list[int]:
    """Column widths of one line of samples, by the format's description (E13.5 and E20.12).

    `ord_data_type` 2, 4, 5 or 6 as in the header, `even` spacing or not.
    """
    double = ord_data_type in (4, 6)
    if even:
        return [20] * 4 if double else [13] * 6
    if not double:
        return [13] * 6
    return [13, 20, 20] if ord_data_type == 6 else [13, 20, 13, 20]


def _by_columns(text: bytes, header: Header58) -> list[str]:
    """Numbers that touch each other, cut at the columns of the format."""
    numbers = []
    for raw in text.splitlines():
        line, at = decode(raw), 0
        for width in text_widths(header.ord_data_type, header.even):
            field = line[at : at + width].strip()
            if field:
                numbers.append(field)
            at += width
    return numbers


def _text_numbers(text: bytes, header: Header58, fail: Fail) -> NDArray[np.float64]:
    plain = text.replace(b"D", b"E").replace(b"d", b"e") if (b"D" in text or b"d" in text) else text
    needed = header.n_values
    tokens: list[Any] = plain.split()
    if len(tokens) == needed:
        try:
            return np.array(tokens, dtype=np.float64)
        except ValueError:
            pass
    _refuse_count(tokens, header, fail)
    fields = _by_columns(plain, header)
    values = np.empty(len(fields))
    for i, field in enumerate(fields):
        try:
            values[i] = float(field)
        except ValueError:
            raise fail(
                f"sample {i + 1} of {needed} reads {field[:24]!r}, which is not a number; mend the line or export again"
            ) from None
    if len(values) < needed:
        raise fail(
            f"the header announces {needed} numbers ({header.n_points} points) but {len(values)} are there; the record "
            "is truncated: export it again or correct the number of points"
        )
    if len(values) > needed and not _fills_line(values[needed:], header):
        raise fail(
            f"the header announces {needed} numbers ({header.n_points} points) but {len(values)} are there; correct "
            "the number of points or export it again"
        )
    return values[:needed]


def _fills_line(surplus: NDArray[np.float64], header: Header58) -> bool:
    """True where what follows the announced numbers are zeros, as many as may fill the last line."""
    return not surplus.any() and surplus.size < len(text_widths(header.ord_data_type, header.even))


def _refuse_count(tokens: list[Any], header: Header58, fail: Fail) -> None:
    """Raises what `fail` makes where the numbers are as many as those of the other kind, real or complex, would be, and
    the surplus is not one that fills a line."""
    other = header.with_values(len(tokens))
    if not other:
        return
    try:
        values = np.array(tokens, dtype=np.float64)
    except ValueError:  # numbers that touch each other
        return
    if len(values) > header.n_values and _fills_line(values[header.n_values :], header):
        return
    raise fail(
        f"the header announces {header.n_values} numbers ({header.n_points} points of ordinate data type "
        f"{header.ord_data_type}, {DATA_TYPES[header.ord_data_type]}) but {len(tokens)} are there, as of type {other}: "
        "correct the data type or the number of points in record 7, or export it again"
    )


# decades over which the values of a record read in the wrong byte order spread at least
SWAPPED_DECADES = 20.0


def _sane(array: NDArray[Any]) -> float:
    """Share of the numbers that are not zero which are of a size that recordings have."""
    with np.errstate(all="ignore"):
        size = np.abs(array.astype(np.float64))
    used = size[size != 0]
    return 1.0 if used.size == 0 else float(np.mean((used > 1e-15) & (used < 1e15)))


def _swapped(values: NDArray[Any]) -> bool:
    """True where the numbers make sense only with their bytes in the other order.

    A swapped float has a random exponent: most of its values lie beyond 1e+-15, which those of a recording do not, and
    they are spread over many decades. Counts of a converter end in zero bytes, which swapped are the exponent: they lie
    close together below the smallest normal number, where no recording is.
    """

    sample = values[:4096]
    if np.count_nonzero(sample) < 8:
        return False
    used = np.abs(sample[sample != 0])
    with np.errstate(all="ignore"):
        decades = np.log10(used.astype(np.float64))
    decades = decades[np.isfinite(decades)]
    spread = decades.size < 2 or float(np.ptp(decades)) > SWAPPED_DECADES
    subnormal = float(np.mean(used < np.finfo(used.dtype).tiny)) > 0.5
    return _sane(sample) < 0.7 and _sane(sample.byteswap()) > 0.98 and (spread or subnormal)


# data types of which a point takes eight bytes; how many times wider the logarithms of values of one type are spread
# where they are read as the other, and the decades of that at least. Bits of a mantissa are then an exponent, or three
# of them are added to it, which makes every decade eight
ALIKE = {4: 5, 5: 4}
WIDER, MISREAD_DECADES = 3.0, 2.0
# different values from which their bits tell a type: of one that repeats itself a mantissa may look like anything
DIFFERENT = 16


def _mistyped(y: NDArray[Any], kind: int) -> bool:
    """True where ordinates y (n, 1 or 2) of data type `kind`, as they are in the file, make sense only as the other
    type whose numbers take as many bytes."""
    y = y[:: 1 + len(y) // 4096]
    if kind not in ALIKE or any(np.unique(column).size < DIFFERENT for column in y.T):
        return False
    other = np.ascontiguousarray(y).view(f"{y.dtype.byteorder}f{12 - y.dtype.itemsize}")
    if _sane(other) < 0.98 or np.mean(other != 0) < 0.9:  # counts end in zero bytes
        return False
    wide = _decades(y)
    return wide > MISREAD_DECADES and wide > WIDER * _decades(other)


def _decades(values: NDArray[Any]) -> float:
    """Deviation of the decimal logarithms of what is not zero among the `values`."""
    with np.errstate(all="ignore"):
        logs = np.log10(np.abs(values[values != 0].astype(np.float64)))
    logs = logs[np.isfinite(logs)]
    return float(logs.std()) if logs.size else 0.0


def _binary_numbers(raw: RawSet, header: Header58, fail: Fail) -> NDArray[np.float64]:
    assert raw.binary is not None
    order = "<" if raw.binary.byte_order == 1 else ">"
    if header.has_single_abscissa(len(raw.samples)):
        ordinates = header.n_values // header.n_points - 1
        table = np.frombuffer(raw.samples, dtype=[("x", f"{order}f4"), ("y", f"{order}f8", (ordinates,))])
        values = np.column_stack([table["x"].astype(np.float64), table["y"]]).ravel()
        y = table["y"]
    else:
        values = np.frombuffer(raw.samples, dtype=f"{order}f{header.item_size}", count=header.n_values)
        y = values.reshape(header.n_points, -1)[:, 0 if header.even else 1 :] if header.n_points else values[:, None]
    if _swapped(values):
        declared, other = ("little", "big") if raw.binary.byte_order == 1 else ("big", "little")
        raise fail(
            f"the header says {declared} endian (byte order {raw.binary.byte_order}) but the samples make sense only "
            f"as {other} endian; correct the byte order in the type line to {3 - raw.binary.byte_order} or export again"
        )
    if _mistyped(y, header.ord_data_type):
        said, alike = header.ord_data_type, ALIKE[header.ord_data_type]
        raise fail(
            f"the header declares ordinate data type {said} ({DATA_TYPES[said]}), but the samples make sense only as "
            f"type {alike} ({DATA_TYPES[alike]}), of which a point takes as many bytes; correct the data type in "
            "record 7 or export again"
        )
    with np.errstate(invalid="ignore"):  # a signalling nan among the samples is told later, with its place
        return values.astype(np.float64)


def read_58(raw: RawSet, fail: Fail) -> Function58:
    """The function of a raw data set 58; raises FormatError, made by `fail`, for anything that does not hold.

    Raised for a damaged header, fewer samples than announced, text that is no number, and bytes in the wrong order.
    """
    if raw.binary is None:
        lines = raw.body.split(b"\n", 11)
        header = parse_header([decode(line.rstrip(b"\r")) for line in lines[:11]], fail)
        numbers = _text_numbers(lines[11] if len(lines) > 11 else b"", header, fail)
    else:
        header = parse_header([decode(line) for line in raw.body.splitlines()], fail)
        numbers = _binary_numbers(raw, header, fail)
    per_point = header.n_values // header.n_points if header.n_points else 1
    table = numbers.reshape(header.n_points, per_point)
    if header.even:
        x = header.x0 + header.dx * np.arange(header.n_points)
    else:
        x, table = table[:, 0], table[:, 1:]
    y = table[:, 0] + 1j * table[:, 1] if header.is_complex else table[:, 0]
    return Function58(header, frozen(x), frozen(y), raw.record, raw.binary is not None)
