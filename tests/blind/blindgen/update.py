"""What an update could absorb: a regularised fit of the structure's own unknowns to the change an effect makes.

The unknowns and priors are those an engineer has: moduli of the groups (10 %), scatter of single members (1 %) and
lumps (1.5 %), for every mode in the band a frequency factor (0.5 %) and a damping ratio. The fit weighs channels by
their noise; neighbouring samples carry the same errors of form, so its squares are tempered by ten.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from . import fe
from .integrate import Modal, simulate
from .respond import shapes
from .setting import Test
from .truth import build

MODULUS, MEMBER, LUMP, FREQUENCY, DAMPING = 0.10, 0.01, 0.015, 0.005, 0.5  # prior deviations of logarithms
TEMPER = 10.0


class Update:
    """Truth without effect in few modes, with its derivatives with respect to what an update may move."""

    def __init__(self, test: Test, base: np.ndarray) -> None:
        self.test, self.base = test, base
        sys = test.plain.system
        self.w, self.phi = fe.modes(sys, 1.6 * test.band[1])
        self.zeta = test.damping.zeta[: len(self.w)]
        self.load = shapes(test.plain, [test.drive]).T @ self.phi
        self.sensor = shapes(test.plain, test.sensors).T @ self.phi
        self.dK, self.dM, sd = self._physical()
        self.free = np.flatnonzero(self.w < 2 * np.pi * 1.2 * test.band[1])
        self.sd = np.concatenate([sd, np.full(len(self.free), FREQUENCY), np.full(len(self.free), DAMPING)])
        rms = np.sqrt(np.mean(base**2, axis=1, keepdims=True))
        self.weight = np.broadcast_to(1 / (test.noise * rms * np.sqrt(TEMPER)), base.shape).ravel()
        self.start, _ = self.response(np.zeros(len(self.sd)))

    def _physical(self) -> tuple[list[np.ndarray], list[np.ndarray], np.ndarray]:
        """Modal derivatives of K and M per logarithm of each modulus, member and lump, and the prior deviations."""
        test, zero = self.test, np.zeros((len(self.w), len(self.w)))
        K0 = test.plain.system.K
        dK, dM, sd = [], [], []
        reals = [
            (dataclasses.replace(test.real, factor={**test.real.factor, p: 1.01 * test.real.factor[p]}), MODULUS)
            for p in test.s.groups
        ]
        for i in range(len(test.s.members)):
            member = test.real.member.copy()
            member[i] *= 1.01
            reals.append((dataclasses.replace(test.real, member=member), MEMBER))
        for real, deviation in reals:
            dK.append(self.phi.T @ ((build(test.s, real).system.K - K0) @ self.phi) / 0.01)
            dM.append(zero)
            sd.append(deviation)
        for node, m in test.s.lumps.items():
            rows = [r for c in (1, 2, 3) if (r := test.plain.system.dof[node, c]) >= 0]
            dK.append(zero)
            dM.append(m * test.real.lump.get(node, 1.0) * self.phi[rows].T @ self.phi[rows])
            sd.append(LUMP)
        return dK, dM, np.array(sd)

    def state(self, theta: np.ndarray) -> tuple[np.ndarray, ...]:
        """Circular frequencies, ratios and shapes (r, r; in the modes of the truth) with the logarithms at theta."""
        n, k = len(self.dK), len(self.free)
        K, M = np.diag(self.w**2), np.eye(len(self.w))
        for value, a, b in zip(theta[:n], self.dK, self.dM, strict=True):
            K, M = K + np.expm1(value) * a, M + np.expm1(value) * b
        w2, v = fe.sla.eigh(K, M)
        w, zeta = np.sqrt(np.maximum(w2, 1e-6 * self.w[0] ** 2)), self.zeta.copy()
        factor = np.ones(len(w))
        factor[self.free] = np.exp(theta[n : n + k])
        zeta[self.free] *= np.exp(theta[n + k :])
        return w, factor, zeta, v

    def modal(self, w: np.ndarray, zeta: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Modal accelerations (r, samples) of the high recording."""
        r, rate = len(w), self.test.rate
        m = Modal(w, zeta, load, np.eye(r), np.zeros((0, r)), np.zeros((r, 1)))
        return simulate(m, [], [self.test.forces["high"]], rate, int(rate * self.test.seconds("high")), 4)[0]

    def response(self, theta: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
        """High recording (raveled) at theta, and the state it was made of with the modal accelerations."""
        w, factor, zeta, v = self.state(theta)
        a = self.modal(factor * w, zeta, self.load @ v)
        return (self.sensor @ v @ a).ravel(), (w, factor, zeta, v, a)

    def derivatives(self, theta: np.ndarray, state: tuple[np.ndarray, ...]) -> np.ndarray:
        """Derivatives (samples, unknowns) of the response: frequencies and dampings by difference, all modes at once;
        the others through frequencies and shapes, by perturbation (Fox and Kapoor 1968, eq. 8, 17).
        """
        w, factor, zeta, v, a = state
        load, sensor, h = self.load @ v, self.sensor @ v, 1e-4
        by_w = (self.modal(factor * w * (1 + h), zeta, load) - a) / h
        by_z = (self.modal(factor * w, zeta * (1 + 100 * h), load) - a) / (100 * h)
        columns = []
        gap = w[:, None] ** 2 - w[None, :] ** 2  # row: mode that is mixed in, column: mode that changes
        small = (0.02 * w[None, :] ** 2) ** 2
        for value, dK, dM in zip(theta[: len(self.dK)], self.dK, self.dM, strict=True):
            k, m = (np.exp(value) * v.T @ d @ v for d in (dK, dM))
            e = k - m * w[None, :] ** 2
            mix = -e * gap / (gap**2 + small)
            np.fill_diagonal(mix, -0.5 * np.diag(m))
            louder = (load @ mix)[0] / np.where(load[0] == 0, np.inf, load[0])
            change = (np.diag(e) / (2 * w**2))[:, None] * by_w + louder[:, None] * a
            columns.append((sensor @ change + (sensor @ mix) @ a).ravel())
        for by in (by_w, by_z):
            columns += [np.outer(sensor[:, r], by[r]).ravel() for r in self.free]
        return np.column_stack(columns)

    def left(self, e: np.ndarray) -> float:
        """NRMSE of the change `e` (sensors, samples) that remains after the fit, priors paid: the better of two, from
        the truth at once and by way of the beginning of the record, where resonances have not drifted apart yet.
        """
        time = np.arange(e.shape[1]) / self.test.rate
        fades = [np.broadcast_to(np.exp(-s * self.w[0] * time), e.shape).ravel() for s in (0.1, 0.03)]
        e, zero = e.ravel(), np.zeros(len(self.sd))
        whole = float(np.sum((self.weight * e) ** 2))
        _, cost = self.descend(e, self.weight, zero, 8)
        theta = zero
        for fade in fades:
            theta, _ = self.descend(e, self.weight * fade, theta, 4)
        cost = min(cost, self.descend(e, self.weight, theta, 8)[1], whole)
        return float(np.linalg.norm(e) / np.linalg.norm(self.base) * np.sqrt(cost / max(whole, 1e-300)))

    def descend(self, e: np.ndarray, weight: np.ndarray, theta: np.ndarray, steps: int) -> tuple[np.ndarray, float]:
        """Gauss-Newton from theta, every step shortened until it gains: the point reached and its cost."""

        def cost_of(y: np.ndarray, at: np.ndarray) -> float:
            return float(np.sum((weight * (e - (y - self.start))) ** 2) + np.sum((at / self.sd) ** 2))

        now, state = self.response(theta)
        cost = cost_of(now, theta)
        for _ in range(steps):
            J = weight[:, None] * self.derivatives(theta, state)
            rest = weight * (e - (now - self.start))
            step = np.linalg.solve(J.T @ J + np.diag(self.sd**-2.0), J.T @ rest - theta / self.sd**2)
            for share in (1.0, 0.4, 0.15, 0.05):
                trial = theta + share * step
                there, reached = self.response(trial)
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
