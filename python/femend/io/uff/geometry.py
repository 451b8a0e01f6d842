"""Geometry and units of universal files: data sets 15 and 2411 (nodes), 82 (lines), 2412 (elements), 164 (units)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.io.uff.header58 import Fail
from femend.io.uff.scan import RawSet, decode

__all__ = ["Element2412", "Lines82", "Nodes", "Units164", "read_15", "read_164", "read_2411", "read_2412", "read_82"]

_BEAMS = (11, 21, 22, 23, 24)  # elements of data set 2412 with a record of their own for orientation and ends


@dataclass(frozen=True, slots=True, eq=False)
class Nodes:
    """Nodes: `ids` (n,), `xyz` (n, 3) in the file's length unit, `systems` (n, 2) definition, displacement."""

    ids: NDArray[np.int64]
    xyz: NDArray[np.float64]
    systems: NDArray[np.int64]
    record: int = 0
    number: int = 2411


@dataclass(frozen=True, slots=True)
class Lines82:
    """A trace line: nodes to draw through in order, 0 lifts the pen."""

    trace: int
    name: str
    nodes: tuple[int, ...]
    record: int = 0


@dataclass(frozen=True, slots=True)
class Element2412:
    """An element: label, descriptor of the format (11 rod, 94 shell, 115 brick, ...), property, material, nodes."""

    label: int
    descriptor: int
    physical: int
    material: int
    nodes: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Units164:
    """Units of the data sets that follow: value in SI = value in the file / factor."""

    code: int
    name: str
    length: float
    force: float
    temperature: float
    temperature_offset: float
    record: int = 0

    def to_si(self, dims: tuple[int, int, int, int]) -> float:
        """Factor from file units to SI for exponents of m, kg, s, V: mass is force * s^2 / length."""
        length, mass, _, _ = dims
        return float(self.length ** -(length - mass) * self.force**-mass)


def _lines(raw: RawSet) -> list[str]:
    return [decode(line) for line in raw.body.splitlines() if line.strip()]


def _reals(text: str, fail: Fail) -> list[float]:
    try:
        return [float(v) for v in text.replace("D", "E").replace("d", "e").split()]
    except ValueError:
        raise fail(
            f"the line {text.strip()[:60]!r} does not hold numbers only; mend it or export the file again"
        ) from None


def _integers(text: str, fail: Fail) -> list[int]:
    """Integers of a line in columns of ten; columns without a blank between them are cut apart."""
    try:
        return [int(v) for v in text.split()] if all(len(v) <= 10 for v in text.split()) else _columns(text)
    except ValueError:
        raise fail(
            f"the line {text.strip()[:60]!r} does not hold integers only; mend it or export the file again"
        ) from None


def _columns(text: str) -> list[int]:
    return [int(text[i : i + 10]) for i in range(0, len(text.rstrip()), 10)]


def _nodes(rows: list[tuple[int, int, int, float, float, float]], raw: RawSet) -> Nodes:
    table = np.array(rows, dtype=np.float64).reshape(-1, 6)
    ids = np.array([r[0] for r in rows], dtype=np.int64)
    systems = table[:, 1:3].astype(np.int64)
    return Nodes(frozen(ids), frozen(table[:, 3:]), frozen(systems), raw.record, raw.number)


def read_15(raw: RawSet, fail: Fail) -> Nodes:
    """Data set 15: one line per node; raises FormatError, made by `fail`, for a line that is not a node."""
    rows = []
    for line in _lines(raw):
        head, tail = _integers(line[:40], fail), _reals(line[40:], fail)
        if len(head) != 4 or len(tail) != 3:  # not in its columns: by blanks
            fields = line.split()
            if len(fields) != 7:
                raise fail(f"the node line {line.strip()!r} has {len(fields)} of 7 fields; mend it or export again")
            head, tail = _integers(" ".join(fields[:4]), fail), _reals(" ".join(fields[4:]), fail)
        rows.append((head[0], head[1], head[2], tail[0], tail[1], tail[2]))
    return _nodes(rows, raw)


def read_2411(raw: RawSet, fail: Fail) -> Nodes:
    """Data set 2411: two lines per node; raises FormatError, made by `fail`, for lines that are not a node."""
    lines = _lines(raw)
    if len(lines) % 2:
        raise fail(f"has {len(lines)} lines, but a node takes two; the set is cut off: export the file again")
    rows = []
    for first, second in zip(lines[::2], lines[1::2]):
        head, xyz = _integers(first, fail), _reals(second, fail)
        if len(head) < 3 or len(xyz) != 3:
            raise fail(f"the node {first.strip()!r} / {second.strip()!r} lacks fields; mend it or export again")
        rows.append((head[0], head[1], head[2], xyz[0], xyz[1], xyz[2]))
    return _nodes(rows, raw)


def read_164(raw: RawSet, fail: Fail) -> Units164:
    """Data set 164: factors of length, force and temperature; raises FormatError where one is missing or not > 0."""
    lines = _lines(raw)
    values = _reals(" ".join(lines[1:]), fail)
    if not lines or len(values) < 3:
        raise fail(f"(units) holds {len(values)} of 4 factors; mend it or export the file again")
    if min(values[0], values[1]) <= 0:
        raise fail(f"(units) has the length factor {values[0]:g} and force factor {values[1]:g}; both must be positive")
    code = (_integers(lines[0][:10], fail) or [0])[0]
    offset = values[3] if len(values) > 3 else 0.0
    return Units164(code, lines[0][10:30].strip(), values[0], values[1], values[2], offset, raw.record)


def read_82(raw: RawSet, fail: Fail) -> Lines82:
    """Data set 82: a trace line; raises FormatError, made by `fail`, where nodes are missing."""
    lines = [decode(line) for line in raw.body.splitlines()]
    head = _integers(lines[0], fail) if lines else []
    if len(head) < 2 or len(lines) < 2:
        raise fail("(trace lines) lacks its first lines; export the file again")
    nodes = [n for line in lines[2:] for n in _integers(line, fail)]
    if len(nodes) < head[1]:
        raise fail(f"(trace lines) announces {head[1]} nodes and lists {len(nodes)}; export the file again")
    return Lines82(head[0], lines[1].strip(), tuple(nodes[: head[1]]), raw.record)


def read_2412(raw: RawSet, fail: Fail) -> list[Element2412]:
    """Data set 2412: elements; raises FormatError, made by `fail`, where nodes are missing."""
    lines, at, elements = _lines(raw), 0, []
    while at < len(lines):
        head = _integers(lines[at], fail)
        at += 1
        if len(head) < 6:
            raise fail(f"the element line {lines[at - 1].strip()!r} has {len(head)} of 6 fields; export the file again")
        if head[1] in _BEAMS:
            at += 1
        nodes: list[int] = []
        while len(nodes) < head[5] and at < len(lines):
            nodes += _integers(lines[at], fail)
            at += 1
        if len(nodes) != head[5]:
            raise fail(f"element {head[0]} announces {head[5]} nodes and lists {len(nodes)}; export the file again")
        elements.append(Element2412(head[0], head[1], head[2], head[3], tuple(nodes)))
    return elements
