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

# headings of the program, whose letters stand apart
_TABLE = re.compile(r"^ *E I G E N V A L U E +O U T P U T *$", re.MULTILINE)
_MODE = re.compile(r"^ *E I G E N V A L U E +N U M B E R +\d+ *$", re.MULTILINE)


def read_calculix_modes(path: str | Path, sensors: Sequence[Dof]) -> tuple[FloatArray, FloatArray]:
    """Frequencies (n_modes,) in Hz and shapes (n_sensors, n_modes) at `sensors` (translations, signed) of a `.dat`
    file.

    The deck asks for them by `*FREQUENCY` and `*NODE PRINT, NSET=...` with U, in one or more sets that together hold
    all sensors' nodes. Displacements of other steps, static ones say, are passed over. Raises FormatError for a
    file without eigenvalues or with those of two steps, with fewer shapes than modes, or without a sensor's node.
    """
    text = Path(path).read_text(encoding="utf-8", errors="replace")
    _, *tables = _TABLE.split(text)
    if not tables:
        raise FormatError(f"{path} has no table of eigenvalues: did the *FREQUENCY step run?", file=str(path))
    if len(tables) > 1:
        raise FormatError(
            f"{path} has {len(tables)} tables of eigenvalues, and which one counts cannot be told; keep one *FREQUENCY "
            "step in the deck",
            file=str(path),
        )
    freq, blocks = _frequencies(tables[0]), _shapes(tables[0])
    if not freq:
        raise FormatError(f"{path} has a table of eigenvalues without a line: did the step end well?", file=str(path))
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
    """The column in cycles per time of the table of eigenvalues that `text` begins with."""
    found: list[float] = []
    for line in text.splitlines():
        if re.match(r"\s*\d+\s+[-+.\dE]+", line):
            found.append(float(line.split()[3]))
        elif found:
            break
    return found


def _shapes(text: str) -> list[dict[int, tuple[float, float, float]]]:
    """Displacements by node of each mode, those of several sets together."""
    _, *modes = _MODE.split(text)
    if not modes:  # nothing says where a mode begins: a block each
        return _displacements(text)
    blocks = [_displacements(_of_one_time(mode)) for mode in modes]
    return [{node: u for block in mode for node, u in block.items()} for mode in blocks if mode]


def _of_one_time(text: str) -> str:
    """What stands before displacements of another time: a later step is none of the mode's."""
    headers = list(re.finditer(r"^ *displacements .* and time +(\S+) *$", text, re.MULTILINE))
    later = [h.start() for h in headers if h[1] != headers[0][1]]
    return text[: later[0]] if later else text


def _displacements(text: str) -> list[dict[int, tuple[float, float, float]]]:
    """Displacements by node, block by block."""
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
