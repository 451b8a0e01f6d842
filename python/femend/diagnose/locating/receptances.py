"""What the modes of a model answer with on a record's lines."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from femend.estimate import Lines
from femend.model import ReducedModel

__all__ = ["answers", "at_sensors", "on_lines", "receptances"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def receptances(
    omega: NDArray[np.float64], zeta: NDArray[np.float64], s: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Displacement of every mode to a modal force of one, (K, r), at lines `s` (K,) in rad/s.

    `omega` (r,) in rad/s and `zeta` (r,) are those of mass-normalised modes.

    >>> receptances(np.array([2.0]), np.array([0.0]), np.array([0j])).real
    array([[0.25]])
    """
    return 1 / (omega**2 + s[:, None] ** 2 + 2 * (zeta * omega) * s[:, None])


def on_lines(
    line: Lines, reduced: ReducedModel, omega: FloatArray, zeta: FloatArray, Q: FloatArray
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """A record's lines s (K,) in rad/s, the receptances (K, r) of the modes on them, and the modal rows (n_out, r) of
    its responses.

    `omega` (r,) in rad/s, `zeta` (r,) and `Q` (r, r) are those of the model's mass-normalised modes in its basis.
    """
    s = line.s
    return s, receptances(omega, zeta, s), reduced.rows(line.record.out_rows, line.record.out_signs) @ Q


def answers(
    left: FloatArray, g: ComplexArray, right: FloatArray, s: ComplexArray, dashpots: FloatArray
) -> ComplexArray:
    """Displacements (K, n, m) of coordinates `left` (n, r) to forces of one at `right` (m, r), rows over modes whose
    receptances are `g` (K, r) on the lines `s` (K,), in a model with `dashpots` (n_d, r) of 1 N s/m: with H what the
    modes answer, H_lr - H_ld (1/s + H_dd)^-1 H_dr (Sherman, Morrison and Woodbury)."""

    def open_loop(a: FloatArray, b: FloatArray) -> ComplexArray:
        return np.einsum("ar,kr,br->kab", a, g, b, optimize=True)

    H = open_loop(left, right)
    if not len(dashpots):
        return np.asarray(H)
    closed = np.eye(len(dashpots)) + s[:, None, None] * open_loop(dashpots, dashpots)
    return np.asarray(
        H - open_loop(left, dashpots) @ np.linalg.solve(closed, s[:, None, None] * open_loop(dashpots, right))
    )


def at_sensors(s: ComplexArray, g: ComplexArray, out: FloatArray, weight: FloatArray) -> Iterator[ComplexArray]:
    """What modal forces of one do to the accelerations times `weight` (K, n_out): (r, n_out) on one line after the
    other; `s`, `g` and `out` as `on_lines` gives them."""
    for k in range(len(s)):
        yield s[k] ** 2 * g[k][:, None] * out.T * weight[k]
