"""Finding the data sets of a universal file, one after the other.

The file is walked from the front: a binary set is as long as its header says, so bytes inside it that look like a
separator never end it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from femend.errors import FormatError
from femend.io.uff.header58 import DATA_TYPES, Binary58, Header58, binary_header, parse_header

__all__ = ["RawSet", "decode", "scan"]

_SEPARATOR = re.compile(rb"^ {0,5}-1[ \t]*\r?$", re.MULTILINE)
_TYPE = re.compile(rb"\s*(\d{1,6})(b?)\s*(.*)", re.IGNORECASE | re.DOTALL)
_ASCII_LINES = 11


@dataclass(frozen=True, slots=True)
class RawSet:
    """One data set: its `number` (58, 2411, ...), its `record` number in the file from 1, and its bytes.

    `body` holds the lines after the type line; of a binary set the 11 header lines, with the samples in `samples`.
    """

    number: int
    record: int
    body: bytes
    binary: Binary58 | None = None
    samples: bytes = b""
    notes: tuple[str, ...] = ()


def decode(line: bytes) -> str:
    """Text of a line whatever its encoding: UTF-8 where it is valid, Latin-1 otherwise."""
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")


def _line(data: bytes, at: int) -> tuple[bytes, int]:
    """The line at `at` without its end, and where the next one begins."""
    end = data.find(b"\n", at)
    if end < 0:
        return data[at:], len(data)
    return data[at:end].rstrip(b"\r"), end + 1


def _is_separator(line: bytes) -> bool:
    return line.strip() == b"-1"


class _Scanner:
    def __init__(self, data: bytes, file: str) -> None:
        self.data = data
        self.file = file
        self.record = 0

    def fail(self, message: str) -> FormatError:
        return FormatError(f"{self.file}: data set {self.record}: {message}", file=self.file, record=self.record)

    def sets(self) -> Iterator[RawSet]:
        if not self.data.strip():
            raise FormatError(
                f"{self.file} is empty ({len(self.data)} bytes); copy it or export it again", file=self.file
            )
        at, found = 0, False
        while at < len(self.data):
            line, following = _line(self.data, at)
            if not _is_separator(line):
                if found and line.strip() and self._begins_set(line):
                    raise self.fail(
                        f"is followed by {decode(line).strip()[:40]!r} where the separator '-1' of the next data set "
                        "must stand; restore the missing '    -1' line or export the file again"
                    )
                at = following
                continue
            found = True
            self.record += 1
            raw, at = self._one(following)
            if raw is not None:
                yield raw
        if not found:
            raise FormatError(
                f"{self.file}: no separator line '    -1' is in the file, so it is not a universal file; "
                "check the file or its extension",
                file=self.file,
            )

    @staticmethod
    def _begins_set(line: bytes) -> bool:
        match = _TYPE.fullmatch(line)
        return match is not None and len(line) >= 3 and (not match[3] or match[2] != b"")

    def _one(self, at: int) -> tuple[RawSet | None, int]:
        line, at = _line(self.data, at)
        while not line.strip() and at < len(self.data):
            line, at = _line(self.data, at)
        match = _TYPE.fullmatch(line)
        if match is None:
            if not line.strip():  # a lone separator at the end of the file
                self.record -= 1
                return None, at
            raise self.fail(
                f"has {decode(line).strip()[:40]!r} where the number of the data set must stand; a separator '-1' "
                "is missing before or after it"
            )
        number = int(match[1])
        if match[2]:
            if number != 58:
                raise self.fail(f"is a binary data set {number}; only data set 58 can be binary; export it as text")
            return self._binary(line, at)
        end = _SEPARATOR.search(self.data, at)
        if end is None:
            raise self.fail(
                f"(type {number}) is not closed by a separator '    -1'; the file is cut off or the line is missing: "
                "export it again or add the line"
            )
        return RawSet(number, self.record, self.data[at : end.start()]), _line(self.data, end.start())[1]

    def _binary(self, type_line: bytes, at: int) -> tuple[RawSet, int]:
        declared = binary_header(decode(type_line), self.fail)
        start = at
        for _ in range(_ASCII_LINES):
            _, at = _line(self.data, at)
        body = self.data[start:at]
        header = parse_header([decode(x) for x in body.splitlines()], self.fail)
        needed = header.n_values * header.item_size
        if header.has_single_abscissa(declared.n_bytes) and self._close(at + declared.n_bytes) is not None:
            needed = declared.n_bytes
        length, notes = self._length(declared, header, needed, at)
        after = self._close(at + length)
        if after is None:
            raise self.fail(
                f"the {length} bytes of binary samples are not followed by a separator '    -1'; the byte count or "
                "the file is damaged: copy it in binary mode, or export it again"
            )
        return (
            RawSet(58, self.record, body, declared, self.data[at : at + length], notes),
            after,
        )

    def _length(self, declared: Binary58, header: Header58, needed: int, at: int) -> tuple[int, tuple[str, ...]]:
        """Bytes of the samples: what the layout needs, checked against what the header declares."""
        there = len(self.data) - at
        if declared.n_bytes == needed and there >= needed:
            return needed, ()
        if there >= needed and self._close(at + needed) is not None:
            note = f"data set {self.record}: the header declares {declared.n_bytes} bytes, the samples take {needed}"
            return needed, (note,)
        other = header.with_bytes(declared.n_bytes)
        if other and there >= declared.n_bytes and self._close(at + declared.n_bytes) is not None:
            raise self.fail(
                f"the header declares {declared.n_bytes} bytes but its points and data type take {needed}: "
                f"{header.n_points} of type {header.ord_data_type} ({DATA_TYPES[header.ord_data_type]}), but those of "
                f"{other} take what is there; correct the data type in record 7 or export the file again"
            )
        if there < max(needed, declared.n_bytes):
            raise self.fail(
                f"the header announces {needed} bytes of binary samples but only {there} bytes are left in the file; "
                "the record is truncated: copy or export the file again (in binary mode)"
            )
        raise self.fail(
            f"the header declares {declared.n_bytes} bytes but its points and data type take {needed}; "
            "the header is damaged: export the file again"
        )

    def _close(self, at: int) -> int | None:
        """Where the next set may begin if a separator stands at `at` (after at most one line end); else None."""
        line, following = _line(self.data, at)
        if not line.strip() and following < len(self.data):
            line, following = _line(self.data, following)
        return following if _is_separator(line) else None


def scan(data: bytes, file: str) -> Iterator[RawSet]:
    """Every data set of the bytes of a universal file, in order.

    Raises FormatError, with file, record number and what to do, for a file without separators, a set that is not
    closed, a truncated binary record, and a byte count that fits neither the samples nor the file.
    """
    return _Scanner(data, file).sets()
