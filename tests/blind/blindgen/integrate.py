"""Time integration of the truth: two-stage Gauss-Legendre (implicit, order four, A-stable) on modal coordinates.

x' = A x + loads + law forces; the stage equations are solved per mode beforehand, so that only the two stage forces
of each law
are unknown in a step, and Newton finds those. Hairer and Wanner, Solving ODEs II, section IV.5, table 5.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import laws
from .excite import Force
from .laws import njit

R3 = np.sqrt(3.0)
GL_A = np.array([[0.25, 0.25 - R3 / 6.0], [0.25 + R3 / 6.0, 0.25]])
GL_C = np.array([0.5 - R3 / 6.0, 0.5 + R3 / 6.0])


@dataclass
class Modal:
    """Structure in modal coordinates: omega (rad/s), zeta, load shapes (n_in, r), sensor shapes (n_out, r) and law
    shapes (n_law, r).

    `carried` (n_out, n_in) is added to the accelerations times the input: the ground's own motion under a base
    acceleration.
    """

    omega: np.ndarray
    zeta: np.ndarray
    load: np.ndarray
    sensor: np.ndarray
    law: np.ndarray
    carried: np.ndarray


@dataclass
class Law:
    """One local law: code and parameters of `laws`."""

    code: int
    par: np.ndarray


def step_tables(omega: np.ndarray, zeta: np.ndarray, h: float) -> tuple[np.ndarray, ...]:
    """P (r,2,2), Q (r,2,2): next state from state and the two stage loads; S (r,2,2,2), T (r,2,2,2): stage values
    likewise.
    """
    r = len(omega)
    P, Q, S, T = np.zeros((r, 2, 2)), np.zeros((r, 2, 2)), np.zeros((r, 2, 2, 2)), np.zeros((r, 2, 2, 2))
    for i in range(r):
        A = np.array([[0.0, 1.0], [-(omega[i] ** 2), -2 * zeta[i] * omega[i]]])
        G = np.linalg.inv(np.eye(4) - h * np.kron(GL_A, A))
        Kx = G @ np.vstack([A, A])  # (4, 2)
        Kg = G[:, [1, 3]]  # stage loads act on the speed equation
        P[i] = np.eye(2) + 0.5 * h * (Kx[:2] + Kx[2:])
        Q[i] = 0.5 * h * (Kg[:2] + Kg[2:])
        for s in range(2):
            S[i, s] = np.eye(2) + h * (GL_A[s, 0] * Kx[:2] + GL_A[s, 1] * Kx[2:])
            T[i, s] = h * (GL_A[s, 0] * Kg[:2] + GL_A[s, 1] * Kg[2:])
    return P, Q, S, T


@njit(cache=True)
def stage_states(code, p, z, d0, d, v, zs, g, h, a):
    """One sweep of the internal states at the two stages (fixed point of the Gauss equations; exact return map for
    Jenkins).
    """
    if code == laws.JENKINS:
        for s in range(2):
            zs[s, 0] = laws.clip(z[0] + p[0] * (d[s] - d0), p[1])
        return
    for s in range(2):
        laws.rate(code, p, d[s], v[s], zs[s], g[s])
    for i in range(z.shape[0]):
        for s in range(2):
            zs[s, i] = z[i] + h * (a[s, 0] * g[0, i] + a[s, 1] * g[1, i])


@njit(cache=True)
def solve_stages(codes, pars, Z, D0, free_d, free_v, Sd, Sv, F, ZS, G, h, a, scale):
    """Newton (law by law) for the stage forces F (n_law, 2). Returns the last residual relative to the largest force
    so far.
    """
    n = codes.shape[0]
    d, v = np.zeros(2), np.zeros(2)
    f, fd, fv = np.zeros(2), np.zeros(2), np.zeros(2)
    worst = 0.0
    for it in range(60):
        worst = 0.0
        relax = 1.0 if it < 20 else 0.4
        for k in range(n):
            for s in range(2):
                d[s], v[s] = free_d[k, s], free_v[k, s]
                for m in range(n):
                    for t in range(2):
                        d[s] += Sd[k, m, s, t] * F[m, t]
                        v[s] += Sv[k, m, s, t] * F[m, t]
            stage_states(codes[k], pars[k], Z[k], D0[k], d, v, ZS[k], G[k], h, a)
            for s in range(2):
                f[s], fd[s], fv[s] = laws.force(codes[k], pars[k], d[s], v[s], ZS[k, s], 0.25 * h)
                scale[k] = max(scale[k], abs(f[s]))
            j00 = 1.0 - fd[0] * Sd[k, k, 0, 0] - fv[0] * Sv[k, k, 0, 0]
            j01 = -fd[0] * Sd[k, k, 0, 1] - fv[0] * Sv[k, k, 0, 1]
            j10 = -fd[1] * Sd[k, k, 1, 0] - fv[1] * Sv[k, k, 1, 0]
            j11 = 1.0 - fd[1] * Sd[k, k, 1, 1] - fv[1] * Sv[k, k, 1, 1]
            r0, r1 = f[0] - F[k, 0], f[1] - F[k, 1]
            det = j00 * j11 - j01 * j10
            F[k, 0] += relax * (j11 * r0 - j01 * r1) / det
            F[k, 1] += relax * (j00 * r1 - j10 * r0) / det
            worst = max(worst, max(abs(r0), abs(r1)) / (scale[k] + 1e-12))
        if worst < 1e-9:
            break
    return worst


@njit(cache=True)
def condensed(law, T):
    """Displacement and speed at each law and stage per unit stage force of each law: two arrays (n_law, n_law, 2,
    2).
    """
    n, r = law.shape
    Sd, Sv = np.zeros((n, n, 2, 2)), np.zeros((n, n, 2, 2))
    for k in range(n):
        for m in range(n):
            for s in range(2):
                for t in range(2):
                    for i in range(r):
                        Sd[k, m, s, t] += law[k, i] * law[m, i] * T[i, s, 0, t]
                        Sv[k, m, s, t] += law[k, i] * law[m, i] * T[i, s, 1, t]
    return Sd, Sv


@njit(cache=True)
def accelerations(x, w, c2, load, law, sensor, carried, u, f, out):
    """Sensor accelerations from the equation of motion at a sample: loads u (n_in), law forces f (n_law)."""
    for i in range(w.shape[0]):
        q = -w[i] * w[i] * x[i, 0] - c2[i] * x[i, 1]
        for m in range(load.shape[0]):
            q += load[m, i] * u[m]
        for k in range(law.shape[0]):
            q += law[k, i] * f[k]
        for o in range(sensor.shape[0]):
            out[o] += sensor[o, i] * q
    for o in range(sensor.shape[0]):
        for m in range(load.shape[0]):
            out[o] += carried[o, m] * u[m]


@njit(cache=True)
def free_motion(x, S, T, g, law, fd, fv):
    """Motion of the laws at the two stages without their own forces, from state x and modal loads g (2, r)."""
    fd[:] = 0.0
    fv[:] = 0.0
    if law.shape[0] == 0:
        return
    for i in range(x.shape[0]):
        for s in range(2):
            qd = S[i, s, 0, 0] * x[i, 0] + S[i, s, 0, 1] * x[i, 1] + T[i, s, 0, 0] * g[0, i] + T[i, s, 0, 1] * g[1, i]
            qv = S[i, s, 1, 0] * x[i, 0] + S[i, s, 1, 1] * x[i, 1] + T[i, s, 1, 0] * g[0, i] + T[i, s, 1, 1] * g[1, i]
            for k in range(law.shape[0]):
                fd[k, s] += law[k, i] * qd
                fv[k, s] += law[k, i] * qv


@njit(cache=True)
def advance(x, P, Q, g, law, F):
    """Next modal state, in place, from the modal loads g (2, r) and the stage forces F (n_law, 2)."""
    for i in range(x.shape[0]):
        g0, g1 = g[0, i], g[1, i]
        for k in range(law.shape[0]):
            g0 += law[k, i] * F[k, 0]
            g1 += law[k, i] * F[k, 1]
        q = P[i, 0, 0] * x[i, 0] + P[i, 0, 1] * x[i, 1] + Q[i, 0, 0] * g0 + Q[i, 0, 1] * g1
        x[i, 1] = P[i, 1, 0] * x[i, 0] + P[i, 1, 1] * x[i, 1] + Q[i, 1, 0] * g0 + Q[i, 1, 1] * g1
        x[i, 0] = q


@njit(cache=True)
def end_states(x, law, codes, pars, Z, G, D, V, h):
    """Law coordinates and internal states at the end of a step, in place."""
    for k in range(law.shape[0]):
        d, V[k] = 0.0, 0.0
        for i in range(x.shape[0]):
            d += law[k, i] * x[i, 0]
            V[k] += law[k, i] * x[i, 1]
        if codes[k] == laws.JENKINS:
            Z[k, 0] = laws.clip(Z[k, 0] + pars[k, 0] * (d - D[k]), pars[k, 1])
        else:
            for m in range(Z.shape[1]):
                Z[k, m] += 0.5 * h * (G[k, 0, m] + G[k, 1, m])
        D[k] = d


@njit(cache=True)
def run(P, Q, S, T, w, c2, load, sensor, carried, law, codes, pars, stage_u, sample_u, over, h, a):
    """March all samples. stage_u (n_in, steps, 2), sample_u (n_in, n). Returns accelerations (n, n_out), law trace
    (n_law, [d, v, f], n) and the worst stage residual."""
    r, n_law, n = w.shape[0], law.shape[0], sample_u.shape[1]
    x, g = np.zeros((r, 2)), np.zeros((2, r))
    Z, ZS, G = np.zeros((n_law, laws.N_STATE)), np.zeros((n_law, 2, laws.N_STATE)), np.zeros((n_law, 2, laws.N_STATE))
    F, D, V, scale, f = np.zeros((n_law, 2)), np.zeros(n_law), np.zeros(n_law), np.zeros(n_law), np.zeros(n_law)
    fd, fv = np.zeros((n_law, 2)), np.zeros((n_law, 2))
    Sd, Sv = condensed(law, T)
    acc, trace = np.zeros((n, sensor.shape[0])), np.zeros((n_law, 3, n))
    worst = 0.0
    for j in range(n):
        for k in range(n_law):
            f[k] = laws.force(codes[k], pars[k], D[k], V[k], Z[k], 0.0)[0]
            trace[k, 0, j], trace[k, 1, j], trace[k, 2, j] = D[k], V[k], f[k]
        accelerations(x, w, c2, load, law, sensor, carried, sample_u[:, j], f, acc[j])
        for step in range(j * over, (j + 1) * over):
            g[:] = 0.0
            for m in range(load.shape[0]):
                for i in range(r):
                    g[0, i] += load[m, i] * stage_u[m, step, 0]
                    g[1, i] += load[m, i] * stage_u[m, step, 1]
            free_motion(x, S, T, g, law, fd, fv)
            if n_law > 0:
                worst = max(worst, solve_stages(codes, pars, Z, D, fd, fv, Sd, Sv, F, ZS, G, h, a, scale))
            advance(x, P, Q, g, law, F)
            end_states(x, law, codes, pars, Z, G, D, V, h)
    return acc, trace, worst


def simulate(
    modal: Modal, local: list[Law], inputs: list[Force], rate: float, n: int, over: int
) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations (n_out, n) at the sampling rate from rest, and the trace (n_law, [d, v, f], n) of the laws.

    Raises ArithmeticError when the implicit solution did not converge or the motion is not finite.
    """
    h = 1.0 / (rate * over)
    tables = step_tables(modal.omega, modal.zeta, h)
    fine = rate * over
    stage_u = np.stack([np.stack([u.at(fine, n * over, c) for c in GL_C], axis=-1) for u in inputs])
    sample_u = np.stack([u.at(rate, n) for u in inputs])
    codes = np.array([q.code for q in local], np.int64)
    pars = np.array([q.par for q in local]).reshape(len(local), laws.N_PAR)
    acc, trace, worst = run(
        *tables,
        modal.omega,
        2 * modal.zeta * modal.omega,
        np.ascontiguousarray(modal.load),
        np.ascontiguousarray(modal.sensor),
        np.ascontiguousarray(modal.carried),
        np.ascontiguousarray(modal.law[: len(local)]),
        codes,
        pars,
        stage_u,
        sample_u,
        over,
        h,
        GL_A,
    )
    if not np.isfinite(acc).all() or worst > 1e-3:
        raise ArithmeticError(f"truth did not converge: worst stage residual {worst:.2e}")
    return np.ascontiguousarray(acc.T), trace
