"""Modes from what a solver leaves: CalculiX's text, data sets 55 of a universal file, a plain table."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.dof import Dof
from femend.errors import FormatError
from femend.io.calculix import read_calculix_modes
from femend.io.uff.reader import read_uff

__all__ = ["read_solver_modes"]

FloatArray = NDArray[np.float64]


def read_solver_modes(path: str | Path, form: str, sensors: Sequence[Dof]) -> tuple[FloatArray, FloatArray]:
    """Frequencies (n_modes,) in Hz, ascending, and shapes (n_sensors, n_modes) at `sensors` (signed), those of a free
    body included.

    `form` is "calculix" (`read_calculix_modes`), "universal" (data sets 55, of complex shapes the real part) or
    "table": CSV with a line for each mode, a column `freq` in Hz, and one for each sensor called by node and direction
    (`12:+Z`). Raises FormatError, naming the file, for one without modes or without a sensor, and OSError where there
    is none.
    """
    if form == "calculix":
        freq, phi = read_calculix_modes(path, sensors)
    elif form == "universal":
        freq, phi = _universal(Path(path), sensors)
    else:
        freq, phi = _table(Path(path), sensors)
    order = np.argsort(freq, kind="stable")
    return freq[order], phi[:, order]


def _universal(path: Path, sensors: Sequence[Dof]) -> tuple[FloatArray, FloatArray]:
    modes = read_uff(path).modes
    if not modes:
        raise FormatError(
            f"{path} has no data set 55 that is a mode; export shapes with their frequencies", file=str(path)
        )
    phi = np.zeros((len(sensors), len(modes)))
    for j, mode in enumerate(modes):
        row = {int(n): i for i, n in enumerate(mode.nodes)}
        for i, dof in enumerate(sensors):
            if dof.node not in row or dof.component > mode.values.shape[1]:
                raise FormatError(f"{path} has no displacement of {dof} in mode {j + 1}", file=str(path))
            phi[i, j] = dof.sign * np.real(mode.values[row[dof.node], dof.component - 1])
    return np.array([mode.freq for mode in modes]), phi


def _table(path: Path, sensors: Sequence[Dof]) -> tuple[FloatArray, FloatArray]:
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = [row for row in csv.reader(file) if any(cell.strip() for cell in row)]
    if len(rows) < 2:
        raise FormatError(
            f"{path} has no line of a mode under a header; give freq and a column a sensor", file=str(path)
        )
    header = [cell.strip() for cell in rows[0]]
    if "freq" not in header:
        raise FormatError(f"{path} has no column 'freq' (there are {', '.join(header[:8])})", file=str(path))
    try:
        table = np.array([[float(cell) for cell in row] for row in rows[1:]], dtype=np.float64)
    except ValueError as error:
        raise FormatError(f"{path}: {error}; the lines of modes hold numbers alone", file=str(path)) from None
    if table.shape[1:] != (len(header),):
        raise FormatError(
            f"{path} has lines of another length than its header of {len(header)} columns", file=str(path)
        )
    found: dict[Dof, FloatArray] = {}
    for k, name in enumerate(header):
        if name != "freq":
            try:
                dof = Dof.parse(name)
            except ValueError as error:
                raise FormatError(f"{path}: column {name!r}: {error}", file=str(path)) from None
            found[dof.unsigned] = dof.sign * table[:, k]
    missing = next((d for d in sensors if d.unsigned not in found), None)
    if missing is not None:
        raise FormatError(f"{path} has no column for sensor {missing.unsigned}", file=str(path))
    phi = np.array([d.sign * found[d.unsigned] for d in sensors]).reshape(len(sensors), len(table))
    return table[:, header.index("freq")], phi
