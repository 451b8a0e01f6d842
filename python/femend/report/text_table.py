"""Plain tables for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["table"]


def table(header: Sequence[str], rows: Sequence[Sequence[str]], align: str) -> str:
    """Lines of a table with columns padded to their widest entry; `align` holds "l" or "r" per column.

    >>> print(table(["mode", "Hz"], [["1", "14.2"], ["2", "101.0"]], "rr"))
    mode     Hz
       1   14.2
       2  101.0
    """
    width = [max(len(cell) for cell in column) for column in zip(header, *rows, strict=True)]
    lines = []
    for row in (header, *rows):
        cells = [c.rjust(w) if a == "r" else c.ljust(w) for c, w, a in zip(row, width, align, strict=True)]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)
