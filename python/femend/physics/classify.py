"""What can be said of a joint whose law has no name: the class of a free-form force, from its curves and its rivals.

Classes are read off a force fitted without a law (`fit_free_form`): each is a comparison of two fits of the same
record, on blocks that took no part, or a ratio of slopes; none needs the law to be in the catalogue.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.physics.free_form import FreeForm, fit_free_form
from femend.physics.nested_extended import IWAN_GRID

__all__ = ["CLASSES", "Classified", "classify"]

Array = NDArray[np.float64]

CLASSES = (
    "hardening", "softening", "saturating", "contact-like", "asymmetric", "dissipative growing with level",
    "dissipative growing with displacement", "friction-like", "hysteretic", "relaxing",
)  # fmt: skip

# a part of the force counts when it holds this share of its power (3 % of its rms), and this share of what is left
_COUNTS, _ABOVE_LEFT = 1e-3, 0.3
# a rival description wins where it leaves less than this share of what the other leaves
_WINS = 0.6
# change of slope from the inner to the outer part of the motion, in units of the mean slope
_SLOPE = 0.2
# share of the even part in the bend of the curve: above, it is asymmetric; above, nothing but that
_ASYMMETRIC, _EVEN = 0.3, 0.99
# ratio of outer to inner slope below which a softening spring is called saturating
_SATURATES = 0.45
# shares of the motion at which a saturating spring is tried
_REACH = (0.03, 0.1, 0.3, 1.0)
# power law of the damping force over velocity: above, it grows with level; below, it is like friction
_GROWS, _RUBS = 1.3, 0.6
# yield displacement, as a share of the motion, below which hysteresis is called friction
_STIFF = 0.15


@dataclass(frozen=True)
class Classified:
    """The class of a joint's force: `labels` out of CLASSES, the figures they rest on, and the fit."""

    labels: tuple[str, ...]
    figures: dict[str, float]
    fit: FreeForm


def classify(d: Sequence[Array], v: Sequence[Array], f: Sequence[Array], dt: float) -> Classified:
    """Classes of the force `f` along displacements `d` and velocities `v` (records of (n,) each, steps of `dt` s).

    A force that is a straight line over d and v has no class. Raises ValueError where there is no motion.

    >>> t = np.arange(2000) * 1e-3
    >>> d, v = np.sin(7 * t) + 0.5 * np.sin(23 * t), 7 * np.cos(7 * t) + 11.5 * np.cos(23 * t)
    >>> classify([d], [v], [4 * d + 3 * d**3], 1e-3).labels
    ('hardening',)
    """
    smooth = fit_free_form(d, v, f, dt, hysteresis=False)
    loops = fit_free_form(d, v, f, dt)
    grown = fit_free_form(d, v, f, dt, hysteresis=False, beside=[[x**2 * y for x, y in zip(d, v, strict=True)]])
    bent = grown.left
    relaxed = fit_free_form(d, v, f, dt, hysteresis=False, beside=_branches(d, v, dt)).left
    figures = {
        "left by the surface": smooth.left,
        "left with hysteresis": loops.left,
        "left with v d^2": bent,
        "left with relaxation": relaxed,
    }
    hysteretic = (
        loops.left < _WINS * smooth.left and smooth.left - loops.left > _COUNTS and loops.left <= min(bent, relaxed)
    )
    growing = not hysteretic and bent < _WINS * smooth.left and smooth.left - bent > _COUNTS and bent <= relaxed
    relaxing = not (hysteretic or growing) and relaxed < _WINS * smooth.left and smooth.left - relaxed > _COUNTS
    fit = loops if hysteretic else grown if growing else smooth
    labels: list[str] = []
    floor = max(_COUNTS, _ABOVE_LEFT * fit.left)
    if fit.parts["elastic beyond straight"] > floor:
        labels += _elastic(fit, d, v, f, dt, figures)
    if growing:
        labels.append("dissipative growing with displacement")
    elif fit.parts["damping beyond straight"] > max(floor, 0.1 * fit.parts["hysteresis"]):
        labels += _viscous(fit, figures)
    if hysteretic:
        labels.append(_loop(fit, figures))
    if relaxing:
        labels.append("relaxing")
    return Classified(tuple(dict.fromkeys(labels)), figures, fit)


def _branches(d: Sequence[Array], v: Sequence[Array], dt: float) -> list[list[Array]]:
    """Forces of Maxwell branches that relax at a third of, at and at three times the motion's own rate."""
    rate = float(np.sqrt(sum((y**2).sum() for y in v) / sum((x**2).sum() for x in d)))
    unit = {"k0": 0.0, "k1": 1.0}
    return [
        [_core.law_force("viscoelastic", {**unit, "tau": tau}, x, y, np.zeros_like(x), dt) for x, y in zip(d, v)]
        for tau in (1 / (3 * rate), 1 / rate, 3 / rate)
    ]


