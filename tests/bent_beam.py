"""A cantilever of six bars, 0.6 m, with a lump at its tip, for studies of the force that shakes it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from femend.model import ReducedModel, read_model, reduce_model


def row(node: int, axis: int) -> int:
    """Row of the g-set of a node's displacement along an axis (1 is Y)."""
    return 6 * (node - 1) + axis


def bent_beam(folder: Path, axes: Sequence[int], f_max: float) -> ReducedModel:
    """The cantilever with its displacements along `axes` in the basis, up to `f_max` (Hz)."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,4.-4,3.-9,1.2-8,8.-9"]
    lines += [f"GRID,{i + 1},,{0.1 * i},0.,0." for i in range(7)]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 7)]
    path = folder / "m.bdf"
    path.write_text("\n".join([*lines, "SPC1,1,123456,1", "CONM2,90,7,,0.2", "ENDDATA", ""]))
    return reduce_model(read_model(path), f_max, [row(n, axis) for n in range(2, 8) for axis in axes])
