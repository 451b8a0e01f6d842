"""Values of several structures, parameter by parameter, with their mean and scatter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from femend.report.plots.style import INK, PALE, SOFT, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_scatter"]

# half of the width that the dots of one parameter are spread over, so that equal ones are seen
SPREAD = 0.25


def draw_scatter(ax: Axes, values: ArrayLike, names: Sequence[str], mean: ArrayLike, scatter: ArrayLike) -> None:
    """Draws `values` (n_structures, n_parameters) as dots side by side for each of `names`, over bars of one and two
    `scatter` (n_parameters,) about `mean` (n_parameters,). Raises ValueError for sizes that differ."""
    table = real(values, "values", (None, len(names)))
    m, s = (real(v, name, (len(names),)) for v, name in ((mean, "mean"), (scatter, "scatter")))
    at = np.arange(len(names))
    ax.bar(at, 4 * s, bottom=m - 2 * s, width=0.7, color=PALE, alpha=0.45, linewidth=0)
    ax.bar(at, 2 * s, bottom=m - s, width=0.7, color=PALE, linewidth=0)
    ax.hlines(m, at - 0.35, at + 0.35, color=SOFT, linewidth=1.0)
    across = np.linspace(-SPREAD, SPREAD, table.shape[0])
    for k in at:
        ax.plot(k + across, table[:, k], "o", color=INK, markersize=2.5)
    ax.axhline(1.0, color=SOFT, linewidth=0.6, linestyle=(0, (1, 1.5)))
    low, high = (float(f([f(table), f(m + k * s), 1.0])) for f, k in ((np.min, -2), (np.max, 2)))
    ax.set_ylim(low - 0.06 * (high - low), high + 0.06 * (high - low))
    ax.set_xticks(at, list(names), rotation=90 if len(names) > 6 else 0)
    ax.set_ylabel("factor on the deck's value")
    ax.grid(True, axis="y")
