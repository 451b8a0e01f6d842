"""Residuals of a run: measured accelerations against those of unbalances that follow the tacho."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.estimate.joint.receptance import receptance
from femend.estimate.joint.rotor import DELAY, Run, Unbalance
from femend.estimate.joint.turning import turning_motion
from femend.model.terms.configured import ConfiguredModel

__all__ = ["RunBlock", "simulate_run"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class RunBlock:
    """Accelerations `y` (n_out, n) with standard deviations `sd` (n_out, n) at the samples of `run`.

    `out` (n_out, r) and `bearings` (n_bearings, 3, r) are rows of the basis. What the model says is computed up to
    `f_max` Hz: y must hold nothing above. The response is exact for a force that is band-limited: the courses' spectra
    times the accelerance, transformed back; no order is assumed to be stationary. Squares count `weight` each.
    """

    name: str
    model: ConfiguredModel
    run: Run
    y: FloatArray
    sd: FloatArray
    out: FloatArray
    bearings: FloatArray
    unbalance: Unbalance
    f_max: float
    weight: float = 1.0

    @property
    def n_values(self) -> float:
        """Independent real values."""
        return self.weight * self.y.size

    def gauss_newton(self, p: FloatArray, derivatives: bool) -> tuple[float, FloatArray, FloatArray]:
        """Sum of squares, J'r (n,) and J'J (n, n) at `p` (n,); zeros in place of the last two without `derivatives`."""
        n = len(p)
        u = self.model.unknowns
        at = [u.index(name) for name in self.unbalance.names]
        size = np.array([u.items[i].scale for i in at])
        pattern = self.unbalance.pattern(self.bearings) * size[:, None, None]
        lines = self._lines()
        speed = self.unbalance.speed(self.run.freq[lines])
        solved = receptance(self.model, p, 2j * np.pi * self.run.freq[lines], speed)
        late = u.index(DELAY)
        tau = u.items[late].scale * p[late]
        s_lines = 2j * np.pi * self.run.freq[lines]
        F = self.run.F[lines] * np.exp(-tau * s_lines)[:, None]
        loads = np.einsum("kc,ucr->kru", F, pattern)
        x = solved.X @ loads  # (K, r, n_u)
        total_x = turning_motion(self.model, p, self.run, self.unbalance.sense, solved, loads @ p[at])
        accelerance = self.out @ solved.X * (solved.s**2)[:, None, None]  # (K, n_out, r)
        Y = self.out @ (total_x * (solved.s**2)[:, None]).T
        factor = np.sqrt(self.weight) / self.sd
        r = ((self.run.back(self._whole(Y)) - self.y) * factor).ravel()
        total = float(r @ r)
        if not derivatives:
            return total, np.zeros(n), np.zeros((n, n))
        index, dK, dM, dC = self.model.derivatives(p)
        s, left = solved.s[:, None], total_x
        forced = [-(left @ k.T + s * (left @ c.T) + s**2 * (left @ m.T)) for k, m, c in zip(dK, dM, dC, strict=True)]
        for i, weight, A in self.model.turning_changes(p, solved.s, speed):
            forced[int(np.searchsorted(index, i))] -= weight[:, None] * (left @ A.T)
        # a force on the basis for every unknown of the structure, then the motion for every unbalance
        dY = np.concatenate(
            [accelerance @ np.stack(forced, axis=2), (self.out @ x) * (solved.s**2)[:, None, None]], axis=2
        )
        dY_late = -u.items[late].scale * s_lines[:, None] * Y.T
        dY = np.concatenate([dY, dY_late[:, :, None]], axis=2)
        J = self.run.back(self._whole(dY.transpose(2, 1, 0))) * factor
        J = J.reshape(len(index) + len(at) + 1, -1)
        where = np.concatenate([index, np.array([*at, late], dtype=np.int64)])
        gradient, A = np.zeros(n), np.zeros((n, n))
        gradient[where] = J @ r
        A[np.ix_(where, where)] = J @ J.T
        return total, gradient, A

    def _lines(self) -> slice:
        return slice(0, int(np.searchsorted(self.run.freq, self.f_max, "right")))

    def _whole(self, Y: ComplexArray) -> ComplexArray:
        return np.pad(Y, [(0, 0)] * (Y.ndim - 1) + [(0, len(self.run.freq) - Y.shape[-1])])


def simulate_run(
    model: ConfiguredModel,
    p: FloatArray,
    run: Run,
    unbalance: Unbalance,
    out: FloatArray,
    bearings: FloatArray,
    order: int = 2,
) -> FloatArray:
    """Accelerations (n_out, n), or another derivative of the displacements by its `order`, over a run at the unknowns
    `p` (n,), those of the unbalance and the delay among them.

    `out` (n_out, r) and `bearings` (n_bearings, 3, r) are rows of the basis.
    """
    u = model.unknowns
    values = u.values(p)
    m_r = np.array([values[u.index(name)] for name in unbalance.names])
    s = 2j * np.pi * run.freq
    F = run.F * np.exp(-s * values[u.index(DELAY)])[:, None]
    loads = F @ np.tensordot(m_r, unbalance.pattern(bearings), 1)
    solved = receptance(model, p, s, unbalance.speed(run.freq))
    x = turning_motion(model, p, run, unbalance.sense, solved, loads)
    return run.back(np.asarray(((x * (s**order)[:, None]) @ out.T).T, dtype=np.complex128))
