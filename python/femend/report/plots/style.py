"""Sizes, fonts and colours of the pictures: one look, safe for colour-blind readers and for grey print."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["CURVES", "INK", "MARK", "PALE", "SOFT", "UNIT_MAP", "curve_style", "figure", "paper_style", "real"]

INK, SOFT, PALE = "#16202c", "#5a6675", "#c4ccd6"
MARK = "#c8600a"  # what the eye should find on a blue map
UNIT_MAP = "Blues"  # criteria from 0 to 1: lightness alone carries the value
# Colour and dash together, so that either alone tells the curves apart; the report's page has the same colours.
CURVES: dict[str, dict[str, Any]] = {
    "measured": {"color": INK, "linestyle": "-", "linewidth": 1.3},
    "nominal": {"color": "#c8600a", "linestyle": (0, (4, 1.6)), "linewidth": 1.1},
    "parameters": {"color": "#1f6fc4", "linestyle": (0, (5, 1.4, 1, 1.4)), "linewidth": 1.1},
    "final": {"color": "#0b8a66", "linestyle": "-", "linewidth": 1.1},
}
_OTHERS: tuple[dict[str, Any], ...] = (
    {"color": "#1f6fc4", "linestyle": "-", "linewidth": 1.1},
    {"color": "#c8600a", "linestyle": (0, (4, 1.6)), "linewidth": 1.1},
    {"color": "#0b8a66", "linestyle": (0, (5, 1.4, 1, 1.4)), "linewidth": 1.1},
    {"color": "#a3458f", "linestyle": (0, (1.2, 1.2)), "linewidth": 1.3},
    {"color": INK, "linestyle": (0, (8, 2)), "linewidth": 1.0},
)
_WIDTHS_MM = {"column": 85.0, "page": 175.0}
_RC: dict[Any, Any] = {
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "axes.linewidth": 0.7,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "grid.color": "#e1e5ea",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "savefig.dpi": 300,
    "figure.dpi": 150,
    "pdf.fonttype": 42,
}


@contextmanager
def paper_style() -> Iterator[None]:
    """Fonts and lines of a publication inside a `with`; nothing of it stays afterwards."""
    import matplotlib as mpl

    # where a font is missing another one does: nothing that a user has to know between lines of progress
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    with mpl.rc_context(_RC):
        yield


def figure(width: str = "column", height_mm: float = 65.0, rows: int = 1, columns: int = 1, **how: Any) -> Figure:
    """A figure one "column" (85 mm) or one "page" (175 mm) wide, without a window, with `rows` x `columns` Axes.

    `how` goes to `Figure.subplots` (sharex, height_ratios ...). Draw inside `paper_style()`. Raises ValueError for
    another width.

    >>> [round(25.4 * v) for v in figure("page", 60).get_size_inches()]
    [175, 60]
    """
    from matplotlib.figure import Figure

    if width not in _WIDTHS_MM:
        raise ValueError(f"width {width!r} is none of {', '.join(_WIDTHS_MM)}")
    made = Figure(figsize=(_WIDTHS_MM[width] / 25.4, height_mm / 25.4), layout="constrained")
    made.subplots(rows, columns, **how)
    return made


def curve_style(name: str, number: int) -> dict[str, Any]:
    """Look of the curve `name`: that of its stage, else the one of its `number`."""
    return CURVES.get(name, _OTHERS[number % len(_OTHERS)])


def real(values: ArrayLike, what: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """`values` as floats of `shape` (None: any size); raises ValueError with both shapes where they differ."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, array.shape, strict=True)):
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise ValueError(f"{what} has shape {array.shape}, not ({wanted})")
    return array


def cell_numbers(ax: Axes, values: NDArray[np.float64], dark: NDArray[np.bool_], pattern: str, limit: int = 14) -> None:
    """Writes the values into the cells of an image, white where the cell is `dark`; not beyond `limit` per side."""
    if max(values.shape) > limit:
        return
    size = 7.0 if max(values.shape) <= 8 else 5.5
    for (i, j), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = "white" if dark[i, j] else INK
            ax.text(j, i, pattern % value, ha="center", va="center", fontsize=size, color=colour)
