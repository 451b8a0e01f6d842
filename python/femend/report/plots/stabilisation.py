"""The stabilisation diagram: poles over frequency and model order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from femend.report.plots.style import INK, MARK, PALE, SOFT, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["STATUSES", "draw_stabilisation"]

# What a pole shares with one of the order below; form, size and lightness tell them apart as well as colour.
STATUSES: dict[str, dict[str, Any]] = {
    "new": {"marker": ".", "s": 5, "color": PALE, "label": "new"},
    "freq": {"marker": "x", "s": 11, "color": "#8a94a3", "linewidths": 0.7, "label": "f"},
    "zeta": {"marker": "^", "s": 11, "facecolors": "none", "edgecolors": "#1f6fc4", "linewidths": 0.7, "label": "f, ζ"},
    "stable": {"marker": "o", "s": 10, "color": "#0b5f9e", "label": "f, ζ, shape"},
}


def draw_stabilisation(
    ax: Axes,
    freq: ArrayLike,
    order: ArrayLike,
    status: Sequence[str],
    *,
    chosen: ArrayLike | None = None,
    background: tuple[ArrayLike, ArrayLike] | None = None,
    background_label: str = "CMIF",
) -> None:
    """Draws poles: `freq` (n,) in Hz, model `order` (n,), `status` (n,) one of "new", "freq", "zeta", "stable".

    A status says what a pole has in common with the order below: nothing, the frequency, frequency and damping, or
    these and the shape. `chosen` (m,) in Hz are drawn as lines. `background` is a frequency axis in Hz with one or
    more positive functions (n_freq,) or (k, n_freq), such as a CMIF or summed FRFs, on a log axis at the right.
    Raises ValueError for shapes that do not fit or an unknown status.
    """
    f = real(freq, "freq", (None,))
    n = real(order, "order", (f.size,))
    names = np.asarray(list(status), dtype=object)
    if names.shape != f.shape:
        raise ValueError(f"{names.size} statuses for {f.size} poles")
    unknown = sorted({str(s) for s in names} - set(STATUSES))
    if unknown:
        raise ValueError(f"status {unknown[0]!r} is none of {', '.join(STATUSES)}")
    if chosen is not None:
        for value in real(chosen, "chosen", (None,)):
            ax.axvline(value, color=MARK, linewidth=0.9, linestyle=(0, (4, 2)), zorder=1)
    for name, look in STATUSES.items():
        here = names == name
        if here.any():
            ax.scatter(f[here], n[here], zorder=3, **look)
    ax.set_xlabel("frequency, Hz")
    ax.set_ylabel("model order")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, handletextpad=0.1, columnspacing=1.0)
    if background is not None:
        _background(ax, background, background_label)


def _background(ax: Axes, background: tuple[ArrayLike, ArrayLike], label: str) -> None:
    x = real(background[0], "the background's frequency", (None,))
    y = np.atleast_2d(np.asarray(background[1], dtype=np.float64))
    if y.shape[-1] != x.size:
        raise ValueError(f"the background has shape {y.shape} for {x.size} frequency lines")
    right = ax.twinx()
    # The poles stay in front of the curves.
    ax.set_zorder(right.get_zorder() + 1)
    ax.patch.set_visible(False)
    for k, curve in enumerate(y):
        positive = np.where(curve > 0, curve, np.nan)
        right.plot(x, positive, color=INK if k == 0 else SOFT, alpha=0.45, linewidth=0.8)
    right.set_yscale("log")
    right.set_ylabel(label)
    ax.set_xlim(float(x[0]), float(x[-1]))
