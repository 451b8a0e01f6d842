"""The MAC matrix, or any other criterion from 0 to 1 between two sets of modes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from femend.report.plots.style import MARK, UNIT_MAP, cell_numbers, real

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_mac"]


def draw_mac(
    ax: Axes,
    values: ArrayLike,
    freq_a: Sequence[float] | None = None,
    freq_b: Sequence[float] | None = None,
    *,
    pairs: Iterable[tuple[int, int]] = (),
    name_a: str = "test",
    name_b: str = "model",
    criterion: str = "MAC",
    colorbar: bool = True,
) -> None:
    """Draws `values` (n_a, n_b) in [0, 1]: first set up the rows from below, second along the columns.

    `freq_a` (n_a,), `freq_b` (n_b,) in Hz stand beside the mode numbers (from 1). `pairs` (from 0) are framed.
    Matrices up to 14 x 14 carry their numbers, in hundredths. Raises ValueError for shapes that do not fit.
    """
    from matplotlib.patches import Rectangle

    table = real(values, criterion, (None, None))
    image = ax.imshow(table, vmin=0.0, vmax=1.0, cmap=UNIT_MAP, origin="lower", aspect="auto", interpolation="nearest")
    for axis, n, freq, name in ((ax.yaxis, table.shape[0], freq_a, name_a), (ax.xaxis, table.shape[1], freq_b, name_b)):
        if freq is not None and len(freq) != n:
            raise ValueError(f"{len(freq)} frequencies for {n} modes of the {name}")
        step = max(1, -(-n // 15))
        at = range(0, n, step)
        axis.set_ticks(list(at), [str(k + 1) if freq is None else f"{k + 1}  {_hz(freq[k])}" for k in at])
        axis.set_label_text(f"{name} mode" + ("" if freq is None else ", Hz"))
        axis.set_tick_params(length=0)
    if freq_b is not None and table.shape[1] > 4:
        ax.tick_params(axis="x", labelrotation=90)
    cell_numbers(ax, 100 * table, table > 0.55, "%.0f")
    for i, j in pairs:
        ax.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, edgecolor=MARK, linewidth=1.4))
    if colorbar:
        ax.figure.colorbar(image, ax=ax, label=criterion, ticks=[0, 0.25, 0.5, 0.75, 1.0])


def _hz(value: float) -> str:
    """Four digits, the zeros at the end too, so that columns of frequencies line up."""
    return f"{value:#.4g}".rstrip(".")
