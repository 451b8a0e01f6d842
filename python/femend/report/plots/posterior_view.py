"""A parameter's posterior by draws, with the bell it is taken for and the prior."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from femend.report.plots.style import CURVES, INK, PALE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_posterior"]

# bars of a histogram: square root of the draws, within these
FEWEST, MOST = 10, 40


def draw_posterior(
    ax: Axes,
    draws: ArrayLike,
    *,
    name: str = "",
    laplace: tuple[float, float] | None = None,
    prior: tuple[float, float] | None = None,
) -> None:
    """Draws the density of `draws` (n,) of a value called `name`, as bars.

    `laplace` and `prior` are mean and standard deviation of normal densities drawn over them, where given. Raises
    ValueError for fewer than two finite draws.
    """
    values = np.asarray(draws, dtype=np.float64).ravel()
    values = values[np.isfinite(values)]
    if values.size < 2:
        raise ValueError(f"{values.size} finite draws of {name!r}; a density takes two or more")
    n = int(np.clip(round(math.sqrt(values.size)), FEWEST, MOST))
    ax.hist(values, bins=n, density=True, color=PALE, edgecolor="white", linewidth=0.4, label="draws")
    low, high = float(values.min()), float(values.max())
    if laplace is not None and math.isfinite(laplace[1]):
        mean, sd = laplace
        low, high = min(low, mean - 3.2 * sd), max(high, mean + 3.2 * sd)
    x = np.linspace(low, high, 240)
    for curve, label, look in ((laplace, "Laplace", CURVES["parameters"]), (prior, "prior", CURVES["nominal"])):
        if curve is not None and math.isfinite(curve[1]) and curve[1] > 0:
            z = (x - curve[0]) / curve[1]
            ax.plot(x, np.exp(-0.5 * z**2) / (curve[1] * math.sqrt(2 * math.pi)), label=label, **look)
    ax.set_xlim(low, high)
    ax.set_yticks([])
    ax.locator_params(axis="x", nbins=4)
    ax.set_xlabel(name, color=INK)
