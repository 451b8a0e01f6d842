"""Forces of the bearings over speed, with the law of an unbalance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from femend.report.plots.style import curve_style, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["OmegaLaw", "draw_force_spectra", "fit_omega_law"]

_MARKERS = ("o", "s", "^", "D", "v")


@dataclass(frozen=True, slots=True)
class OmegaLaw:
    """F = `unbalance` Omega^2 (force unit times s^2: kg m in SI), and the `exponent` that a free power law takes."""

    unbalance: float
    exponent: float


def fit_omega_law(rpm: ArrayLike, force: ArrayLike, use: ArrayLike | None = None) -> OmegaLaw:
    """Fits F = m r Omega^2 and F ~ Omega^n to magnitudes of `force` (n_speeds,) at `rpm` (n_speeds,) in 1/min.

    Both by least squares of ln F, so that each speed counts alike; `use` marks the speeds that count (all by
    default). Raises ValueError for shapes that do not fit, or fewer than two speeds with a force.

    >>> law = fit_omega_law([600.0, 1200.0], [0.002 * (20 * np.pi) ** 2, 0.002 * (40 * np.pi) ** 2])
    >>> round(law.unbalance, 12), round(law.exponent, 12)
    (0.002, 2.0)
    """
    omega = 2 * np.pi / 60 * real(rpm, "rpm", (None,))
    size = np.abs(np.asarray(force))
    if size.shape != omega.shape:
        raise ValueError(f"forces of shape {size.shape} for {omega.size} speeds")
    counts = np.ones(omega.shape, dtype=np.bool_) if use is None else np.asarray(use, dtype=np.bool_)
    counts = counts & (omega > 0) & (size > 0) & np.isfinite(size)
    x, y = np.log(omega[counts]), np.log(size[counts])
    if x.size < 2 or np.ptp(x) == 0:
        raise ValueError(f"{x.size} speeds with a force; a law over speed takes two different ones at least")
    exponent = float(np.polyfit(x, y, 1)[0])
    return OmegaLaw(float(np.exp(np.mean(y - 2 * x))), exponent)


def draw_force_spectra(
    ax: Axes,
    rpm: ArrayLike,
    forces: Mapping[str, ArrayLike],
    *,
    unit: str = "N",
    reliable: ArrayLike | None = None,
    scale: str = "linear",
    law: bool = True,
) -> dict[str, OmegaLaw]:
    """Draws magnitudes of `forces` (n_speeds,), real or complex, by bearing over `rpm` (n_speeds,) in 1/min.

    With `law`, the Omega^2 law of each bearing is fitted to the reliable speeds and drawn as a line; the legend gives
    the exponent that a free power would take. Speeds where `reliable` (n_speeds,) is False are drawn hollow and do
    not count. `scale` of both axes is "linear" or "log". Gives the laws back by bearing. Raises ValueError for shapes
    that do not fit, another scale, or too few speeds for the law.
    """
    if scale not in ("log", "linear"):
        raise ValueError(f"scale {scale!r} is neither 'log' nor 'linear'")
    speed = real(rpm, "rpm", (None,))
    trusted = np.ones(speed.shape, dtype=np.bool_) if reliable is None else np.asarray(reliable, dtype=np.bool_)
    if trusted.shape != speed.shape:
        raise ValueError(f"{trusted.size} marks of reliable speeds for {speed.size} speeds")
    laws: dict[str, OmegaLaw] = {}
    for number, (name, values) in enumerate(forces.items()):
        size = np.abs(np.asarray(values))
        if size.shape != speed.shape:
            raise ValueError(f"the force of {name!r} has shape {size.shape} for {speed.size} speeds")
        look = curve_style(name, number)
        marker: dict[str, Any] = {"linestyle": "none", "marker": _MARKERS[number % len(_MARKERS)], "markersize": 3.0}
        text = name
        if law:
            laws[name] = fit_omega_law(speed, size, trusted)
            fine = np.linspace(speed.min(), speed.max(), 200)
            curve = laws[name].unbalance * (2 * np.pi / 60 * fine) ** 2
            ax.plot(fine, curve, **look)
            text = f"{name}, exponent {laws[name].exponent:.2f}"
        ax.plot(speed[trusted], size[trusted], color=look["color"], label=text, **marker)
        if not trusted.all():
            hollow: dict[str, Any] = {
                "markerfacecolor": "none",
                "markeredgecolor": look["color"],
                "markeredgewidth": 0.6,
                "alpha": 0.6,
            }
            ax.plot(speed[~trusted], size[~trusted], **marker, **hollow)
    if not trusted.all():
        ax.plot([], [], linestyle="none", marker="o", markersize=3, mfc="none", mec="#5a6675", label="not reliable")
    if law:
        ax.plot([], [], color="#5a6675", linewidth=1.1, label=r"line: $m\,r\,\Omega^2$")
    ax.set_xscale(scale)
    ax.set_yscale(scale)
    if scale == "log":
        _plain_speeds(ax)
    ax.set_xlabel("speed, 1/min")
    ax.set_ylabel(f"force, {unit}")
    ax.grid(True)
    ax.legend(loc="upper left")
    return laws


def _plain_speeds(ax: Axes) -> None:
    """Speeds on a log axis as plain numbers: 300, 500, 1000 and not powers of ten."""
    from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0)))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_formatter(NullFormatter())
