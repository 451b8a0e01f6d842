"""Matrices in Nastran OUTPUT4 files (.op4): ASCII and binary, dense and sparse, real and complex, either byte order."""

from __future__ import annotations

from femend.io.op4.matrix import Op4Matrix
from femend.io.op4.reader import read_op4
from femend.io.op4.writer import write_op4

__all__ = ["Op4Matrix", "read_op4", "write_op4"]