def _elastic(
    fit: FreeForm, d: Sequence[Array], v: Sequence[Array], f: Sequence[Array], dt: float, figures: dict[str, float]
) -> list[str]:
    """Classes of the curve over displacement."""
    span = fit.values["d_span"]
    x = np.linspace(-1, 1, 121) * span
    still = np.zeros_like(x)
    curve = _core.law_force("free_form", {**fit.values, **{f"fv{i}": 0.0 for i in range(1, 7)}}, x, still, still, 1.0)
    odd, even = 0.5 * (curve - curve[::-1]), 0.5 * (curve + curve[::-1])
    line = x * float(x @ odd) / float(x @ x)
    bend = odd - line
    asymmetry = float(even @ even) / max(float(even @ even + bend @ bend), 1e-300)
    slope = np.gradient(odd, x)
    inner, outer = float(slope[np.abs(x) < span / 4].mean()), float(slope[np.abs(x) > 0.7 * span].mean())
    mean = max(float(np.abs(slope).mean()), 1e-300)
    figures.update({"asymmetry": asymmetry, "inner slope": inner, "outer slope": outer})
    labels = []
    if asymmetry > _EVEN:
        pass  # what is left of the odd part is noise
    elif (outer - inner) / mean > _SLOPE:
        labels.append("hardening")
    elif (inner - outer) / mean > _SLOPE:
        labels.append("softening")
    x, rest, power = _elastic_part(fit, d, v, f, dt)
    saturates = min(_left(np.array([x, x / (1 + np.abs(x) / c)]).T, rest) for c in _REACH)
    if "softening" in labels and outer < _SATURATES * inner and saturates < _left(np.array([x, x**3]).T, rest):
        labels = ["saturating"]
    smooth, kinked = _left(np.array([x, x**2, x**3, x**5]).T, rest) / power, _contact(x, rest) / power
    figures.update({"left by a polynomial": smooth, "left by a contact": kinked})
    if kinked < _WINS * smooth and smooth - kinked > 0.25 * _COUNTS:
        labels = [label for label in labels if label == "hardening"]
        labels.append("contact-like")
    if asymmetry > _ASYMMETRIC:
        labels.append("asymmetric")
    return labels


def _elastic_part(
    fit: FreeForm, d: Sequence[Array], v: Sequence[Array], f: Sequence[Array], dt: float
) -> tuple[Array, Array, float]:
    """Displacement in units of the span, the force less its damping and hysteresis, and the power of the whole."""
    rest, power = [], 0.0
    flat = {**fit.values, **{f"fd{i}": 0.0 for i in range(1, 9)}}
    for a, b, y in zip(d, v, f, strict=True):
        other = _core.law_force("free_form", flat, a, b, np.zeros_like(a), dt)
        rest.append(y - other - _core.law_force("iwan", fit.hysteresis, a, b, np.zeros_like(a), dt))
        power += float(y @ y)
    return np.concatenate(list(d)) / fit.values["d_span"], np.concatenate(rest), max(power, 1e-300)


def _contact(x: Array, b: Array) -> float:
    """Squares that a spring and the best contact leave: after a gap on one side or both, or one that opens."""
    found = []
    for gap in np.linspace(0.0, 0.85, 18):
        above, below = np.maximum(x - gap, 0.0), np.minimum(x + gap, 0.0)
        opening = np.maximum(x + gap, 0.0) - gap, np.minimum(x - gap, 0.0) + gap
        found += [_left(np.array([x, c]).T, b, positive=True) for c in (above, below, above + below, *opening)]
    return min(found)


def _left(A: Array, b: Array, *, positive: bool = False) -> float:
    x = np.linalg.lstsq(A, b, rcond=None)[0]
    if positive and x[-1] <= 0:  # a contact pushes back
        return float("inf")
    e = b - A @ x
    return float(e @ e)


def _viscous(fit: FreeForm, figures: dict[str, float]) -> list[str]:
    """Classes of the curve over velocity, by the power law that follows it best."""
    y = np.linspace(-1, 1, 121)
    still = np.zeros_like(y)
    flat = {**fit.values, **{f"fd{i}": 0.0 for i in range(1, 9)}}
    curve = _core.law_force("free_form", flat, still, y * fit.values["v_span"], still, 1.0)
    odd = 0.5 * (curve - curve[::-1])
    powers = np.linspace(0.0, 3.0, 31)
    left = [_left((np.sign(y) * np.abs(y) ** p)[:, None], odd) for p in powers]
    power = float(powers[int(np.argmin(left))])
    figures["power of velocity"] = power
    if power > _GROWS:
        return ["dissipative growing with level"]
    return ["friction-like"] if power < _RUBS else []


def _loop(fit: FreeForm, figures: dict[str, float]) -> str:
    """Friction where most of the loop's force slips early in the motion, else hysteresis."""
    forces = np.array([fit.hysteresis[f"k{i + 1}"] * share for i, share in enumerate(IWAN_GRID)])
    held = forces[:-1].sum()
    yields = float((forces[:-1] * IWAN_GRID[:-1]).sum() / held) if held > 0 else 1.0
    figures["yield displacement over motion"] = yields
    return "friction-like" if yields < _STIFF else "hysteretic"
