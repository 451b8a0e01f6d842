"""Derivatives of a closed loop's residual through its simulation: over the laws' unknowns and over the model's.

They go along with the simulation, the laws linear around its motion at every step, so that they are exact where the
laws are smooth, at the cost of the modes alone: no law's force has to be found again.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.closed_loop import Loop, Modal

__all__ = ["tangent_columns"]

FloatArray = NDArray[np.float64]

# step of a law's coordinates, over which its parameters change
STEP = 1e-6


def tangent_columns(
    loop: Loop, here: Modal, x: FloatArray, moved: Sequence[tuple[Modal, float]] = ()
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Derivatives of the residual over models `moved` from the modes `here` (each with its step), and over every fit
    coordinate in `x` (n_x,)."""
    made = loop.condensed([here, *(m for m, _ in moved)])
    chain = _over_x(loop, x)
    wanted = np.abs(chain).max(axis=1, initial=0.0) > 0
    done = _core.simulate_tangents(
        *made.modal, loop.closing(x), wanted.tolist(), made.u, made.dt,
        stride=loop.kept[0], decimate=loop.kept[1], residual_compliance=made.residual,
    )  # fmt: skip
    over_p: list[list[FloatArray]] = [[] for _ in moved]
    over_x: list[list[FloatArray]] = [[] for _ in x]
    lines = loop.problem.lines(loop.joint.reduced, loop.sigma)
    for i, ((y, _, _, f, _), dy, df, moved_y, moved_f) in enumerate(done):

        def residual(y: FloatArray, i: int = i) -> list[FloatArray]:
            e = lines[i].left(-loop.spectra(y, i)).ravel()
            return [e.real, e.imag]

        still = made.inside(i, y) + made.static(0, f, i) if moved else y
        for k, (_, step) in enumerate(moved):
            change = made.inside(i, moved_y[k]) + made.static(k + 1, moved_f[k], i) - still
            over_p[k] += residual(change / step)
        for own, factors in zip(over_x, chain[wanted].T, strict=True):
            change = made.inside(i, np.tensordot(factors, dy, 1))
            change = change + made.static(0, np.tensordot(factors, df, 1), i, inputs=False)
            own += residual(change)
    return [np.concatenate(c) for c in over_p], [np.concatenate(c) for c in over_x]


def _over_x(loop: Loop, x: FloatArray) -> FloatArray:
    """Derivatives (n_parameters, n_x) of all laws' parameters, as the core counts them, over the fit coordinates."""
    columns = []
    for j in range(len(x)):
        ends = []
        for sign in (1.0, -1.0):
            at = x.copy()
            at[j] += sign * STEP
            ends.append(_parameters(loop, at))
        columns.append((ends[0] - ends[1]) / (2 * STEP))
    return np.array(columns).T.reshape(-1, len(x))


@cache
def _library() -> dict[str, list[str]]:
    """Names of every law's parameters as the core counts them; a registered law has them as it was given them."""
    return {law: [name for name, _ in parameters] for law, parameters in _core.law_library().items()}


def _parameters(loop: Loop, x: FloatArray) -> FloatArray:
    """Parameters of all laws at all coordinates, one after the other."""
    values = []
    for composite in loop.closing(x):
        for law, given in composite:
            values += [given[name] for name in _library().get(law, given)]
    return np.array(values, dtype=np.float64)
