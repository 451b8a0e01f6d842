"""The sensitivity matrix as an image: responses over parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from femend.report.plots.style import cell_numbers, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_sensitivity"]

# share of the largest number below which one is rounding
NOTHING = 1e-12


def draw_sensitivity(
    ax: Axes,
    S: ArrayLike,
    responses: Sequence[str],
    parameters: Sequence[str],
    *,
    label: str = "d ln(response) / d ln(parameter)",
    colorbar: bool = True,
) -> None:
    """Draws `S` (n_responses, n_parameters): first response on top, white at 0, one colour per sign.

    The limits are symmetric, at the largest finite magnitude, so that the colour of a sign never changes; up to
    14 x 14 carry their numbers. `label` says what the numbers are. Raises ValueError for shapes that do not fit.
    """
    table = real(S, "S", (len(responses), len(parameters)))
    finite = np.abs(table[np.isfinite(table)])
    top = float(finite.max(initial=0.0)) or 1.0
    image = ax.imshow(table, vmin=-top, vmax=top, cmap="PuOr_r", aspect="auto", interpolation="nearest")
    ax.set_xticks(range(len(parameters)), list(parameters), rotation=90 if len(parameters) > 4 else 0)
    ax.set_yticks(range(len(responses)), list(responses))
    ax.tick_params(length=0)
    for axis, n in ((ax.yaxis, len(responses)), (ax.xaxis, len(parameters))):
        if n > 20:  # names of so many rows at full size would run into each other
            axis.set_tick_params(labelsize=max(3.5, 110.0 / n))
    ax.set_xlabel("parameter")
    ax.set_ylabel("response")
    # rounding left of what is nothing is written as nothing
    shown = np.where(np.abs(table) < NOTHING * top, 0.0, table)
    cell_numbers(ax, shown, np.abs(table) > 0.65 * top, "%.2g")
    if colorbar:
        ax.figure.colorbar(image, ax=ax, label=label)
