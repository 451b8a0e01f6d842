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
from .setting import SECONDS, Test
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
        self.start = self.response(np.zeros(len(self.sd)))
        steps = 0.05 * self.sd
        self.J = np.column_stack(
            [(self.response(h * e) - self.start) / h for h, e in zip(steps, np.eye(len(steps)), strict=True)]
        )
        scaled = np.vstack([self.weight[:, None] * self.J, np.diag(1 / self.sd)])
        self.solve = np.linalg.pinv(scaled)

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

    def response(self, theta: np.ndarray) -> np.ndarray:
        """High recording (raveled) with the unknowns' logarithms at theta."""
        n, k = len(self.dK), len(self.free)
        K, M = np.diag(self.w**2), np.eye(len(self.w))
        for value, a, b in zip(theta[:n], self.dK, self.dM, strict=True):
            K, M = K + np.expm1(value) * a, M + np.expm1(value) * b
        w2, v = fe.sla.eigh(K, M)
        w, zeta = np.sqrt(np.maximum(w2, 1e-6 * self.w[0] ** 2)), self.zeta.copy()
        w[self.free] *= np.exp(theta[n : n + k])
        zeta[self.free] *= np.exp(theta[n + k :])
        m = Modal(w, zeta, self.load @ v, self.sensor @ v, np.zeros((0, len(w))), np.zeros((len(self.sensor), 1)))
        rate = self.test.rate
        return simulate(m, [], [self.test.forces["high"]], rate, int(rate * SECONDS["high"]), 4)[0].ravel()

    def left(self, e: np.ndarray) -> float:
        """NRMSE of the change `e` (sensors, samples) that remains after the fit, priors paid.

        Gauss-Newton with the derivatives at the truth, up to five steps, each shortened until it gains.
        """
        e = e.ravel()
        whole = float(np.sum((self.weight * e) ** 2))
        theta, rest, cost = np.zeros(len(self.sd)), e, whole
        for _ in range(5):
            target = np.concatenate([self.weight * (rest + self.J @ theta), np.zeros(len(theta))])
            step = self.solve @ target - theta
            for share in (1.0, 0.4, 0.15):
                trial = theta + share * step
                after = e - (self.response(trial) - self.start)
                tried = float(np.sum((self.weight * after) ** 2) + np.sum((trial / self.sd) ** 2))
                if tried < 0.99 * cost:
                    break
            else:
                break
            theta, rest, cost = trial, after, tried
        return float(np.linalg.norm(e) / np.linalg.norm(self.base) * np.sqrt(cost / max(whole, 1e-300)))
