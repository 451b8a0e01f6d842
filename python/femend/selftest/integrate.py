"""Time integration of the truth: two-stage Gauss collocation on complex modal coordinates.

Every mode q'' + 2 zeta w q' + w^2 q = p is one complex equation x' = lambda x + p with x = q' - conj(lambda) q. The
method is implicit, of order four and A-stable (Hairer and Wanner, Solving ODEs II, section IV.5, table 5.1); Newton
finds the two stage forces of a law. Neither the method nor the law's form is the diagnosis's own, which steps modes
exactly under forces that are linear over a substep.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import ConvergenceError
from femend.numerals import plain
from femend.selftest.laws import Friction, Law

__all__ = ["ModalTruth", "integrate"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_R = np.sqrt(3.0) / 6.0
_A = np.array([[0.25, 0.25 - _R], [0.25 + _R, 0.25]])
_C = np.array([0.5 - _R, 0.5 + _R])
_ITERATIONS = 40
_A00, _A01, _A10, _A11 = (float(a) for a in _A.ravel())
# largest residual of a stage's force, as a share of the largest force so far
_TOLERANCE, _FAILED = 1e-9, 1e-3


@dataclass(frozen=True, eq=False)
class ModalTruth:
    """A structure in modal coordinates: omega (r,) rad/s, zeta (r,), shapes of inputs (n_in, r), outputs (n_out, r) and
    of the law's coordinate (r,); `order` (n_out,) is 0, 1 or 2 for displacement, velocity, acceleration."""

    omega: FloatArray
    zeta: FloatArray
    inputs: FloatArray
    outputs: FloatArray
    order: NDArray[np.int64]
    law: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class _Tables:
    """Per mode: R (r,) next state from state, Q (2, r) from the stage forces; S (2, r), T (2, 2, r) for the stages."""

    R: ComplexArray
    Q: ComplexArray
    S: ComplexArray
    T: ComplexArray


def _tables(lam: ComplexArray, h: float) -> _Tables:
    G = np.linalg.inv(np.eye(2) - h * lam[:, None, None] * _A)  # (r, 2, 2)
    slope_x = lam[:, None] * G.sum(axis=2)
    R = 1 + 0.5 * h * slope_x.sum(axis=1)
    Q = 0.5 * h * G.sum(axis=1)
    S = 1 + h * slope_x @ _A.T
    T = h * np.einsum("ij,rjk->rik", _A, G)
    return _Tables(R, Q.T.copy(), S.T.copy(), np.moveaxis(T, 0, 2).copy())


def integrate(truth: ModalTruth, u: FloatArray, dt: float, over: int, law: Law | None = None) -> FloatArray:
    """Responses (n_out, n) from rest to forces u (n_in, n) sampled at dt, in `over` steps a sample.

    Forces between the samples are band-limited; responses are sampled without a filter. Raises ConvergenceError where
    the law's implicit equations are not solved or the motion grows without limit.
    """
    from scipy.fft import next_fast_len
    from scipy.interpolate import CubicSpline
    from scipy.signal import lfilter, resample

    n = u.shape[1]
    h = dt / over
    lam = -truth.zeta * truth.omega + 1j * truth.omega * np.sqrt(1 - truth.zeta**2)
    tables = _tables(lam, h)
    # zeros behind the record keep its end from reaching round to its beginning
    padded = np.pad(u, ((0, 0), (0, next_fast_len(2 * n) - n)))
    fine = resample(padded, padded.shape[1] * over, axis=1)[:, : (n + 1) * over]
    spline = CubicSpline(h * np.arange(fine.shape[1]), fine, axis=1)
    times = h * np.arange(n * over)
    stages = [spline(times + c * h) for c in _C]  # (n_in, steps) each
    samples = np.arange(n) * over
    # motion at the samples, and at the stages of the law's coordinate, without the law
    at = np.empty((len(lam), n), dtype=np.complex128)
    free = np.zeros((4, n * over))
    rows = _law_rows(truth, lam) if truth.law is not None else None
    for r in range(len(lam)):
        p0, p1 = (truth.inputs[:, r] @ s for s in stages)
        drive = tables.Q[0, r] * p0 + tables.Q[1, r] * p1
        x = lfilter([0.0, 1.0], [1.0, -tables.R[r]], drive)
        at[r] = x[samples]
        if rows is not None and law is not None:
            for s in range(2):
                stage = tables.S[s, r] * x + tables.T[s, 0, r] * p0 + tables.T[s, 1, r] * p1
                free[s] += (rows[0, r] * stage).real
                free[2 + s] += (rows[1, r] * stage).real
    force = np.zeros(n)
    if law is not None and rows is not None and truth.law is not None:
        more, force = _march(law, tables, rows, truth.law, free, at, samples, h, over)
        at += more
    return _outputs(truth, lam, at, u, force)


def _law_rows(truth: ModalTruth, lam: ComplexArray) -> ComplexArray:
    """Rows (2, r) that give displacement and velocity of the law's coordinate as real parts."""
    assert truth.law is not None
    q = -1j / lam.imag  # q = Im(x) / w_d
    return np.array([truth.law * q, truth.law * (1 + lam.real * q)])


def _outputs(truth: ModalTruth, lam: ComplexArray, x: ComplexArray, u: FloatArray, force: FloatArray) -> FloatArray:
    q = x.imag / lam.imag[:, None]
    v = x.real + lam.real[:, None] * q
    p = truth.inputs.T @ u
    if truth.law is not None:
        p = p + truth.law[:, None] * force
    a = p - (2 * truth.zeta * truth.omega)[:, None] * v - (truth.omega**2)[:, None] * q
    kinds = (q, v, a)
    return np.array([row @ kinds[order] for row, order in zip(truth.outputs, truth.order.tolist(), strict=True)])


