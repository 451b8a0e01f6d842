"""How a closed loop changes with the model when its laws work on as they do.

A law is taken as the spring and dashpot that follow its force best, beside a force that is what is left of it and stays
as it was. The core then has the derivatives over all of the model's unknowns at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.closed_loop import History, Loop
from femend.estimate.lines import Lines

__all__ = ["linearised_columns"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def linearised_columns(loop: Loop, p: FloatArray, x: FloatArray, histories: list[History]) -> FloatArray:
    """Derivatives (n_residual, n_p) of the residual over the unknowns of the model at p (n_p,), for laws at their fit
    coordinates x (n_x,) that are taken as linear around their `histories`, one for each record."""
    problem, reduced = loop.problem, loop.joint.reduced
    system = problem.system(reduced)
    parts = []
    for i, line in enumerate(problem.lines(reduced, loop.sigma)):
        s = line.s
        kappa, rest = _equivalent(loop, i, s, histories[i], loop.stiffness(x, s))
        kappa = kappa if loop.joint.held is None else kappa - loop.joint.held
        # compliance in series with a law is part of it: F = kappa (w q - compliance F) + rest
        within = 1 + kappa * loop.joint.compliance
        driven = _driven(loop, line, s, rest / within)
        columns = _core.model_columns(system, driven, np.ascontiguousarray(loop.joint.w), kappa / within, p)
        n_out = line.Y.shape[1]
        # from sensor after sensor, real before imaginary, to line after line
        ordered = columns.reshape(n_out, 2, len(s), len(p)).transpose(1, 2, 0, 3)
        if line.picked_up is not None:
            left = line.picked_up.taken_out(ordered[0] + 1j * ordered[1])
            ordered = np.stack([left.real, left.imag])
        parts.append(-ordered.reshape(2 * len(s) * n_out, len(p)))
    return np.concatenate(parts)


def _driven(loop: Loop, line: Lines, s: ComplexArray, rest: ComplexArray) -> _core.RecordLines:
    """The lines of a record with forces `rest` (K, n_w) against the motion of the coordinates beside the measured ones,
    and without decays."""
    record, reduced = line.record, loop.joint.reduced
    into = np.vstack([reduced.rows(record.in_rows, record.in_signs), -loop.joint.w])
    return _core.RecordLines(
        s,
        np.ascontiguousarray(np.hstack([line.U, rest])),
        np.ascontiguousarray(line.Y),
        line.weight,
        np.ascontiguousarray(reduced.rows(record.out_rows, record.out_signs)),
        into,
        dt=0.0,
        sigma=line.sigma,
        n_samples=1,
        thinning=1.0,
        tempering=1.0,
    )


def _equivalent(
    loop: Loop, i: int, s: ComplexArray, history: History, known: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Dynamic stiffness (K, n_w) of the spring and dashpot that follow the law's force best, and the rest of it; the
    law's own where it is `known`."""
    D, F = loop.spectra(history.d, i), loop.spectra(history.f, i)
    kappa = np.zeros_like(D)
    for j in range(D.shape[1]):
        if np.isfinite(known[:, j]).all():
            kappa[:, j] = known[:, j]
            continue
        A = np.column_stack([D[:, j], s * D[:, j]])
        size = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
        both = np.vstack([A.real, A.imag]) / size
        k, c = np.linalg.lstsq(both, np.concatenate([F[:, j].real, F[:, j].imag]), rcond=None)[0] / size
        kappa[:, j] = k + s * c
    return kappa, F - kappa * D
