"""The run-up as a waterfall: one spectrum per speed, each drawn a step above the last."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from femend.report.plots.style import INK, MARK, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_waterfall"]


def draw_waterfall(
    ax: Axes,
    rpm: ArrayLike,
    freq: ArrayLike,
    magnitude: ArrayLike,
    *,
    unit: str,
    orders: Sequence[float] = (1.0,),
    height: float = 14.0,
    n_shown: int = 60,
) -> None:
    """Draws spectra `magnitude` (n_speeds, n_freq), linear, over `freq` (n_freq,) in Hz, stacked by `rpm` (n_speeds,).

    Each foot stands at its speed in 1/min on the vertical axis; the largest value rises `height` times the mean step
    of the spectra shown, and a bar tells its size in `unit`. At most `n_shown` spectra are drawn. `orders` are the
    lines rpm = 60 f / order. Raises ValueError for shapes that do not fit, speeds that do not rise, or a magnitude
    that is nowhere positive.
    """
    speed, f = real(rpm, "rpm", (None,)), real(freq, "freq", (None,))
    size = real(magnitude, "magnitude", (speed.size, f.size))
    top = float(np.nanmax(size, initial=0.0))
    if speed.size < 2 or (np.diff(speed) <= 0).any() or not top > 0:
        raise ValueError(f"{speed.size} speeds and a largest magnitude of {top:g}: give rising speeds and a response")
    shown = np.unique(np.linspace(0, speed.size - 1, min(n_shown, speed.size)).round().astype(int))
    lift = height * float(speed[shown[-1]] - speed[shown[0]]) / max(len(shown) - 1, 1) / top
    for k in shown[::-1]:  # from the back, so that each hides what is behind it
        curve = speed[k] + lift * np.nan_to_num(size[k])
        ax.fill_between(f, speed[k], curve, color="white", linewidth=0, zorder=3 - k / speed.size)
        ax.plot(f, curve, color=INK, linewidth=0.6, zorder=3 - k / speed.size)
    ax.set_xlim(f[0], f[-1])
    ax.set_ylim(speed[0] - 0.02 * np.ptp(speed), speed[-1] + 1.05 * lift * top)
    for order in orders:
        at = order * speed / 60.0
        inside = (at >= f[0]) & (at <= f[-1])
        if inside.any():
            ax.plot(
                at[inside], speed[inside], color=MARK, linewidth=0.7, alpha=0.8, zorder=1.5, label=f"order {order:g}"
            )
            end = (at[inside][-1], speed[inside][-1])
            ax.annotate(f"{order:g}", end, textcoords="offset points", xytext=(2, 2), color=MARK, fontsize=7, zorder=5)
    _scale_bar(ax, top, lift, unit)
    ax.set_xlabel("frequency, Hz")
    ax.set_ylabel("speed, 1/min")


def _scale_bar(ax: Axes, top: float, lift: float, unit: str) -> None:
    """A bar at the right whose length is a round magnitude."""
    step = 10.0 ** np.floor(np.log10(top))
    value = step * max(n for n in (1, 2, 5) if n * step <= top)
    x = 1.02
    y1 = ax.get_ylim()[1]
    transform = ax.get_yaxis_transform()
    ax.plot([x, x], [y1 - lift * value, y1], color=INK, linewidth=1.6, transform=transform, clip_on=False)
    text = f"{value:g} {unit}"
    ax.text(x + 0.015, y1 - lift * value / 2, text, transform=transform, va="center", rotation=90, fontsize=7)
