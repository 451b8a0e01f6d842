"""A real as the fields of a deck hold it."""

from __future__ import annotations

__all__ = ["real"]


def real(text: str) -> float:
    """A Nastran real: 1.5-3 is 1.5e-3, D exponents too. Raises ValueError for a blank field."""
    body = text.strip().upper().replace("D", "E")
    for i in range(len(body) - 1, 0, -1):
        if body[i] in "+-" and body[i - 1] not in "E":
            return float(f"{body[:i]}E{body[i:]}")
    return float(body)
