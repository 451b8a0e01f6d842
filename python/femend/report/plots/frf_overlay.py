"""FRFs or ODS-FRFs over each other: magnitude, and phase below."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.report.plots.style import curve_style, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_frf"]


def draw_frf(
    ax: Axes,
    ax_phase: Axes | None,
    freq: ArrayLike,
    curves: Mapping[str, ArrayLike],
    *,
    unit: str,
    quantity: str = "FRF",
    scale: str = "log",
    title: str = "",
) -> None:
    """Draws complex `curves` (n_freq,) by name over `freq` (n_freq,) in Hz: magnitude in `ax`, phase in `ax_phase`.

    The names "measured", "nominal", "parameters" and "final" have their own looks. `scale` of the magnitude is "log"
    or "linear"; `quantity` heads the axis ("accelerance", "ODS-FRF" ...) before its `unit`. The phase, in degrees from
    -180 to 180, is broken where it wraps; without `ax_phase` the magnitude stands alone. Values that are not finite
    are gaps. Raises ValueError for shapes that do not fit, another scale, or no curve.
    """
    f = real(freq, "freq", (None,))
    if scale not in ("log", "linear"):
        raise ValueError(f"scale {scale!r} is neither 'log' nor 'linear'")
    if not curves:
        raise ValueError("no curve is given; there is nothing to draw")
    for number, (name, values) in enumerate(curves.items()):
        curve = np.asarray(values, dtype=np.complex128)
        if curve.shape != f.shape:
            raise ValueError(f"curve {name!r} has shape {curve.shape} for {f.size} lines")
        look = curve_style(name, number)
        size = np.abs(curve)
        ax.plot(f, np.where(size > 0, size, np.nan) if scale == "log" else size, label=name, **look)
        if ax_phase is not None:
            ax_phase.plot(f, _broken(np.degrees(np.angle(curve))), **look)
    ax.set_yscale(scale)
    if scale == "linear":
        ax.set_ylim(bottom=0.0)
    ax.set_xlim(f[0], f[-1])
    ax.set_ylabel(f"|{quantity}|, {unit}")
    ax.grid(True)
    if title:
        ax.set_title(title)
    ax.legend(loc="best")
    last = ax
    if ax_phase is not None:
        ax_phase.set_ylim(-190, 190)
        ax_phase.set_yticks([-180, -90, 0, 90, 180])
        ax_phase.set_ylabel("phase, °")
        ax_phase.set_xlim(f[0], f[-1])
        ax_phase.grid(True)
        last = ax_phase
    last.set_xlabel("frequency, Hz")


def _broken(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees with a gap where they wrap, so that no vertical line is drawn there."""
    broken = angle.copy()
    broken[1:][np.abs(np.diff(angle)) > 180.0] = np.nan
    return broken
