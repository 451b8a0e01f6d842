"""DAC between operating shapes over two axes of speed or frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.report.plots.style import MARK, UNIT_MAP, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["cell_edges", "draw_dac"]


def draw_dac(
    ax: Axes,
    values: ArrayLike,
    axis_a: ArrayLike,
    axis_b: ArrayLike,
    *,
    label: str = "speed, 1/min",
    name_a: str = "test",
    name_b: str = "model",
    criterion: str = "DAC",
    colorbar: bool = True,
) -> None:
    """Draws `values` (n_a, n_b) in [0, 1] over the rising `axis_a` (n_a,), upwards, and `axis_b` (n_b,), to the right.

    The dashed line is where both axes are equal: a ridge beside it is a shift of the model against the test. Also for
    FDAC over two frequencies (`label` "frequency, Hz"). Raises ValueError for shapes that do not fit or axes that do
    not rise.
    """
    a, b = real(axis_a, "axis_a", (None,)), real(axis_b, "axis_b", (None,))
    table = real(values, criterion, (a.size, b.size))
    mesh = ax.pcolormesh(cell_edges(b, "axis_b"), cell_edges(a, "axis_a"), table, vmin=0.0, vmax=1.0, cmap=UNIT_MAP)
    mesh.set_rasterized(True)  # thousands of cells would make a vector file slow to open
    low, high = max(a[0], b[0]), min(a[-1], b[-1])
    if high > low:
        ax.plot([low, high], [low, high], color=MARK, linestyle=(0, (5, 2)), linewidth=1.0, label="equal")
    ax.set_xlabel(f"{name_b}: {label}")
    ax.set_ylabel(f"{name_a}: {label}")
    if colorbar:
        ax.figure.colorbar(mesh, ax=ax, label=criterion, ticks=[0, 0.25, 0.5, 0.75, 1.0])


def cell_edges(centres: NDArray[np.float64], what: str) -> NDArray[np.float64]:
    """Edges (n + 1,) of the cells around `centres` (n,); raises ValueError naming `what` where they do not rise."""
    if centres.size < 2 or (np.diff(centres) <= 0).any():
        raise ValueError(f"{what} with {centres.size} values does not rise from each to the next; sort it")
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])
