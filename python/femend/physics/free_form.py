"""The free-form competitor: a smooth force over displacement and velocity with a hysteretic surrogate beside it.

Both are laws of the core (`free_form`, `iwan`) and linear in their parameters. The curves are kept smooth by a penalty
on the bend of the splines whose weight is chosen on data left out, so that noise does not become structure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from femend import _core
from femend.physics.entry import Physics

__all__ = ["FreeForm", "fit_free_form", "roughness", "smooth_coordinates"]

Array = NDArray[np.float64]

# knots over displacement and velocity in units of the span, as in the core; at rest the force is zero
_D_AT = np.array([-1.0, -0.7, -0.4, -0.15, 0.0, 0.15, 0.4, 0.7, 1.0])
_V_AT = np.array([-1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0])
_D = tuple(f"fd{i}" for i in range(1, 9))
_V = tuple(f"fv{i}" for i in range(1, 7))
# parameters of the curve over d, of both curves, and of the hysteretic elements with them
_N_D, _N, _ALL = 8, 14, 20
_K = tuple(f"k{i}" for i in range(1, 7))
# weights of the penalty that are tried, as shares of the force's own power; groups of blocks left out in turn
_WEIGHTS = np.logspace(-7, 1, 9)
_BLOCKS = 4


def roughness(physics: Physics) -> Array:
    """Matrix R (n, n) over a law's parameters: p' R p is the bend of its curves, 0 for straight lines.

    The sum of squared changes of slope at the knots times their mean distance, with the force zero at rest; zero rows
    for parameters that are no forces. For a fit that minimises squares plus p' R p times a weight.

    >>> from femend.physics import physics
    >>> line = np.array([-20, -14, -8, -3, 3, 8, 14, 20, 0, 0, 0, 0, 0, 0, 1, 1.0])
    >>> round(float(line @ roughness(physics("free_form")) @ line), 9)
    0.0
    """
    names = physics.parameter_names
    R = np.zeros((len(names), len(names)))
    if physics.law != "free_form":
        return R
    for curve, knots in ((_D, _D_AT), (_V, _V_AT)):
        bend = _bend(knots)
        at = [names.index(name) for name in curve]
        R[np.ix_(at, at)] = bend.T @ bend
    return R


def _bend(at: Array) -> Array:
    """Changes of slope (n - 2, n - 1) at the inner of n knots from the forces beside rest, times the mean distance."""
    slopes = np.diff(np.eye(len(at)), axis=0) / np.diff(at)[:, None]
    return np.asarray(np.delete(np.diff(slopes, axis=0), len(at) // 2, axis=1) * np.diff(at).mean())


def smooth_coordinates(stiff: float) -> Array:
    """Matrix (14, 14) from the forces at the knots to, for each curve, its mean slope and its bends times `stiff`.

    A prior of one size on all coordinates then holds the curves smooth and leaves straight lines alone.
    """
    mix = np.zeros((_N, _N))
    for first, knots in ((0, _D_AT), (_N_D, _V_AT)):
        n = len(knots) - 1
        mix[first, [first, first + n - 1]] = -0.5, 0.5
        mix[first + 1 : first + n, first : first + n] = stiff * _bend(knots)
    return mix


@dataclass(frozen=True, eq=False)
class FreeForm:
    """A free-form force fitted to records.

    Attributes:
        values: parameters of the law `free_form`.
        hysteresis: parameters of the law `iwan` beside it; all stiffnesses zero where it is not needed.
        left: share of the force's power that is left unexplained, on blocks that took no part in the fit.
        parts: power of the elastic curve beyond its straight part, of the straight damping, of the velocity curve
            beyond it, and of the hysteresis, as shares of the force's power.
        weight: weight of the penalty.
    """

    values: dict[str, float]
    hysteresis: dict[str, float]
    left: float
    parts: dict[str, float]
    weight: float

    def force(self, d: Array, v: Array, dt: float) -> Array:
        """Force (n,) along displacements `d` and velocities `v` (n,) at steps of `dt` s."""
        still = np.zeros_like(d)
        smooth = _core.law_force("free_form", self.values, d, v, still, dt)
        return np.asarray(smooth + _core.law_force("iwan", self.hysteresis, d, v, still, dt))


def fit_free_form(
    d: Sequence[Array],
    v: Sequence[Array],
    f: Sequence[Array],
    dt: float,
    *,
    hysteresis: bool = True,
    beside: Sequence[Sequence[Array]] = (),
) -> FreeForm:
    """Fits a free-form force to records of displacement `d`, velocity `v` and force `f` (each (n,)) at steps of `dt` s.

    Spans are the largest displacement and velocity. Without `hysteresis` the surface alone is fitted. `beside` are
    further forces (each records of (n,)) whose sizes are fitted too, not negative, to ask whether they belong there.
    Raises ValueError where there are no records, or no motion.
    """
    if not d or max(float(np.abs(x).max()) for x in d) == 0 or max(float(np.abs(x).max()) for x in v) == 0:
        raise ValueError("there is no motion to fit a force to; give records of displacement, velocity and force")
    spans = {
        "d_span": float(max(np.abs(x).max() for x in d)),
        "v_span": float(max(np.abs(x).max() for x in v)),
    }
    A = np.concatenate([_columns(x, y, dt, spans) for x, y in zip(d, v, strict=True)])
    b = np.concatenate(list(f))
    n_own = _ALL if hysteresis else _N
    more = np.array([np.concatenate(list(column)) for column in beside]).reshape(-1, len(b)).T
    squares = _Squares(np.concatenate([A[:, :n_own], more], axis=1), b, _BLOCKS * len(f))
    scores = [squares.left_out(weight) for weight in _WEIGHTS]
    # of weights that predict as well to a per cent, the smoothest curve
    best = min(scores)
    weight = max(w for w, score in zip(_WEIGHTS, scores, strict=True) if score <= 1.01 * best + 1e-12)
    x = squares.solve(squares.G.sum(axis=0), squares.g.sum(axis=0), weight)
    values = {**dict(zip((*_D, *_V), x[:_N].tolist(), strict=True)), **spans}
    slopes = x[_N:_ALL].tolist() if hysteresis else [0.0] * 6
    elements = {**dict(zip(_K, slopes, strict=True)), "span": spans["d_span"]}
    left = scores[list(_WEIGHTS).index(weight)]
    return FreeForm(values, elements, float(left), _parts(A[:, :n_own], b, x[:n_own]), float(weight))


def _columns(d: Array, v: Array, dt: float, spans: dict[str, float]) -> Array:
    """Unit forces (n, 20) of every parameter along one record."""
    still, columns = np.zeros_like(d), []
    for name in (*_D, *_V):
        unit = {**dict.fromkeys((*_D, *_V), 0.0), name: 1.0, **spans}
        columns.append(_core.law_force("free_form", unit, d, v, still, dt))
    for name in _K:
        unit = {**dict.fromkeys(_K, 0.0), name: 1.0, "span": spans["d_span"]}
        columns.append(_core.law_force("iwan", unit, d, v, still, dt))
    return np.array(columns).T


class _Squares:
    """Squares of a force beside columns, kept by blocks: fourteen spline forces of any sign, then sizes that are not
    negative."""

    def __init__(self, A: Array, b: Array, n_blocks: int) -> None:
        size = np.linalg.norm(A, axis=0)
        self.size = np.where(size > 0, size, 1.0)
        scaled = A / self.size
        blocks = np.array_split(np.arange(len(b)), n_blocks)
        groups = [np.concatenate(blocks[i::_BLOCKS]) for i in range(_BLOCKS)]
        self.G = np.array([scaled[rows].T @ scaled[rows] for rows in groups])
        self.g = np.array([scaled[rows].T @ b[rows] for rows in groups])
        self.power = np.array([b[rows] @ b[rows] for rows in groups])
        # the spline's columns are about equal in size, so that one weight serves both curves
        self.bend = np.zeros((A.shape[1], A.shape[1]))
        for curve, knots in ((slice(0, _N_D), _D_AT), (slice(_N_D, _N), _V_AT)):
            scaled_second = _bend(knots) / self.size[curve] * np.median(self.size[curve])
            self.bend[curve, curve] = scaled_second.T @ scaled_second

    def solve(self, G: Array, g: Array, weight: float) -> Array:
        """Parameters: free ones are eliminated, the others follow by non-negative least squares of what is left."""
        H = G + weight * self.bend + 1e-11 * np.trace(G) / len(G) * np.eye(len(G))
        F, N = H[:_N, :_N], H[_N:, _N:]
        x = np.zeros(len(G))
        if N.size:
            across = np.linalg.solve(F, H[:_N, _N:])
            S, c = N - H[_N:, :_N] @ across, g[_N:] - across.T @ g[:_N]
            L = np.linalg.cholesky(S + 1e-12 * np.trace(S) * np.eye(len(S)))
            x[_N:] = nnls(L.T, np.linalg.solve(L, c))[0]
        x[:_N] = np.linalg.solve(F, g[:_N] - H[:_N, _N:] @ x[_N:])
        return np.asarray(x / self.size)

    def left_out(self, weight: float) -> float:
        """Share of the force's power that is left on groups of blocks, each predicted from the others."""
        left = 0.0
        for i in range(_BLOCKS):
            x = self.solve(self.G.sum(axis=0) - self.G[i], self.g.sum(axis=0) - self.g[i], weight) * self.size
            left += max(float(self.power[i] - 2 * x @ self.g[i] + x @ self.G[i] @ x), 0.0)
        return left / max(float(self.power.sum()), 1e-300)


def _beside(at: Array) -> Array:
    """A straight line at the knots beside rest."""
    return np.delete(at, len(at) // 2)


def _parts(A: Array, b: Array, x: Array) -> dict[str, float]:
    power = max(float(b @ b), 1e-300)
    elastic, viscous = A[:, :_N_D] @ x[:_N_D], A[:, _N_D:_N] @ x[_N_D:_N]
    line_d, line_v = A[:, :_N_D] @ _beside(_D_AT), A[:, _N_D:_N] @ _beside(_V_AT)

    def beyond(curve: Array, line: Array) -> Array:
        return curve - line * float(curve @ line) / max(float(line @ line), 1e-300)

    straight = viscous - beyond(viscous, line_v)
    hysteresis = A[:, _N:] @ x[_N:]
    return {
        "elastic beyond straight": float((beyond(elastic, line_d) ** 2).sum()) / power,
        "straight damping": float((straight**2).sum()) / power,
        "damping beyond straight": float((beyond(viscous, line_v) ** 2).sum()) / power,
        "hysteresis": float((beyond(hysteresis, line_d) ** 2).sum()) / power if A.shape[1] > _N else 0.0,
    }
