"""Entries of result.json, taken as they are or not at all: a reader does not stumble over what is missing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

__all__ = ["Result", "mapping", "number", "rows"]

Result = Mapping[str, Any]


def number(entry: Any) -> float | None:
    """A finite number, or the one under "value" of a mapping; None for anything else."""
    if isinstance(entry, Mapping):
        entry = entry.get("value")
    if isinstance(entry, bool) or not isinstance(entry, int | float) or not math.isfinite(entry):
        return None
    return float(entry)


def rows(entry: Any) -> list[Result]:
    """The mappings of a list; an empty list for anything else."""
    return [row for row in entry if isinstance(row, Mapping)] if isinstance(entry, list | tuple) else []


def mapping(entry: Any) -> Mapping[str, Any]:
    """`entry` if it is a mapping, else an empty one."""
    return entry if isinstance(entry, Mapping) else {}
