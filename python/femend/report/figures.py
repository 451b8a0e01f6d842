"""The figures of the report as inline SVG: FRF overlays, time traces, restoring force, places, small bars in tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.deciding.stages import STAGES
from femend.report.content import FrfOverlay, Place, RestoringForce, TimeOverlay
from femend.report.numbers import pretty_unit, ratio, significant
from femend.report.svg import Axes, log_ticks, svg

__all__ = ["error_bars", "frf_figure", "interval", "places_figure", "restoring_figures", "trace_figure"]

FloatArray = NDArray[np.float64]

_WIDTH = 520.0
# degrees from a cut of the phase within which a value may come out on its other side
NEAR_CUT = 45.0


def frf_figure(overlay: FrfOverlay) -> str:
    """Magnitude (log) over phase of one sensor; "" where nothing finite is left to draw."""
    freq = np.asarray(overlay.freq, float)
    curves = [("measured", np.asarray(overlay.measured))]
    curves += [(stage, np.asarray(c)) for stage in STAGES if (c := getattr(overlay, stage)) is not None]
    sizes = [np.abs(c)[np.isfinite(c) & (np.abs(c) > 0)] for _, c in curves]
    if len(freq) < 2 or not any(len(s) for s in sizes):
        return ""
    step = float(np.median(np.diff(freq)))
    span = (float(freq[0]), float(freq[-1]))
    magnitude = Axes((58, 22, _WIDTH - 70, 190), span, _log_range(sizes), log_y=True)
    unit = pretty_unit(overlay.unit)
    magnitude.frame("", f"magnitude, {unit}" if unit else "magnitude", x_numbers=False)
    top = _emptiest_cut(curves[0][1])
    phase = Axes((58, 232, _WIDTH - 70, 56), span, (top - 360.0, top))
    ticks = tuple(float(v) for v in range(-180, 181, 180) if top - 360.0 <= v <= top)
    phase.frame("frequency, Hz", "phase, °", y_values=ticks)
    for stage, curve in curves:
        magnitude.curve(freq, np.abs(curve), stage, gap=4.5 * step)
        angle = top - (top - np.degrees(np.angle(curve))) % 360.0
        phase.curve(freq, angle, stage, gap=4.5 * step, wrap=180.0)
    label = f"Frequency response {overlay.label}, recording {overlay.recording}"
    axes = ((magnitude, "Hz", unit), (phase, "Hz", "°"))
    return svg(_WIDTH, 322, "".join(magnitude.parts + phase.parts), label, axes=axes)


def trace_figure(trace: TimeOverlay) -> str:
    """Above: the whole record with the error of each stage; below: the cycles around its peak, curve over curve."""
    t = np.asarray(trace.t, float)
    curves = {s: np.asarray(c, float) for s in STAGES if (c := getattr(trace, s)) is not None}
    base = None if trace.measured is None else np.asarray(trace.measured, float)
    reference = base if base is not None else next(iter(curves.values()), None)
    if len(t) < 2 or reference is None or not np.isfinite(reference).any():
        return ""
    window = _window_around_peak(t, reference)
    unit = pretty_unit(trace.unit)
    parts: list[str] = []
    if base is not None and curves:
        reach = 1.05 * _largest([base])
        whole = Axes((58, 22, _WIDTH - 70, 90), (float(t[0]), float(t[-1])), (-reach, reach))
        whole.frame("time, s", f"recording and errors, {unit}", y_ticks=5)
        whole.band(*_envelope(t, base), "measured")
        before, after = ("parameters" if "parameters" in curves else "nominal"), "final"
        for stage in (before, after):
            if stage in curves:
                whole.band(*_envelope(t, curves[stage] - base), stage)
        whole.parts.append(_window_mark(whole, window))
        parts += whole.parts
    inside = (t >= window[0]) & (t <= window[1])
    drawn = ([("measured", base)] if base is not None else []) + list(curves.items())
    reach = 1.08 * _largest([c[inside] for _, c in drawn if c is not None])
    top = 152.0 if parts else 22.0
    zoom = Axes((58, top, _WIDTH - 70, 150), window, (-reach, reach))
    zoom.frame("time, s", f"around the peak, {unit}")
    for stage, c in drawn:
        if c is not None:
            zoom.curve(t[inside], c[inside], stage)
    label = f"Time trace {trace.label}, recording {trace.recording}"
    return svg(_WIDTH, top + 186, "".join(parts + zoom.parts), label, axes=((zoom, "s", unit),))


def restoring_figures(force: RestoringForce) -> list[str]:
    """Force over displacement, and force over velocity."""
    figures = []
    for axis, unit, words in (("d", force.d_unit, "displacement"), ("v", force.v_unit, "velocity")):
        x, f = np.asarray(getattr(force, axis), float), np.asarray(force.f, float)
        law_x, law_f = getattr(force, f"law_{axis}"), force.law_f
        if not len(x) or not np.isfinite(x).any():
            continue
        if unit.startswith("m") and not unit.startswith("mm") and _largest([x]) < 0.5:
            unit, x, law_x = f"m{unit}", 1e3 * x, None if law_x is None else 1e3 * np.asarray(law_x, float)
        every = [x] if law_x is None else [x, np.asarray(law_x, float)]
        forces = [f] if law_f is None else [f, np.asarray(law_f, float)]
        axes = Axes((64, 22, _WIDTH - 76, 270), _padded(every), _padded(forces))
        axes.frame(f"{words}, {pretty_unit(unit)}", f"force, {pretty_unit(force.f_unit)}", y_ticks=6)
        axes.points(*_thinned(x, f, 1500), "measured")
        if law_x is not None and law_f is not None:
            axes.points(*_thinned(np.asarray(law_x, float), np.asarray(law_f, float), 1500), "final")
        units = (axes, pretty_unit(unit), pretty_unit(force.f_unit))
        figures.append(svg(_WIDTH, 326, "".join(axes.parts), f"Recovered force over {words}", axes=(units,)))
    return figures


def places_figure(places: Sequence[Place], threshold: float | None = None, limit: int = 16) -> str:
    """How much worse every place is than the best one: bars of cost difference on a log(1 + difference) scale."""
    ranked = sorted((p for p in places if math.isfinite(p.cost)), key=lambda p: p.cost)[:limit]
    if not ranked:
        return ""
    best = ranked[0].cost
    worst = max(p.cost - best for p in ranked)
    row, width = 22.0, 960.0
    left = min(max(210.0, 30.0 + 6.8 * max(len(p.label) for p in ranked)), 480.0)  # room for the longest label
    axes = Axes((left, 24, width - left - 90, row * len(ranked)), (1.0, max(1.0 + worst * 1.05, 10.0)), (0, 1))
    axes.log_x = True
    bottom = axes.top + axes.height
    for value in (0.0, *log_ticks(1.0, axes.x_range[1])):
        at = float(axes.x(1.0 + value))
        if at <= left + axes.width:
            axes.parts.append(f'<path class="grid" d="M{at:.1f} {axes.top:g}V{bottom:g}"/>')
            axes.text(at, bottom + 15, f"{value:g}", "middle")
    if threshold is not None and threshold > 0:
        edge = min(float(axes.x(1.0 + threshold)), left + axes.width)
        axes.parts.insert(
            0, f'<rect class="zone" x="{left}" y="{axes.top}" width="{edge - left:.1f}" height="{axes.height:g}"/>'
        )
        axes.text(left, 14, "not told apart", "start", "name")
    for k, place in enumerate(ranked):
        y, end = axes.top + row * k, float(axes.x(1.0 + place.cost - best))
        css = "best" if k == 0 else "alike" if place.in_set else "other"
        axes.text(left - 10, y + 15, place.label, "end", f"bar-name {css}")
        size = f'width="{max(end - left, 3):.1f}" height="{row - 8:g}"'
        axes.parts.append(f'<rect class="bar {css}" x="{left}" y="{y + 4:.1f}" {size}/>')
        axes.text(max(end, left + 3) + 6, y + 15, "best" if k == 0 else f"+{significant(place.cost - best)}")
    axes.text(left + axes.width, bottom + 31, "cost above the best place, J − J min (lower is better)", "end", "name")
    return svg(width, bottom + 40, "".join(axes.parts), "Ranking of candidate places", "plot wide")


def interval(factor: float, sd: float, prior_sd: float | None) -> str:
    """A parameter's estimate with its 95 % interval, over the prior's one and two sigma around the deck's value."""
    if not math.isfinite(factor):
        return ""
    prior = prior_sd if prior_sd is not None and math.isfinite(prior_sd) and prior_sd > 0 else 0.0
    sd = sd if math.isfinite(sd) and sd > 0 else 0.0
    reach = 1.15 * max(2.0 * prior, abs(factor - 1.0) + 2.0 * sd, 1e-3)
    width = 180.0

    def at(value: float) -> float:
        return (0.5 + 0.5 * value / reach) * width

    parts = []
    for sigmas, css in ((2.0, "prior two"), (1.0, "prior")):
        if prior:
            low, high = at(-sigmas * prior), at(sigmas * prior)
            parts.append(f'<rect class="{css}" x="{low:.1f}" y="4" width="{high - low:.1f}" height="12" rx="2"/>')
    x = at(factor - 1.0)
    parts.append(f'<path class="axis" d="M{at(0.0):.1f} 1V19"/>')
    parts.append(f'<path class="estimate" d="M{at(factor - 1 - 2 * sd):.1f} 10H{at(factor - 1 + 2 * sd):.1f}"/>')
    parts.append(f'<circle class="estimate" cx="{x:.1f}" cy="10" r="4"/>')
    return svg(width, 20, "".join(parts), f"estimate {factor:.3f} against the prior", "mini")


