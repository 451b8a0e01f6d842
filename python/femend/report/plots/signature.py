"""CSAC and CSF over frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from femend.report.plots.style import PALE, curve_style, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_signature"]


def draw_signature(
    ax: Axes,
    freq: ArrayLike,
    curves: Mapping[str, ArrayLike],
    *,
    criterion: str = "CSAC",
    target: float | None = None,
    bands: Sequence[tuple[float, float]] = (),
) -> None:
    """Draws `curves` (n_freq,) in [0, 1] by name over `freq` (n_freq,) in Hz: CSAC, CSF, RVAC or any such criterion.

    `bands` in Hz are shaded, `target` is a line to reach. The names of the stages have their own looks (see
    `draw_frf`). Raises ValueError for shapes that do not fit or no curve.
    """
    f = real(freq, "freq", (None,))
    if not curves:
        raise ValueError("no curve is given; there is nothing to draw")
    for low, high in bands:
        ax.axvspan(low, high, color=PALE, alpha=0.45, linewidth=0, zorder=0)
    if target is not None:
        ax.axhline(target, color="#5a6675", linewidth=0.8, linestyle=(0, (1, 1.5)), label=f"target {target:g}")
    for number, (name, values) in enumerate(curves.items()):
        ax.plot(f, real(values, f"curve {name!r}", (f.size,)), label=name, **curve_style(name, number))
    ax.set_xlim(f[0], f[-1])
    ax.set_ylim(0.0, 1.03)
    ax.set_xlabel("frequency, Hz")
    ax.set_ylabel(criterion)
    ax.grid(True)
    # Above the axes: the curves may be anywhere inside.
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(curves) + (target is not None))
