"""Local force laws of the truth (force ON the structure) with tangents and internal states, compiled where numba is
there.
"""

from __future__ import annotations

import math

import numpy as np

try:
    from numba import njit
except ImportError:  # the same code runs interpreted, only slowly

    def njit(*args, **kwargs):
        """Stand-in for numba.njit."""
        return args[0] if args and callable(args[0]) else (lambda f: f)


SPRING, DASHPOT, MAXWELL, ABSORBER, QUADRATIC, CUBIC, CONTACT, BILINEAR, JENKINS, SLIDER, BOUC_WEN = range(1, 12)
# laws outside the package's catalogue
TANH_LOOP, ODD_DAMPING, QUINTIC, POWER_DAMPING, EXPONENTIAL, WEDGE = range(12, 18)
N_PAR, N_STATE = 20, 8


def pack(*values: float) -> np.ndarray:
    """Parameters padded to the fixed length the kernel wants."""
    out = np.zeros(N_PAR)
    out[: len(values)] = values
    return out


@njit(cache=True)
def one_stop(k, pen, speed, chi):
    """Hunt-Crossley stop: k pen (1 + chi speed), never pulling. Returns force and its two derivatives."""
    if pen <= 0.0:
        return 0.0, 0.0, 0.0
    g = 1.0 + chi * speed
    if g <= 0.0:
        return 0.0, 0.0, 0.0
    return k * pen * g, k * g, k * pen * chi


@njit(cache=True)
def force(code, p, d, v, z, ha):
    """Force on the structure, d/dd, d/dv at given states z; ha = h/4 enters the tangent through the states."""
    if code == SPRING:
        return -p[0] * d, -p[0], 0.0
    if code == DASHPOT:
        return -p[0] * v, 0.0, -p[0]
    if code == MAXWELL:  # p = k0, branches, k1, tau1, k2, tau2, ...
        f, fv = -p[0] * d, 0.0
        for i in range(int(p[1])):
            f -= z[i]
            fv -= p[2 + 2 * i] * ha
        return f, -p[0], fv
    if code == ABSORBER:  # p = m, k, c
        return p[1] * (z[0] - d) + p[2] * (z[1] - v), -p[1], -p[2]
    if code == QUADRATIC:  # p = c, small speed
        r = math.sqrt(v * v + p[1] * p[1])
        return -p[0] * v * r, 0.0, -p[0] * (r + v * v / r)
    if code == CUBIC:
        return -p[0] * d * d * d, -3.0 * p[0] * d * d, 0.0
    if code == CONTACT:  # p = k, gap above, gap below, chi
        f1, a1, b1 = one_stop(p[0], d - p[1], v, p[3])
        f2, a2, b2 = one_stop(p[0], -d - p[2], -v, p[3])
        return f2 - f1, -a1 - a2, -b1 - b2
    if code == BILINEAR:  # p = k_plus, k_minus, small width
        r = math.sqrt(d * d + p[2] * p[2])
        return -p[1] * d - (p[0] - p[1]) * 0.5 * (d + r - p[2]), -p[1] - (p[0] - p[1]) * 0.5 * (1.0 + d / r), 0.0
    if code == JENKINS:  # p = kt, limit; z[0] = spring force after the return mapping
        return -z[0], (-p[0] if abs(z[0]) < p[1] else 0.0), 0.0
    if code == SLIDER:  # p = limit, small speed
        t = math.tanh(v / p[1])
        return -p[0] * t, 0.0, -p[0] * (1.0 - t * t) / p[1]
    if code == BOUC_WEN:  # p = k, alpha, beta, gamma, n
        return -p[1] * p[0] * d - (1.0 - p[1]) * p[0] * z[0], -p[1] * p[0], -(1.0 - p[1]) * p[0] * ha
    return outside_force(code, p, d, v, z, ha)


@njit(cache=True)
def outside_force(code, p, d, v, z, ha):
    """As `force`, for the laws that no catalogue has."""
    if code == TANH_LOOP:  # p = k, d0, kh, yield: saturating spring beside a smooth slider, z[0] = kh times its stretch
        t = math.tanh(d / p[1])
        return -p[0] * p[1] * t - z[0], -p[0] * (1.0 - t * t), -p[2] * ha
    if code == ODD_DAMPING:  # p = c, d0, power, small displacement
        r = math.sqrt(d * d + p[3] * p[3])
        g = (r / p[1]) ** p[2]
        return -p[0] * g * v, -p[0] * v * p[2] * g * d / (r * r), -p[0] * g
    if code == QUINTIC:  # p = k3 (softening), k5
        d2 = d * d
        return (p[0] - p[1] * d2) * d2 * d, (3.0 * p[0] - 5.0 * p[1] * d2) * d2, 0.0
    if code == POWER_DAMPING:  # p = c, small speed, d0: v |v|^0.5 (1 + |d| / d0)
        r, q = math.sqrt(v * v + p[1] * p[1]), math.sqrt(d * d + 1e-4 * p[2] * p[2])
        g = p[0] * (1.0 + q / p[2])
        return (
            -g * v * math.sqrt(r),
            -p[0] * d / (q * p[2]) * v * math.sqrt(r),
            -g * (math.sqrt(r) + 0.5 * v * v / r**1.5),
        )
    if code == EXPONENTIAL:  # p = k, d0: steep on one side, flat on the other; straight on beyond exp(4)
        x = d / p[1]
        e = math.exp(min(x, 4.0))
        return -p[0] * p[1] * (e - 1.0 + e * max(x - 4.0, 0.0)), -p[0] * e, 0.0
    if code == WEDGE:  # p = k, small speed, small displacement: friction whose limit is k |d|
        t, q = math.tanh(v / p[1]), math.sqrt(d * d + p[2] * p[2])
        return -p[0] * q * t, -p[0] * d / q * t, -p[0] * q * (1.0 - t * t) / p[1]
    return 0.0, 0.0, 0.0


@njit(cache=True)
def rate(code, p, d, v, z, out):
    """Time derivative of the internal states into `out`."""
    if code == MAXWELL:
        for i in range(int(p[1])):
            out[i] = p[2 + 2 * i] * v - z[i] / p[3 + 2 * i]
    elif code == ABSORBER:
        out[0] = z[1]
        out[1] = (p[1] * (d - z[0]) + p[2] * (v - z[1])) / p[0]
    elif code == BOUC_WEN:
        a = abs(z[0])
        out[0] = v - p[2] * abs(v) * a ** (p[4] - 1.0) * z[0] - p[3] * v * a ** p[4]
    elif code == TANH_LOOP:
        limit = p[2] * p[3]
        out[0] = p[2] * (v - 0.5 * abs(v) * z[0] / limit - 0.5 * v * abs(z[0]) / limit)


@njit(cache=True)
def clip(x, limit):
    """Return mapping of the elastic-plastic element."""
    return min(max(x, -limit), limit)
