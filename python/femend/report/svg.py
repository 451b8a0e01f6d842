"""Axes and curves written straight as SVG: small files, no plotting library, colours from the page's style sheet.

Coordinates are written with one decimal of a pixel; long curves are reduced to the least and greatest value per pixel
column before they come here or in `Axes.curve`, so that peaks stay.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

__all__ = ["Axes", "decimate", "log_ticks", "nice_ticks", "svg"]

FloatArray = NDArray[np.float64]


def svg(
    width: float, height: float, body: str, label: str, css: str = "plot", axes: Sequence[tuple[Axes, str, str]] = ()
) -> str:
    """An inline SVG of `width` by `height` units, with `label` for those who do not see it.

    `axes` lists (axes, unit of x, unit of y) whose values the page reads out under the pointer.
    """
    read_out = json.dumps([a.scales(x, y) for a, x, y in axes], separators=(",", ":"))
    data = f' data-axes="{escape(read_out)}"' if axes else ""
    view = f'viewBox="0 0 {width:g} {height:g}"'
    return f'<svg class="{css}" {view} role="img" aria-label="{escape(label)}"{data}>{body}</svg>'


def nice_ticks(low: float, high: float, count: int = 5) -> list[float]:
    """About `count` round numbers (1, 2 or 5 times a power of ten apart) inside [low, high].

    >>> nice_ticks(0.0, 1.0)
    [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    """
    if not (math.isfinite(low) and math.isfinite(high)) or high <= low:
        return [low] if math.isfinite(low) else []
    raw = (high - low) / max(count, 1)
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [float(round(k * step, 12 - math.floor(math.log10(step)))) for k in range(first, last + 1)]


def log_ticks(low: float, high: float) -> list[float]:
    """Powers of ten inside [low, high], thinned to at most six; low and high are positive."""
    first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
    step = max(1, math.ceil((last - first + 1) / 6))
    return [10.0**k for k in range(first, last + 1, step)]


def decimate(x: FloatArray, y: FloatArray, buckets: int) -> tuple[FloatArray, FloatArray]:
    """At most two points per bucket of equal count: its least and its greatest y, in the order of x. No new points."""
    n = len(x)
    if n <= 2 * buckets:
        return x, y
    edges = np.linspace(0, n, buckets + 1).astype(int)
    keep: list[int] = [0]
    for a, b in itertools.pairwise(edges):
        part = y[a:b]
        low, high = a + int(np.argmin(part)), a + int(np.argmax(part))
        keep.extend(sorted({low, high}))
    keep.append(n - 1)
    index = np.unique(keep)
    return x[index], y[index]


def tick_text(value: float, log: bool = False) -> str:
    """A tick's number: 0.02, 1500, 10⁻⁶."""
    if value == 0:
        return "0"
    exponent = round(math.log10(abs(value))) if log else math.floor(math.log10(abs(value)) + 1e-9)
    if log and not -3 <= exponent <= 3:
        return "10" + str(exponent).translate(str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"))
    if not log and not -4 <= exponent <= 5:
        return f"{value / 10.0**exponent:g}e{exponent}".replace("-", "−")
    return f"{value:.10g}".replace("-", "−")


class Axes:
    """A frame with two scales inside an SVG; collects its parts in `parts`.

    `box` is (left, top, width, height) of the data area in SVG units.
    """

    def __init__(
        self,
        box: tuple[float, float, float, float],
        x_range: tuple[float, float],
        y_range: tuple[float, float],
        *,
        log_x: bool = False,
        log_y: bool = False,
    ) -> None:
        self.left, self.top, self.width, self.height = box
        self.log_x, self.log_y = log_x, log_y
        self.x_range, self.y_range = x_range, y_range
        self.parts: list[str] = []

    def scales(self, x_unit: str, y_unit: str) -> list[float | str | bool]:
        """Box, ranges and kinds of the two scales with their units, as the page's script takes them."""
        ends = (self.left, self.top, self.width, self.height, *self.x_range, *self.y_range)
        return [*(float(f"{v:.6g}") for v in ends), self.log_x, self.log_y, x_unit, y_unit]

    def x(self, value: FloatArray | float) -> FloatArray:
        """Horizontal position of data values."""
        return self.left + self.width * _share(value, self.x_range, self.log_x)

    def y(self, value: FloatArray | float) -> FloatArray:
        """Vertical position of data values, clipped a little outside the frame."""
        return self.top + self.height * (1.0 - np.clip(_share(value, self.y_range, self.log_y), -0.02, 1.02))

    def frame(
        self,
        x_label: str = "",
        y_label: str = "",
        *,
        x_numbers: bool = True,
        y_ticks: int = 4,
        y_values: tuple[float, ...] = (),
    ) -> None:
        """Grid, numbers and axis names; `y_values` instead of round numbers. Call first: curves lie above."""
        bottom, right = self.top + self.height, self.left + self.width
        xs = log_ticks(*self.x_range) if self.log_x else nice_ticks(*self.x_range, max(3, int(self.width / 70)))
        ys = y_values or (log_ticks(*self.y_range) if self.log_y else nice_ticks(*self.y_range, y_ticks))
        for value in xs:
            at = float(self.x(value))
            self.parts.append(f'<path class="grid" d="M{at:.1f} {self.top:g}V{bottom:g}"/>')
            if x_numbers:
                self.text(at, bottom + 14, tick_text(value, self.log_x), "middle")
        for value in ys:
            at = float(self.y(value))
            self.parts.append(f'<path class="grid" d="M{self.left:g} {at:.1f}H{right:g}"/>')
            self.text(self.left - 6, at + 3.5, tick_text(value, self.log_y), "end")
        self.parts.append(f'<path class="axis" d="M{self.left:g} {self.top:g}V{bottom:g}H{right:g}"/>')
        if x_label:
            self.text(right, bottom + 28, x_label, "end", "name")
        if y_label:
            self.text(self.left, self.top - 7, y_label, "start", "name")

    def text(self, x: float, y: float, words: str, anchor: str = "start", css: str = "tick") -> None:
        """Words at a place in SVG units, escaped."""
        self.parts.append(f'<text class="{css}" x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(words)}</text>')

    def curve(
        self, x: FloatArray, y: FloatArray, css: str, gap: float | None = None, wrap: float | None = None
    ) -> None:
        """A curve; values that are not finite are left out, and it breaks where x jumps by more than `gap`, or y by
        more than `wrap`."""
        good = np.isfinite(x) & np.isfinite(y) & ((y > 0) if self.log_y else True)
        x, y = np.asarray(x, float)[good], np.asarray(y, float)[good]
        if not len(x):
            return
        x, y = decimate(x, y, max(int(self.width), 2))
        jump = np.zeros(len(x), dtype=bool) if gap is None else np.concatenate([[True], np.diff(x) > gap])
        jump[0] = True
        if wrap is not None:
            jump[1:] |= np.abs(np.diff(y)) > wrap
        data = _path(self.x(x), self.y(y), jump)
        self.parts.append(f'<path class="curve {css}" d="{data}"/>')

    def points(self, x: FloatArray, y: FloatArray, css: str) -> None:
        """Dots, as one path of zero-length strokes with round ends."""
        good = np.isfinite(x) & np.isfinite(y)
        px, py = self.x(np.asarray(x, float)[good]), self.y(np.asarray(y, float)[good])
        data = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(px, py, strict=True))
        if data:
            self.parts.append(f'<path class="dots {css}" d="{data}"/>')

    def band(self, x: FloatArray, low: FloatArray, high: FloatArray, css: str) -> None:
        """The area between two curves over the same x."""
        good = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
        if good.sum() < 2:
            return
        px = self.x(x[good])
        up = [f"{a:.1f} {b:.1f}" for a, b in zip(px, self.y(high[good]), strict=True)]
        down = [f"{a:.1f} {b:.1f}" for a, b in zip(px[::-1], self.y(low[good])[::-1], strict=True)]
        self.parts.append(f'<path class="band {css}" d="M{"L".join(up + down)}Z"/>')


def _path(x: FloatArray, y: FloatArray, jump: NDArray[np.bool_]) -> str:
    """Path data in steps of a tenth: absolute where `jump` says so, else relative, which halves the size."""
    tx, ty = np.round(10 * x).astype(int), np.round(10 * y).astype(int)
    dx, dy = np.diff(tx, prepend=0), np.diff(ty, prepend=0)
    parts = []
    for k, new in enumerate(jump):
        parts.append(f"M{tx[k] / 10:g} {ty[k] / 10:g}" if new else f"l{dx[k] / 10:g} {dy[k] / 10:g}")
    return "".join(parts)


def _share(value: FloatArray | float, limits: tuple[float, float], log: bool) -> FloatArray:
    low, high = limits
    v = np.asarray(value, dtype=float)
    if log:
        v, low, high = np.log10(np.maximum(v, 1e-300)), math.log10(low), math.log10(high)
    return np.asarray((v - low) / (high - low) if high > low else np.full_like(v, 0.5))
