"""Pairing of complex modes of two neighbouring speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.analysis.conservative import COINCIDE
from femend.analysis.turning import TurningSystem

__all__ = ["State", "follow"]

NEARNESS = 0.05  # weight of the distance to the predicted pole beside the likeness of shapes


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Modes at one `speed` (rad/s) as they are followed: oscillatory and rigid ones, without conjugates.

    `poles` (m,), `right` and `left` (n, m), `a` (m,) modal a, `slope` (m,) d pole / d speed, `residual` (m,) the
    larger one of both sides, `doubt` (m,) that of the right side, to which a pole is known, `n_divergent` real poles
    with growing motion.
    """

    speed: float
    poles: NDArray[np.complex128]
    right: NDArray[np.complex128]
    m_right: NDArray[np.complex128]
    c_left: NDArray[np.complex128]
    m_left: NDArray[np.complex128]
    a: NDArray[np.complex128]
    slope: NDArray[np.complex128]
    residual: NDArray[np.float64]
    doubt: NDArray[np.float64]
    n_divergent: int

    @classmethod
    def of(cls, system: TurningSystem, found: dict[str, Any], speed: float) -> State:
        """From what the core `found` for `system` at `speed`."""
        kinds = np.array(found["kinds"], dtype=object)
        at = np.flatnonzero((kinds == "rigid") | (kinds == "oscillatory"))
        poles, right, left = found["poles"][at], found["right"][:, at], found["left"][:, at]
        a = found["modal_a"][at]
        change = np.zeros((poles.size,), dtype=complex)
        for matrix, factor in ((system.G, poles), (system.N, 1.0), (system.S, 2.0 * speed)):
            if matrix is not None:
                change = change + factor * np.sum(left * (matrix @ right), axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.where((poles != 0) & (np.abs(a) > 0), -change / a, 0.0)
        m_left = system.M @ left
        damping = system.matrix("damping", speed)
        real = found["poles"][kinds == "overdamped"].real
        return cls(
            speed,
            poles,
            right,
            system.M @ right,
            damping.T @ left,
            m_left,
            a,
            slope,
            np.maximum(found["residual"][at], found["residual_left"][at]),
            found["residual"][at],
            int(np.sum(real > 0)),
        )


def follow(before: State, after: State, *, by_pole: bool = False) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Likeness (m,) of each mode of `before` with its continuation in `after`, and the column (m,) of that, -1 for
    none.

    Bi-orthogonality b_ij = |y_i^T ((p_i + p_j) M + C + W G) psi_j| / |a_i| with psi_j scaled to its own modal a; 1 for
    the mode itself, 0 for the others. Rigid-body modes are told by the mass alone. `by_pole` pairs by the poles alone.
    The likeness is that of the best continuation, less what a second one has of it; shapes of poles that coincide in
    `after` (both planes of a rotor that nothing tells apart) are one continuation, any of them.
    """
    from scipy.optimize import linear_sum_assignment

    m = before.poles.size
    step = after.speed - before.speed
    expected = before.poles + step * before.slope
    scale = np.maximum(np.abs(before.poles), 1e-3 * np.max(np.abs(before.poles), initial=1e-300))
    apart = np.abs(expected[:, None] - after.poles[None, :]) / scale[:, None]
    if by_pole:
        like = np.exp(-apart / 1e-2)
    else:
        like = _likeness(before, after)
    same = np.abs(after.poles[:, None] - after.poles) <= COINCIDE * np.abs(after.poles)
    like = np.sqrt(like**2 @ same)
    cost = (1.0 - np.minimum(like, 1.0)) + NEARNESS * np.minimum(apart, 1.0)
    rows, columns = linear_sum_assignment(cost)
    order, quality = np.full(m, -1, dtype=np.int64), np.zeros(m)
    order[rows] = columns
    for i, j in zip(rows, columns, strict=True):
        others = like[i, ~same[j]]
        second = float(np.max(others, initial=0.0))
        quality[i] = min(float(like[i, j]), 1.0) if second <= like[i, j] else min(float(like[i, j]), 1.0 - second)
    return np.clip(quality, 0.0, 1.0), order


def _likeness(before: State, after: State) -> NDArray[np.float64]:
    """|b_ij|, (m, k)."""
    masses = before.m_left.T @ after.right
    total = before.poles[:, None] + after.poles[None, :]
    form = np.abs(total * masses + before.c_left.T @ after.right)
    size = np.sqrt(np.abs(before.a)[:, None] * np.abs(after.a)[None, :])
    plain = np.abs(before.right.conj().T @ after.m_right)
    flat = (before.poles == 0)[:, None] | (after.poles == 0)[None, :]
    return np.where(flat | (size < 1e-9 * np.abs(total)), plain, form / np.where(size > 0, size, 1.0))
