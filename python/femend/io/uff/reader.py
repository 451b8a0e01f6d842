"""A universal file as it stands: every data set that femend knows, and a list of those it does not."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.errors import FormatError
from femend.io.uff import geometry
from femend.io.uff.geometry import Element2412, Lines82, Nodes, Units164
from femend.io.uff.scan import RawSet, scan
from femend.io.uff.set55 import Mode55, read_55
from femend.io.uff.set58 import Function58, read_58

__all__ = ["UniversalFile", "read_uff"]


@dataclass(frozen=True, slots=True, eq=False)
class UniversalFile:
    """Content of a universal file, values in the file's own units.

    `functions` (58), `nodes` (15, 2411), `lines` (82), `elements` (2412), `units` (164), `modes` (55); `unknown` lists
    (data set number, record in the file) of sets that were passed over; `notes` say what was tolerated.
    """

    file: str
    functions: tuple[Function58, ...] = ()
    nodes: tuple[Nodes, ...] = ()
    lines: tuple[Lines82, ...] = ()
    elements: tuple[Element2412, ...] = ()
    units: tuple[Units164, ...] = ()
    unknown: tuple[tuple[int, int], ...] = ()
    notes: tuple[str, ...] = ()
    modes: tuple[Mode55, ...] = ()

    def units_at(self, record: int) -> Units164 | None:
        """The data set 164 that holds for the data set `record`: the last one before it, else the file's first."""
        before = [u for u in self.units if u.record < record]
        return before[-1] if before else (self.units[0] if self.units else None)

    def node_table(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Node ids (n,) and coordinates (n, 3) in m (data set 164 applied), the last definition of an id counting."""
        place: dict[int, NDArray[np.float64]] = {}
        for block in self.nodes:
            units = self.units_at(block.record)
            length = 1.0 if units is None else units.length
            place.update(zip(block.ids.tolist(), block.xyz / length))
        ids = np.array(list(place), dtype=np.int64)
        xyz = np.array(list(place.values()), dtype=np.float64).reshape(-1, 3)
        return frozen(ids), frozen(xyz)

    def displacement_systems(self) -> NDArray[np.int64]:
        """Numbers (n,) of the displacement systems of the nodes of `node_table`, 0 for the basic one."""
        found: dict[int, int] = {}
        for block in self.nodes:
            found.update(zip(block.ids.tolist(), block.systems[:, 1].tolist()))
        return frozen(np.array(list(found.values()), dtype=np.int64))

    def node_unit(self) -> float | None:
        """The length unit of the nodes in m as data set 164 states it; None where it does not, or not one for all."""
        units = [self.units_at(block.record) for block in self.nodes]
        stated = {1 / u.length for u in units if u is not None}
        return stated.pop() if len(stated) == 1 and None not in units else None

    def __repr__(self) -> str:
        n_nodes = sum(b.ids.size for b in self.nodes)
        unknown = sorted({n for n, _ in self.unknown})
        return (
            f"UniversalFile({self.file!r}: {len(self.functions)} functions, {n_nodes} nodes, {len(self.elements)} "
            f"elements, {len(self.lines)} lines, {len(self.modes)} modes, passed over: {unknown or 'nothing'})"
        )


def read_uff(path: str | Path) -> UniversalFile:
    """Reads the universal file at `path` (.uff, .unv): data sets 58 and 58b, 55, 15, 2411, 82, 2412 and
    164.

    Values stay in the file's units. Sets of other numbers are listed in `unknown`. Raises FormatError naming file and
    data set for a file that is damaged, FileNotFoundError for one that is not there.

    >>> read_uff("high.uff").functions[0].header.rsp_node       # doctest: +SKIP
    5
    """
    path = Path(path)
    file = str(path)
    functions: list[Function58] = []
    nodes: list[Nodes] = []
    lines: list[Lines82] = []
    elements: list[Element2412] = []
    units: list[Units164] = []
    unknown: list[tuple[int, int]] = []
    modes: list[Mode55] = []
    notes: list[str] = []
    for raw in scan(path.read_bytes(), file):
        fail = _failure(file, raw)
        notes += raw.notes
        if raw.number == 58:
            functions.append(read_58(raw, fail))
        elif raw.number == 55:
            mode = read_55(raw, fail)
            if mode is None:
                unknown.append((raw.number, raw.record))
            else:
                modes.append(mode)
        elif raw.number == 15:
            nodes.append(geometry.read_15(raw, fail))
        elif raw.number in (2411, 781):
            nodes.append(geometry.read_2411(raw, fail))
        elif raw.number == 82:
            lines.append(geometry.read_82(raw, fail))
        elif raw.number == 2412:
            elements += geometry.read_2412(raw, fail)
        elif raw.number == 164:
            units.append(geometry.read_164(raw, fail))
        else:
            unknown.append((raw.number, raw.record))
    for block in nodes:
        if block.systems[:, 0].any():
            used = sorted(set(block.systems[:, 0].tolist()) - {0})
            notes.append(f"data set {block.record}: coordinate systems {used[:5]} are taken as the global one")
    return UniversalFile(
        file,
        tuple(functions),
        tuple(nodes),
        tuple(lines),
        tuple(elements),
        tuple(units),
        tuple(unknown),
        tuple(notes),
        tuple(modes),
    )


def _failure(file: str, raw: RawSet):  # type: ignore[no-untyped-def]
    def fail(message: str) -> FormatError:
        return FormatError(
            f"{file}: data set {raw.record} (type {raw.number}): {message}", file=file, record=raw.record
        )

    return fail
