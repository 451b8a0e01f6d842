"""What the strength of a regularisation does: the L-curve, and parameters over the strength."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from femend.numerals import plain
from femend.report.plots.style import INK, MARK, curve_style, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_l_curve", "draw_traces"]

# no logarithm of what is rounding beside the largest
NOTHING = 1e-12


def draw_l_curve(
    ax: Axes, squares: ArrayLike, penalties: ArrayLike, strengths: ArrayLike, chosen: int, *, labelled: int = 5
) -> None:
    """Draws `penalties` (n,) over `squares` (n,), both logarithmic, a point for each of `strengths` (n,), every so many
    of them `labelled`; the point number `chosen`, from 0, stands out. Raises ValueError for sizes that differ."""
    s = real(strengths, "strengths", (None,))
    x, y = (real(v, name, (s.size,)) for v, name in ((squares, "squares"), (penalties, "penalties")))
    x, y = (np.maximum(v, NOTHING * max(float(v.max()), 1e-300)) for v in (x, y))
    ax.loglog(x, y, "-o", color=INK, markersize=3, linewidth=1.0)
    ax.loglog(x[chosen], y[chosen], "o", color=MARK, markersize=7, label=f"taken: {plain(s[chosen], 3)}")
    for i in range(0, s.size, max(1, s.size // labelled)):
        ax.annotate(plain(s[i], 2), (x[i], y[i]), textcoords="offset points", xytext=(4, 4), fontsize=6)
    ax.set_xlabel("squares left (values in their deviations)")
    ax.set_ylabel("penalty (priors as stated)")
    ax.grid(True)
    ax.legend()


def draw_traces(ax: Axes, strengths: ArrayLike, values: ArrayLike, names: Sequence[str], chosen: int) -> None:
    """Draws `values` (n, n_parameters) of parameters called `names` over `strengths` (n,), logarithmic, with a line at
    number `chosen`, from 0. Raises ValueError for sizes that differ."""
    s = real(strengths, "strengths", (None,))
    table = real(values, "values", (s.size, len(names)))
    for i, name in enumerate(names):
        ax.semilogx(s, table[:, i], label=name, **curve_style(name, i))
    ax.axvline(s[chosen], color=MARK, linewidth=1.0)
    ax.set_xlabel("strength of the priors")
    ax.set_ylabel("value")
    ax.grid(True)
    ax.legend(fontsize=6)
