"""Decks of other programs, told by the words that begin their lines."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import NamedTuple

__all__ = ["OtherDeck", "other_deck"]

# bytes that are looked at: a long comment at the top is shorter
LOOKED_AT = 65_536
# programs, and a line that no bulk data has. A * alone is bulk data, it continues a card of large fields; LS-DYNA's
# keywords are like Abaqus' and begin with one of its own.
_PROGRAMS = (
    ("LS-DYNA", re.compile(r"^\*KEYWORD\b.*", re.IGNORECASE | re.MULTILINE)),
    (
        "Abaqus or CalculiX",
        re.compile(
            r"^\*(?:HEADING|PREPRINT|PARAMETER|INCLUDE|PART|ASSEMBLY|INSTANCE|NODE|NSET|ELEMENT|ELSET|MATERIAL|ELASTIC|"
            r"DENSITY|SOLID SECTION|SHELL SECTION|BEAM SECTION|BOUNDARY|STEP|FREQUENCY)\b.*",
            re.IGNORECASE | re.MULTILINE,
        ),
    ),
    ("ANSYS", re.compile(r"^(?:/(?:COM|PREP7|BATCH|TITLE|NOPR|UNITS)\b|[NE]BLOCK,).*", re.IGNORECASE | re.MULTILINE)),
    ("a universal file", re.compile(r"^ {0,4}-1[ \t\r]*\n *(?:151|164|2411|2412|15|58b?|55)\b.*", re.MULTILINE)),
    ("Nastran's printout (.f06)", re.compile(r"^[^$\n]*N A S T R A N .*", re.MULTILINE)),
)


class OtherDeck(NamedTuple):
    """The `program` whose file it is, and the `line` (from 1) with its `text` that tells; line 0 of a binary file."""

    program: str
    line: int
    text: str


def other_deck(path: str | os.PathLike[str]) -> OtherDeck | None:
    """Whose deck the file at `path` is where it is not Nastran's; None where nothing tells. Raises OSError for a file
    that cannot be read.

    >>> other_deck("beam.inp")  # doctest: +SKIP
    OtherDeck(program='Abaqus or CalculiX', line=1, text='*HEADING')
    """
    with Path(path).open("rb") as file:
        head = file.read(LOOKED_AT)
    if b"\0" in head:
        return OtherDeck("a binary file", 0, "")
    text = head.decode("latin-1").replace("\r\n", "\n")
    for program, pattern in _PROGRAMS:
        found = pattern.search(text)
        if found is not None:
            return OtherDeck(program, text.count("\n", 0, found.start()) + 1, found[0].strip().splitlines()[0][:40])
    return None
