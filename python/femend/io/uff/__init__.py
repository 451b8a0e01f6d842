"""Universal files: reader and writer of femend's own."""

from __future__ import annotations

from femend.io.uff.reader import UniversalFile, read_uff
from femend.io.uff.set58 import Function58

__all__ = ["Function58", "UniversalFile", "read_uff"]
