"""The run-up as a map: response over speed and frequency, with order lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from femend.report.plots.dac_matrix import cell_edges
from femend.report.plots.style import INK, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_campbell", "draw_order_lines"]


def draw_campbell(
    ax: Axes,
    rpm: ArrayLike,
    freq: ArrayLike,
    magnitude: ArrayLike,
    *,
    unit: str,
    orders: Sequence[float] = (1.0,),
    modes: ArrayLike | None = None,
    decades: float = 3.0,
    colorbar: bool = True,
) -> None:
    """Draws `magnitude` (n_speeds, n_freq) over the rising `rpm` (n_speeds,) in 1/min and `freq` (n_freq,) in Hz.

    Logarithmic colour over `decades` below the largest value; `unit` is that of the magnitude. `orders` are lines
    f = order * rpm / 60, `modes` (m,) natural frequencies in Hz, dotted. Raises ValueError for shapes that do not
    fit, axes that do not rise, or a magnitude that is nowhere positive.
    """
    from matplotlib.colors import LogNorm

    speed, f = real(rpm, "rpm", (None,)), real(freq, "freq", (None,))
    size = real(magnitude, "magnitude", (speed.size, f.size))
    top = float(np.nanmax(size, initial=0.0))
    if not top > 0:
        raise ValueError("the magnitude of the run-up is nowhere positive; there is nothing to draw")
    norm = LogNorm(vmin=top * 10.0**-decades, vmax=top)
    shown = np.maximum(np.nan_to_num(size), top * 10.0**-decades)
    mesh = ax.pcolormesh(cell_edges(speed, "rpm"), cell_edges(f, "freq"), shown.T, norm=norm, cmap="cividis")
    mesh.set_rasterized(True)
    ax.set_xlim(speed[0], speed[-1])
    ax.set_ylim(f[0], f[-1])
    if modes is not None:
        for value in real(modes, "modes", (None,)):
            ax.axhline(value, color="white", linestyle=(0, (1, 1.6)), linewidth=1.0)
    draw_order_lines(ax, orders)
    ax.set_xlabel("speed, 1/min")
    ax.set_ylabel("frequency, Hz")
    if colorbar:
        ax.figure.colorbar(mesh, ax=ax, label=f"magnitude, {unit}", extend="min")


def draw_order_lines(ax: Axes, orders: Sequence[float], *, color: str = "white") -> None:
    """Lines f = order * rpm / 60 across axes of speed (1/min) and frequency (Hz), each named where it leaves them."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    for order in orders:
        slope = order / 60.0
        ends = np.clip(np.array([x0, x1]), y0 / slope, y1 / slope)
        if ends[1] <= ends[0]:
            continue
        ax.plot(
            ends, slope * ends, color=color, linewidth=0.6, alpha=0.8, linestyle=(0, (6, 4)), label=f"order {order:g}"
        )
        leaves_top = slope * x1 > y1
        place: dict[str, Any] = (
            {"xytext": (0, 2), "ha": "center", "va": "bottom"} if leaves_top else {"xytext": (2, 0), "va": "center"}
        )
        ax.annotate(
            f"{order:g}", (ends[1], slope * ends[1]), textcoords="offset points", color=INK, fontsize=7, **place
        )
