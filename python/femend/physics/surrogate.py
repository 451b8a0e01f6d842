"""A force without a name for a closed loop: smooth curves, loops and damping that depends on displacement, as one.

The curves are the core's `free_form`, the loops its `iwan`. A sum of a curve over d and one over v cannot say that
damping depends on displacement; the products of powers of |d| with odd functions of v that are missing are a law
recorded here and kept out of the catalogue.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from femend import _core
from femend.physics.catalogue import physics
from femend.physics.free_form import smooth_coordinates
from femend.physics.tracing import record

__all__ = ["PARTS", "Surrogate", "surrogate_start"]

Array = NDArray[np.float64]

# what can stand beside the curves: nothing, hysteresis, or damping that depends on displacement
PARTS = ("", "iwan", "cross")

_CURVES = physics("free_form").parameter_names[:14]
_SPANS = ("d_span", "v_span")
_LOOPS = tuple(f"k{i}" for i in range(1, 7))
_CROSS = tuple(f"x{i}" for i in range(1, 7))
_CROSS_LAW = "free-form damping over displacement"
# bends of the curves count so many times as much as their slopes; places of the slopes among their coordinates
_STIFF, _SLOPES = 10.0, (0, 8)
# prior standard deviations of slopes, bends and products in units of the force, of the logarithms of the loops
_SLOPE_SD, _BEND_SD, _CROSS_SD, _LOOP_SD = 3.0, 3.0, 1.0, 3.0
# speed, in units of the span, at which rubbing has turned round; smallest loop, as a share of the secant stiffness
_RUB, _LEAST = 0.03, 0.01
# standard deviation of the force that start values are fitted to, as a share of its rms
_LEFT = 0.03


@cache
def _cross_law() -> str:
    """Makes the law of the products known to the core: (|d|, d^2) x (v, v |v|, rubbing), in units of the spans."""

    def force(d: Any, v: Any, *p: Any) -> list[Any]:
        x, y = abs(d) / p[6], v / p[7]
        over_v = (y, y * abs(y), np.tanh(y / _RUB))
        first = p[0] * over_v[0] + p[1] * over_v[1] + p[2] * over_v[2]
        second = p[3] * over_v[0] + p[4] * over_v[1] + p[5] * over_v[2]
        return [x * (first + x * second)]

    names = [(name, "N", "real") for name in _CROSS] + [("d_span", "m", "positive"), ("v_span", "m/s", "positive")]
    _core.register_law(_CROSS_LAW, names, 0, recorded=record(force, 10))
    return _CROSS_LAW


class Surrogate:
    """Fit coordinates of a free-form force, as `FitCoordinates` are of a law.

    Slopes and bends of the curves in units of the force (the bends stiffer, so that a prior of one size keeps the
    curves smooth), logarithms of the loops' stiffnesses, the products in units of the force. `part` is one of `PARTS`.
    """

    def __init__(self, values: Mapping[str, float], part: str, force: float) -> None:
        self.physics = physics("free_form")
        self.values = dict(values)
        self.part = part
        self._back = np.linalg.inv(smooth_coordinates(_STIFF) / force)
        self._force = force
        self.beside = {"": (), "iwan": _LOOPS, "cross": _CROSS}[part]
        self.free = (*_CURVES, *self.beside)

    def start(self) -> Array:
        """Coordinates (n_free,) of the values this map was made with."""
        curves = np.linalg.solve(self._back, [self.values[name] for name in _CURVES])
        beside = np.array([self.values[name] for name in self.beside])
        return np.concatenate([curves, np.log(beside) if self.part == "iwan" else beside / self._force])

    def parameters(self, x: Array) -> dict[str, float]:
        """Parameter values of all parts at coordinates `x` (n_free,)."""
        n = len(_CURVES)
        beside = np.exp(x[n:]) if self.part == "iwan" else x[n:] * self._force
        moved = zip(self.free, [*(self._back @ x[:n]).tolist(), *beside.tolist()], strict=True)
        return {**self.values, **dict(moved)}

    def prior(self) -> tuple[Array, Array]:
        """Mean and standard deviation (n_free,) of the coordinates: straight lines as they start, no bends, no
        products, loops as they start."""
        mean, sd = self.start(), np.full(len(self.free), _BEND_SD)
        n = len(_CURVES)
        bends = [i for i in range(n) if i not in _SLOPES]
        mean[bends] = 0.0
        sd[list(_SLOPES)] = _SLOPE_SD
        sd[n:] = _LOOP_SD if self.part == "iwan" else _CROSS_SD
        if self.part == "cross":
            mean[n:] = 0.0
        return mean, sd

    def composite(self, values: Mapping[str, float]) -> list[tuple[str, dict[str, float]]]:
        """The laws whose sum the force is, as the core takes them."""
        spans = {name: values[name] for name in _SPANS}
        laws = [("free_form", {**{name: values[name] for name in _CURVES}, **spans})]
        if self.part == "iwan":
            laws.append(("iwan", {**{name: values[name] for name in _LOOPS}, "span": spans["d_span"]}))
        elif self.part == "cross":
            laws.append((_cross_law(), {**{name: values[name] for name in _CROSS}, **spans}))
        return laws


def surrogate_start(
    d: Sequence[Array], v: Sequence[Array], f: Sequence[Array], dt: Sequence[float], part: str
) -> Surrogate | None:
    """A free-form force with the `part` beside its curves, fitted to records of displacement `d`, velocity `v` and
    force `f` (each (n,)) at steps of `dt` s; None where nothing moves.

    Least squares with the prior of the coordinates, the loops not negative.
    """
    spans = (max(float(np.abs(x).max()) for x in d), max(float(np.abs(x).max()) for x in v))
    force = max(float(np.abs(x).max()) for x in f)
    if not (np.isfinite([*spans, force]).all() and min(*spans, force) > 0):
        return None
    fixed = dict(zip(_SPANS, spans, strict=True))
    blank = Surrogate({**dict.fromkeys((*_CURVES, *_LOOPS, *_CROSS), 0.0), **fixed}, part, force)
    columns = []
    for name in blank.free:
        one = {**blank.values, name: 1.0}
        laws = [law for law in blank.composite(one) if name in law[1]]
        columns.append(np.concatenate([_force(laws, x, y, step) for x, y, step in zip(d, v, dt, strict=True)]))
    n = len(_CURVES)
    A, b = np.array(columns).T, np.concatenate(list(f))
    scale = force / spans[0] if part == "iwan" else force
    A[:, :n] = A[:, :n] @ blank._back
    A[:, n:] *= scale
    weight = 1 / (_LEFT * max(float(np.sqrt(np.mean(b**2))), 1e-300) * np.sqrt(len(b) / 100))
    sd = np.full(len(blank.free), _BEND_SD)
    sd[list(_SLOPES)] = 1e3
    sd[n:] = _CROSS_SD
    low = np.full(len(sd), -np.inf)
    low[n:] = 0.0 if part == "iwan" else -np.inf
    rows, right = np.vstack([A * weight, np.diag(1 / sd)]), np.concatenate([b * weight, np.zeros(len(sd))])
    # the normal equations' factor does as well as thousands of rows
    q, r = np.linalg.qr(rows)
    x = lsq_linear(r, q.T @ right, (low, np.full(len(sd), np.inf))).x
    values = dict(zip(_CURVES, (blank._back @ x[:n]).tolist(), strict=True))
    beside = x[n:] * scale
    if part == "iwan":
        beside = np.maximum(beside, _LEAST * scale)
    values.update(zip(blank.beside, beside.tolist(), strict=True))
    return Surrogate({**values, **fixed}, part, force)


def _force(laws: Sequence[tuple[str, dict[str, float]]], d: Array, v: Array, dt: float) -> Array:
    still = np.zeros_like(d)
    return np.asarray(sum(_core.law_force(name, values, d, v, still, dt) for name, values in laws))