def _march(
    law: Law, tables: _Tables, rows: ComplexArray, shape: FloatArray, free: FloatArray, at: ComplexArray,
    samples: NDArray[np.int64], h: float, over: int,
) -> tuple[ComplexArray, FloatArray]:  # fmt: skip
    """Modal states (r, n) at the samples that the law's force makes, and that force (n,)."""
    stage_rows = np.array([rows[k] * tables.S[s] for k in range(2) for s in range(2)])  # d0 d1 v0 v1
    gain = np.array(
        [[(rows[k] * tables.T[s, t] * shape).sum().real for t in range(2)] for k in range(2) for s in range(2)]
    )
    Q, R = tables.Q * shape, tables.R
    x = np.zeros(len(R), dtype=np.complex128)
    states = np.zeros((len(R), len(samples)), dtype=np.complex128)
    force = np.zeros(len(samples))
    z: tuple[float, ...] = (0.0,) * law.n_states
    stepper = _Stepper(law, gain.tolist(), h)
    d = 0.0
    for j in range(len(samples)):
        states[:, j] = x
        both = rows @ (x + at[:, j])
        d, v = float(both[0].real), float(both[1].real)
        force[j] = law.force(d, v, z)[0]
        if not np.isfinite(force[j]):
            raise ConvergenceError(f"the truth grows without limit at sample {j}; draw it again")
        for step in range(j * over, (j + 1) * over):
            known = ((stage_rows @ x).real + free[:, step]).tolist()
            f0, f1, z, d = stepper.step(known, z, d)
            x = R * x + Q[0] * f0 + Q[1] * f1
    if stepper.worst > _FAILED:
        raise ConvergenceError(f"the truth's law left {plain(stepper.worst, 2)} of its force unsolved; draw it again")
    return states, force


class _Stepper:
    """Newton for the two stage forces of a law in one step; remembers the worst residual."""

    def __init__(self, law: Law, gain: list[list[float]], h: float) -> None:
        self.law, self.gain, self.h = law, gain, h
        self.F = [0.0, 0.0]
        self.scale = 0.0
        self.worst = 0.0
        self.through = 0.25 * h * law.state_tangent()

    def step(self, known: list[float], z: Any, d0: float) -> tuple[float, float, tuple[float, ...], float]:
        """Stage forces, states and (for friction) the coordinate's displacement at the end of the step."""
        g, law, through = self.gain, self.law, self.through
        F0, F1 = self.F
        zs = [z, z]
        rates: list[Any] = [(), ()]
        left = 0.0
        for iteration in range(_ITERATIONS):
            d = [known[i] + g[i][0] * F0 + g[i][1] * F1 for i in range(2)]
            v = [known[2 + i] + g[2 + i][0] * F0 + g[2 + i][1] * F1 for i in range(2)]
            zs, rates = self._states(d, v, z, zs, d0)
            f0, a0, b0 = law.force(d[0], v[0], zs[0])
            f1, a1, b1 = law.force(d[1], v[1], zs[1])
            b0, b1 = b0 + through, b1 + through
            r0, r1 = f0 - F0, f1 - F1
            self.scale = max(self.scale, abs(f0), abs(f1))
            left = max(abs(r0), abs(r1)) / (self.scale + 1e-300)
            if left < _TOLERANCE:
                break
            j00, j01 = 1 - a0 * g[0][0] - b0 * g[2][0], -a0 * g[0][1] - b0 * g[2][1]
            j10, j11 = -a1 * g[1][0] - b1 * g[3][0], 1 - a1 * g[1][1] - b1 * g[3][1]
            det = j00 * j11 - j01 * j10
            relax = 1.0 if iteration < 15 else 0.4
            F0 += relax * (j11 * r0 - j01 * r1) / det
            F1 += relax * (j00 * r1 - j10 * r0) / det
        self.worst = max(self.worst, left)
        self.F = [F0, F1]
        return F0, F1, *self._end(z, zs, rates, d0, d)

    def _states(self, d: list[float], v: list[float], z: Any, zs: list[Any], d0: float) -> tuple[list[Any], list[Any]]:
        """States at the stages: a return map for friction, else one sweep of the Gauss equations."""
        law, h = self.law, self.h
        if isinstance(law, Friction):
            return [(law.slipped(z[0], d[0] - d0),), (law.slipped(z[0], d[1] - d0),)], [(), ()]
        if not z:
            return zs, [(), ()]
        k0, k1 = law.rates(d[0], v[0], zs[0]), law.rates(d[1], v[1], zs[1])
        first = tuple(s + h * (_A00 * p + _A01 * q) for s, p, q in zip(z, k0, k1))
        return [first, tuple(s + h * (_A10 * p + _A11 * q) for s, p, q in zip(z, k0, k1))], [k0, k1]

    def _end(
        self, z: Any, zs: list[Any], rates: list[Any], d0: float, d: list[float]
    ) -> tuple[tuple[float, ...], float]:
        """States and displacement at the end of the step."""
        if isinstance(self.law, Friction):
            # the coordinate at the end, by the parabola through start and stages
            c0, c1 = float(_C[0]), float(_C[1])
            end = (
                d0 * (1 - c0) * (1 - c1) / (c0 * c1)
                + d[0] * (1 - c1) / (c0 * (c0 - c1))
                + d[1] * (1 - c0) / (c1 * (c1 - c0))
            )
            return (self.law.slipped(zs[1][0], end - d[1]),), end
        if not z:
            return (), d0
        return tuple(s + 0.5 * self.h * (p + q) for s, p, q in zip(z, rates[0], rates[1])), d0
