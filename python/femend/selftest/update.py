"""What an update could absorb of an effect: a regularised fit of the model's own unknowns to the change it makes.

The unknowns are the user's parameters with their priors and, for every mode in the band, a frequency factor (0.5 %) and
a damping ratio (50 %). What remains is what could tell the effect from a better model.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from femend.selftest.integrate import ModalTruth, integrate
from femend.selftest.plan import Plan, Replay
from femend.selftest.truth import Drawn, Truth, channels

__all__ = ["Update"]

FloatArray = NDArray[np.float64]
ByOrder = dict[int, FloatArray]
# frequencies of the structure and, with the modes' factors, of the response; dampings; shapes; modal motions
State = tuple[FloatArray, FloatArray, FloatArray, FloatArray, ByOrder]

FREQUENCY, DAMPING = 0.005, 0.5  # prior deviations of logarithms
TEMPER = 10.0  # neighbouring samples carry the same errors of form: their squares count for a tenth
FADES = (0.1, 0.03)  # decay, times the lowest mode's frequency, of the windows that lead the fit in
STEP = 1e-4


class Update:
    """A truth without effect in the modes of its band, replayed once in `over` steps a sample."""

    def __init__(self, plan: Plan, drawn: Drawn, truth: Truth, replay: Replay, over: int) -> None:
        self.replay, self.over = replay, over
        top = 2 * np.pi * plan.band[1]
        m = max(1, int((truth.omega < 1.6 * top).sum()))
        self.omega, self.zeta, phi = truth.omega[:m], truth.zeta[:m], truth.phi[:, :m]
        self.inputs, self.outputs = (x[:, :m] for x in channels(plan, truth, replay))
        K, M = plan.model.matrices(drawn.factors)
        self.parts: list[tuple[FloatArray, FloatArray]] = []
        for p in plan.model.parameters:
            k, q = plan.model.matrices({**drawn.factors, p.name: 1.01 * drawn.factors[p.name]})
            self.parts.append((phi.T @ ((k - K) @ phi) / 0.01, phi.T @ ((q - M) @ phi) / 0.01))
        self.free = np.flatnonzero(self.omega < 1.2 * top)
        own = [p.prior_sd for p in plan.model.parameters]
        self.sd = np.array(own + [FREQUENCY] * len(self.free) + [DAMPING] * len(self.free))
        self.weight = np.repeat(1 / (replay.noise * np.sqrt(TEMPER)), replay.u.shape[1])
        self.start = self._response(np.zeros(len(self.sd)))[0]

    def _modal(self, omega: FloatArray, zeta: FloatArray, inputs: FloatArray) -> ByOrder:
        """Modal motions (r, n) of every order of derivative that the sensors measure."""
        r = len(omega)
        return {
            o: integrate(
                ModalTruth(omega, zeta, inputs, np.eye(r), np.full(r, o)), self.replay.u, self.replay.dt, self.over
            )
            for o in sorted(set(self.replay.order.tolist()))
        }

    def _seen(self, outputs: FloatArray, motions: ByOrder) -> FloatArray:
        rows = [row @ motions[o] for row, o in zip(outputs, self.replay.order.tolist(), strict=True)]
        return np.concatenate(rows)

    def _response(self, theta: FloatArray) -> tuple[FloatArray, State]:
        n, k = len(self.parts), len(self.free)
        K, M = np.diag(self.omega**2), np.eye(len(self.omega))
        for value, (dK, dM) in zip(theta[:n], self.parts, strict=True):
            K, M = K + np.expm1(value) * dK, M + np.expm1(value) * dM
        values, v = scipy.linalg.eigh(0.5 * (K + K.T), 0.5 * (M + M.T))
        omega, zeta = np.sqrt(np.maximum(values, 1e-6 * self.omega[0] ** 2)), self.zeta.copy()
        factor = np.ones(len(omega))
        factor[self.free] = np.exp(theta[n : n + k])
        zeta[self.free] = np.minimum(zeta[self.free] * np.exp(theta[n + k :]), 0.9)
        motions = self._modal(factor * omega, zeta, self.inputs @ v)
        return self._seen(self.outputs @ v, motions), (omega, factor * omega, zeta, v, motions)

    def _derivatives(self, theta: FloatArray, state: State) -> FloatArray:
        """Derivatives (n_out n, unknowns): of frequencies and dampings by differences, of all modes at once; of the
        parameters through frequencies and shapes (Fox and Kapoor 1968, eq. 8 and 17, close modes held apart)."""
        omega, moved, zeta, v, motions = state
        inputs, outputs = self.inputs @ v, self.outputs @ v
        stiffer, lossier = self._modal(moved * (1 + STEP), zeta, inputs), self._modal(moved, zeta * (1 + STEP), inputs)
        by_w = {o: (stiffer[o] - y) / STEP for o, y in motions.items()}
        by_z = {o: (lossier[o] - y) / STEP for o, y in motions.items()}
        gap = omega[:, None] ** 2 - omega[None, :] ** 2
        small = (0.02 * omega[None, :] ** 2) ** 2
        columns = []
        for value, part in zip(theta[: len(self.parts)], self.parts, strict=True):
            k, m = (np.exp(value) * (v.T @ d @ v) for d in part)
            e = k - m * omega[None, :] ** 2
            mix = -e * gap / (gap**2 + small)
            np.fill_diagonal(mix, -0.5 * np.diag(m))
            driven = self._modal(moved, zeta, inputs @ mix)
            slope = (np.diag(e) / (2 * omega**2))[:, None]
            change = {o: slope * by_w[o] + driven[o] for o in motions}
            columns.append(self._seen(outputs, change) + self._seen(outputs @ mix, motions))
        only = np.eye(len(omega))
        for by in (by_w, by_z):
            columns += [self._seen(outputs * only[r], by) for r in self.free]
        return np.column_stack(columns)

    def _descend(self, e: FloatArray, weight: FloatArray, theta: FloatArray, steps: int) -> tuple[FloatArray, float]:
        """Gauss-Newton from `theta`, every step shortened until it gains: the point reached and its cost."""

        def cost_of(y: FloatArray, at: FloatArray) -> float:
            return float(np.sum((weight * (e - (y - self.start))) ** 2) + np.sum((at / self.sd) ** 2))

        now, state = self._response(theta)
        cost = cost_of(now, theta)
        for _ in range(steps):
            J = weight[:, None] * self._derivatives(theta, state)
            rest = weight * (e - (now - self.start))
            step = np.linalg.solve(J.T @ J + np.diag(self.sd**-2.0), J.T @ rest - theta / self.sd**2)
            for share in (1.0, 0.4, 0.15, 0.05):
                trial = theta + share * step
                there, reached = self._response(trial)
                tried = cost_of(there, trial)
                if tried < cost:
                    break
            else:
                break
            small = tried > 0.98 * cost
            theta, cost, now, state = trial, tried, there, reached
            if small:
                break
        return theta, cost

    def left(self, change: FloatArray) -> float:
        """RMS of a `change` (n_out, n), in units of the noise, that remains after the fit, priors paid."""
        e = change.ravel()
        whole = float(np.sum((self.weight * e) ** 2))
        zero = np.zeros(len(self.sd))
        costs = [whole, self._descend(e, self.weight, zero, 6)[1]]
        theta = zero
        time = self.replay.dt * np.arange(change.shape[1])
        for fade in FADES:
            window = np.tile(np.exp(-fade * self.omega[0] * time), len(change))
            theta, _ = self._descend(e, self.weight * window, theta, 4)
        costs.append(self._descend(e, self.weight, theta, 6)[1])
        return float(np.sqrt(TEMPER * min(costs) / e.size))
