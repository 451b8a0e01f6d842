"""Displacements, velocities or accelerations that a simulation with laws shows at the sensors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.closed_loop import Loop

__all__ = ["motion"]

FloatArray = NDArray[np.float64]

KINDS = ("displacement", "velocity", "acceleration")


def motion(loop: Loop, p: FloatArray, x: FloatArray, order: int) -> FloatArray:
    """What the sensors of the one record of `loop` show (n_out, n) at unknowns `p` of the model and fit coordinates `x`
    of its laws: the derivative of `order` of their displacements.

    The displacements are those that the simulation steps through. Integrals of its accelerations would not do: errors
    far below the band drift away in them.
    """
    if order == 2:
        return loop.histories([(p, x)])[0][0].y
    (record,), reduced = loop.problem.records, loop.joint.reduced
    modal = loop.problem.system(reduced).modal(p)
    omega, _, Q, own = modal
    made = loop.condensed([modal])
    ((y, _, _, f, _),) = _core.simulate_batch(
        *made.modal, [loop.closing(x)], made.u, made.dt, stride=loop.kept[0], decimate=loop.kept[1],
        output=KINDS[order], residual_compliance=made.residual,
    )[0]  # fmt: skip
    y, f = made.inside(0, y), made.inside(0, f)
    out = reduced.rows(record.out_rows, record.out_signs) @ Q
    into = reduced.rows(record.in_rows, record.in_signs) @ Q
    w = np.vstack([loop.joint.w @ Q, own])
    n = made.modal[0].shape[1]
    still = out[:, n:] / omega[n:] ** 2
    # the law's force, linear within a step, is made good for by too much in every mode (`Loop.condensed`)
    lost = made.dt**2 / 12 * out[:, :n] @ w[:, :n].T
    beside = still @ into[:, n:].T @ record.u - (still @ w[:, n:].T - lost) @ f
    return np.asarray(y + _derivative(beside, record.dt) if order else y + beside)


def _derivative(x: FloatArray, dt: float) -> FloatArray:
    """First derivative (rows, n) of `x` at steps of `dt` s."""
    s = 2j * np.pi * np.fft.rfftfreq(x.shape[1], dt)
    return np.asarray(np.fft.irfft(s * np.fft.rfft(x, axis=1), x.shape[1], axis=1))