def error_bars(stages: Iterable[tuple[str, float | None]], noise: float | None, largest: float) -> str:
    """Bars of one recording's NRMSE per stage, from 0 to `largest`, with the noise floor as a line."""
    width, row = 220.0, 7.0
    parts, y = [], 2.0
    words = []
    for stage, value in stages:
        if value is not None and math.isfinite(value) and largest > 0:
            length = max(width * min(value / largest, 1.0), 1.0)
            parts.append(f'<rect class="fill {stage}" x="0" y="{y:g}" width="{length:.1f}" height="{row - 1.5:g}"/>')
            words.append(f"{stage} {ratio(value)}")
        y += row
    if noise is not None and math.isfinite(noise) and largest > 0:
        parts.append(f'<path class="noise" d="M{width * min(noise / largest, 1.0):.1f} 0V{y:g}"/>')
    return svg(width, y + 1, "".join(parts), "NRMSE: " + ", ".join(words), "mini")


def _log_range(sizes: Sequence[FloatArray]) -> tuple[float, float]:
    """Limits that hold the curves; deep antiresonances are cut at the measured curve's half percentile."""
    low = min(float(np.percentile(s, 0.5)) for s in sizes if len(s))
    high = max(float(s.max()) for s in sizes if len(s))
    low = max(low, high * 1e-6)
    return (low * 0.7, high * 1.5) if high > low else (low * 0.5, low * 2.0)


