"""Modes of a body that nothing holds."""

from __future__ import annotations

__all__ = ["FREE", "RIGID"]

# modes of 0 Hz of a free body
FREE = 6
# share of the highest frequency below which one is of 0 Hz, up to round-off: a heavy lump on a light beam goes down to
# 1e-5
RIGID = 1e-6
