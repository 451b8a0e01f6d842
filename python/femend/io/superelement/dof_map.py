"""Which DOF each row of a reduced matrix is: from the cards Nastran punches beside the matrices, or a plain list."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from femend.errors import FormatError

__all__ = ["MAX_DOFS", "read_dof_map"]

# Dense matrices of more DOFs than this are no reduced ones; the limit stops ranges that nobody meant.
MAX_DOFS = 20_000

_DIRECTIONS = {"X": "1", "Y": "2", "Z": "3", "RX": "4", "RY": "5", "RZ": "6"}
_PAIRS = ("ASET", "BSET", "CSET", "QSET")  # (node, components) as often as it goes
_LISTS = ("ASET1", "BSET1", "CSET1", "QSET1")  # components, nodes, THRU
_NAMES = {"EXTRN", *_PAIRS, *_LISTS}


class _Fault(Exception):
    """What is wrong with one line."""


def read_dof_map(path: str | os.PathLike[str]) -> tuple[tuple[int, int], ...]:
    """(node, component) of each row of a superelement's matrices, component 0 for scalar points, from file `path`.

    Either bulk data: EXTRN as EXTSEOUT punches it (in its order), else ASET, BSET, CSET, QSET and their short forms
    with 1, whose DOFs stand in ascending order as in Nastran's own matrices. Or a plain list of lines with a node and
    its components: `3 123456`, `11:RX`, `2995001 0`, separated by blanks, commas or a colon, with comments behind #
    or $. Other cards of bulk data are passed over.

    Raises FormatError with the line for what cannot be understood, and for a DOF that stands twice.

    >>> read_dof_map("extse.pch")[:2]  # doctest: +SKIP
    ((3, 1), (3, 2))
    """
    file = Path(path)
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    cards = list(_cards(lines))
    dofs = _from_cards(str(file), cards) if cards else _from_list(str(file), lines)
    if not dofs:
        raise FormatError(
            f"{file}: no DOF in the map; give lines such as '3 123456', or EXTRN or ASET cards", file=str(file)
        )
    seen: set[tuple[int, int]] = set()
    for dof in dofs:
        if dof in seen:
            raise FormatError(f"{file}: DOF {dof[0]}:{dof[1]} stands twice in the map; give it once", file=str(file))
        seen.add(dof)
    return tuple(dofs)


def _cards(lines: list[str]) -> Iterator[tuple[str, int, list[str]]]:
    """(name, line from 1, data fields in their places) of the cards that name DOFs."""
    current: tuple[str, int, list[str]] | None = None
    for number, full in enumerate(lines, start=1):
        line = full.split("$", 1)[0].rstrip().expandtabs()
        if not line:
            continue
        free = "," in line
        first = (line.split(",", 1)[0] if free else line[:8]).strip().upper()
        if free:
            fields = [cell.strip() for cell in line.split(",")[1:9]]
        else:
            width = 16 if first.endswith("*") or line[0] == "*" else 8
            fields = [line[i : i + width].strip() for i in range(8, 72, width)]
        wide = first.endswith("*") or line[0] == "*"
        fields += [""] * ((4 if wide else 8) - len(fields))
        if not first or first[0] in "+*":
            if current is not None:
                current[2].extend(fields)
            continue
        if current is not None:
            yield current
        name = first.rstrip("*")
        current = (name, number, fields) if name in _NAMES else None
    if current is not None:
        yield current


def _from_cards(file: str, cards: list[tuple[str, int, list[str]]]) -> list[tuple[int, int]]:
    extrn = [card for card in cards if card[0] == "EXTRN"]
    found: list[tuple[int, int]] = []
    for name, line, fields in extrn or cards:
        try:
            found += _list_card(fields) if name in _LISTS else _pair_card(fields)
        except _Fault as fault:
            raise FormatError(f"{file}:{line}: {name}: {fault}", file=file, record=line) from None
        if len(found) > MAX_DOFS:
            raise FormatError(f"{file}:{line}: more than {MAX_DOFS} DOFs; correct the map", file=file, record=line)
    return found if extrn else sorted(found)


def _pair_card(fields: list[str]) -> list[tuple[int, int]]:
    found = []
    for node, components in zip(fields[::2], fields[1::2], strict=False):
        if "THRU" in (node.upper(), components.upper()):
            raise _Fault("THRU between pairs of node and components is not read; write the nodes out")
        if node:
            found += [(_node(node), c) for c in _components(components)]
        elif components:
            raise _Fault(f"components {components} without a node")
    return found


def _list_card(fields: list[str]) -> list[tuple[int, int]]:
    components = _components(fields[0])
    words = [word for word in fields[1:] if word]
    nodes: list[int] = []
    for i, word in enumerate(words):
        if word.upper() == "THRU":
            if not 0 < i < len(words) - 1:
                raise _Fault("THRU without the ids of its range")
            first, last = _node(words[i - 1]), _node(words[i + 1])
            if not first < last <= first + MAX_DOFS:
                raise _Fault(f"the range {first} THRU {last} is none of 1 to {MAX_DOFS} nodes")
            nodes += range(first + 1, last)
        else:
            nodes.append(_node(word))
    return [(node, c) for node in nodes for c in components]


def _from_list(file: str, lines: list[str]) -> list[tuple[int, int]]:
    found: list[tuple[int, int]] = []
    begun = False
    for number, full in enumerate(lines, start=1):
        words = [word for word in re.split(r"[\s,;:]+", re.split(r"[#$]", full, maxsplit=1)[0].strip()) if word]
        if not words:
            continue
        if not begun and not any(word.isdigit() for word in words):
            begun = True  # a line of headings
            continue
        begun = True
        try:
            if len(words) > 2:
                raise _Fault(f"{len(words)} words; give a node and its components")
            found += [(_node(words[0]), c) for c in _components(words[1] if len(words) > 1 else "")]
        except _Fault as fault:
            raise FormatError(f"{file}:{number}: {fault}", file=file, record=number) from None
        if len(found) > MAX_DOFS:
            raise FormatError(f"{file}:{number}: more than {MAX_DOFS} DOFs; correct the map", file=file, record=number)
    return found


def _node(word: str) -> int:
    if not re.fullmatch(r"[0-9]{1,10}", word) or not 0 < int(word) < 2**31:
        raise _Fault(f"'{word}' is no node (a positive integer)")
    return int(word)


def _components(word: str) -> list[int]:
    """1 to 6, each once; 0 or nothing for a scalar point."""
    digits = _DIRECTIONS.get(word.upper().lstrip("+"), word) or "0"
    if digits == "0":
        return [0]
    if not re.fullmatch("[1-6]+", digits) or len(set(digits)) != len(digits):
        raise _Fault(f"'{word}' are no components (some of 123456, a direction X to RZ, or 0 for a scalar point)")
    return sorted(int(c) for c in digits)
