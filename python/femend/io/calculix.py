"""Modes from the text results of CalculiX (`*FREQUENCY` with `*NODE PRINT`)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.dof import Dof
from femend.errors import FormatError

__all__ = ["read_calculix_modes"]

FloatArray = NDArray[np.float64]


def read_calculix_modes(path: str | Path, sensors: Sequence[Dof]) -> tuple[FloatArray, FloatArray]:
    """Frequencies (n_modes,) in Hz and shapes (n_sensors, n_modes) at `sensors` (translations, signed) of a `.dat`
    file.

    The deck asks for them by `*FREQUENCY` and `*NODE PRINT, NSET=...` with U, which holds all sensors' nodes. Raises
    FormatError for a file without eigenvalues, with fewer blocks of displacements than modes, or without a sensor's
    node.
    """
    text = Path(path).read_text(encoding="utf-8", errors="replace")
    freq = _frequencies(text)
    if not freq:
        raise FormatError(f"{path} has no table of eigenvalues: did the *FREQUENCY step run?", file=str(path))
    blocks = _displacements(text)
    if len(blocks) < len(freq):
        raise FormatError(
            f"{path} has {len(freq)} eigenvalues and {len(blocks)} blocks of displacements; ask for U by *NODE PRINT",
            file=str(path),
        )
    phi = np.zeros((len(sensors), len(freq)))
    for j, block in enumerate(blocks[: len(freq)]):
        for i, dof in enumerate(sensors):
            if dof.node not in block or dof.component > 3:
                raise FormatError(f"{path} has no displacement of {dof} in mode {j + 1}", file=str(path))
            phi[i, j] = dof.sign * block[dof.node][dof.component - 1]
    return np.array(freq), phi


def _frequencies(text: str) -> list[float]:
    """The column in cycles per time of the first table of eigenvalues."""
    found: list[float] = []
    inside = False
    for line in text.splitlines():
        packed = line.replace(" ", "")
        if packed.startswith("EIGENVALUEOUTPUT"):
            inside = True
        elif inside and re.match(r"\s*\d+\s+[-+.\dE]+", line):
            found.append(float(line.split()[3]))
        elif inside and found:
            break
    return found


def _displacements(text: str) -> list[dict[int, tuple[float, float, float]]]:
    """Displacements by node, one block a mode."""
    blocks: list[dict[int, tuple[float, float, float]]] = []
    inside = False
    for line in text.splitlines():
        if line.lstrip().startswith("displacements (vx,vy,vz)"):
            blocks.append({})
            inside = True
        elif inside and (row := re.match(r"\s*(\d+)\s+(\S+)\s+(\S+)\s+(\S+)\s*$", line)):
            blocks[-1][int(row[1])] = (float(row[2]), float(row[3]), float(row[4]))
        elif inside and line.strip():
            inside = False
    return blocks
