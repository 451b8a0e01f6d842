"""The computed Campbell diagram: damped frequencies over speed, their whirl, critical speeds and unstable stretches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femend.data.campbell import Campbell
from femend.report.plots.campbell import draw_order_lines
from femend.report.plots.style import INK, MARK, SOFT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_whirl"]

# colour and dash together, so that either alone tells them apart
_SENSES = {
    "forward": {"color": "#1f6fc4", "linestyle": "-", "linewidth": 1.2},
    "backward": {"color": "#0b8a66", "linestyle": (0, (4, 1.6)), "linewidth": 1.2},
    "planar": {"color": SOFT, "linestyle": (0, (1.2, 1.2)), "linewidth": 1.2},
}
PLANAR = 0.1  # whirl below which a mode is drawn as planar


def draw_whirl(
    ax: Axes, campbell: Campbell, *, orders: Sequence[float] | None = None, f_max: float | None = None
) -> None:
    """Draws the branches of `campbell` over the speed in 1/min, up to `f_max` in Hz.

    Forward, backward and planar whirl have lines of their own, growing motion is thick and marked, critical speeds are
    rings on the lines of `orders` (those of the diagram if not given). Raises ValueError where no branch has a
    frequency.

    >>> draw_whirl(ax, campbell(model, speeds, parts=parts))  # doctest: +SKIP
    """
    freq, rpm = campbell.freq, campbell.rpm
    if not np.isfinite(freq).any():
        raise ValueError("no branch of the Campbell diagram has a frequency; there is nothing to draw")
    top = float(np.nanmax(freq)) * 1.05 if f_max is None else f_max
    shown: set[str] = set()
    for branch in range(freq.shape[1]):
        for i in range(rpm.size - 1):
            ends = freq[i : i + 2, branch]
            if not np.isfinite(ends).all():
                continue
            sense = _sense(campbell.whirl[i : i + 2, branch])
            label = None if sense in shown else sense
            shown.add(sense)
            ax.plot(rpm[i : i + 2], ends, label=label, solid_capstyle="round", **_SENSES[sense])  # type: ignore[arg-type]
    grows = np.isfinite(freq) & (campbell.zeta < -1e-9)
    if grows.any():
        rows, columns = np.nonzero(grows)
        ax.plot(rpm[rows], freq[rows, columns], "x", color=MARK, markersize=4, label="unstable")
    ax.set_xlim(rpm[0], rpm[-1])
    ax.set_ylim(0, top)
    draw_order_lines(ax, campbell.orders if orders is None else orders, color=INK)
    at = [c for c in campbell.critical if (orders is None or c.order in orders) and c.freq <= top]
    if at:
        ax.plot([c.rpm for c in at], [c.freq for c in at], "o", color=MARK, markerfacecolor="none", label="critical")
    ax.set_xlabel("speed, 1/min")
    ax.set_ylabel("damped frequency, Hz")
    ax.legend(loc="upper left")


def _sense(whirl: np.ndarray) -> str:
    """Name of the whirl of a stretch."""
    known = whirl[np.isfinite(whirl)]
    mean = float(known.mean()) if known.size else 0.0
    return "planar" if abs(mean) < PLANAR else "forward" if mean > 0 else "backward"