def _emptiest_cut(curve: NDArray[np.complex128]) -> float:
    """The angle in degrees at which the phase of `curve` is cut, the upper end of what is drawn: 180, or 90 or 270
    where fewer values lie near these. An accelerance lies at 0 and 180 but for its resonances, and noise would throw
    it up and down at 180."""
    angle = np.degrees(np.angle(curve[np.isfinite(curve)]))

    def near(cut: float) -> int:
        return int((np.abs((angle - cut + 180.0) % 360.0 - 180.0) < NEAR_CUT).sum())

    return min((180.0, 90.0, 270.0), key=near)


def _window_around_peak(t: FloatArray, y: FloatArray, cycles: int = 12) -> tuple[float, float]:
    """The stretch of about `cycles` zero crossings' worth of periods around the largest value."""
    finite = np.where(np.isfinite(y), y, 0.0)
    duration = float(t[-1] - t[0])
    peak = float(t[int(np.argmax(np.abs(finite)))])
    local = np.abs(t - peak) <= 0.05 * duration
    crossings = int(np.count_nonzero(np.diff(np.signbit(finite[local]))))
    period = 2.0 * 0.1 * duration / max(crossings, 2)
    half = min(max(0.5 * cycles * period, 30.0 * duration / len(t)), 0.5 * duration)
    start = min(max(peak - half, float(t[0])), float(t[-1]) - 2.0 * half)
    return start, start + 2.0 * half


def _envelope(t: FloatArray, y: FloatArray, buckets: int = 220) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Least and greatest value per bucket of equal count."""
    edges = np.unique(np.linspace(0, len(t), min(buckets, len(t)) + 1).astype(int))[:-1]
    clean = np.nan_to_num(y)
    return t[edges], np.minimum.reduceat(clean, edges), np.maximum.reduceat(clean, edges)


def _window_mark(axes: Axes, window: tuple[float, float]) -> str:
    low, high = float(axes.x(window[0])), float(axes.x(window[1]))
    width = max(high - low, 1.0)
    return f'<rect class="window" x="{low:.1f}" y="{axes.top:g}" width="{width:.1f}" height="{axes.height:g}"/>'


def _largest(curves: Sequence[FloatArray]) -> float:
    values = [float(np.abs(c[np.isfinite(c)]).max()) for c in curves if np.isfinite(c).any()]
    return max(max(values, default=0.0), 1e-30)


def _padded(arrays: Sequence[FloatArray]) -> tuple[float, float]:
    values = np.concatenate([a[np.isfinite(a)] for a in arrays])
    low, high = float(values.min()), float(values.max())
    pad = 0.06 * (high - low) or max(abs(high), 1e-12)
    return low - pad, high + pad


def _thinned(x: FloatArray, y: FloatArray, limit: int) -> tuple[FloatArray, FloatArray]:
    """Every k-th point, so that at most `limit` remain."""
    step = max(1, math.ceil(len(x) / limit))
    return x[::step], y[::step]
