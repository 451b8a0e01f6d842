"""Universal files: reader and writer of femend's own."""

from __future__ import annotations

from femend.io.uff.functions import functions_of
from femend.io.uff.reader import UniversalFile, read_uff
from femend.io.uff.set55 import Mode55, identified_modes, modes_55
from femend.io.uff.set58 import Function58
from femend.io.uff.writer import write_uff

__all__ = [
    "Function58",
    "Mode55",
    "UniversalFile",
    "functions_of",
    "identified_modes",
    "modes_55",
    "read_uff",
    "write_uff",
]
