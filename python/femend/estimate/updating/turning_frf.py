"""FRFs of a structure that turns, every line at its own speed, with their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.estimate.updating.requests import Frfs
from femend.estimate.updating.turning_matrices import Change, Turned

__all__ = ["turning_frf", "turning_frf_slopes"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def turning_frf(turned: Turned, frfs: Frfs, sensors: Any) -> ComplexArray:
    """(n_freq, n_out, n_in) B_out D^-1 B_in^T of the kind of `frfs`, `sensors` (n_sensors, n) by row. D is not
    symmetric: factors with pivots, one a line. Raises ModelError on a line at which D is singular."""
    out, into = _ends(frfs, sensors)
    assert frfs.speed is not None
    H = np.array([out.T @ turned.factor(s, float(w)).solve(into) for s, w in zip(frfs.s, frfs.speed, strict=True)])
    return np.asarray(frfs.scale[:, None, None] * H)


def turning_frf_slopes(
    turned: Turned, changes: Sequence[Change], frfs: Frfs, sensors: Any, n_parameters: int
) -> ComplexArray:
    """Derivatives (n_parameters, n_freq, n_out, n_in) of `turning_frf` over the `changes` of D: -(D^-T B_out^T)^T dD
    (D^-1 B_in^T), exact. Arguments and errors are those of `turning_frf`."""
    out, into = _ends(frfs, sensors)
    assert frfs.speed is not None
    dH = np.zeros((n_parameters, frfs.s.size, out.shape[1], into.shape[1]), dtype=np.complex128)
    for k, (s, w) in enumerate(zip(frfs.s, frfs.speed, strict=True)):
        factor = turned.factor(s, float(w))
        right, left = factor.solve(into), factor.solve(out, trans="T")
        for change in changes:
            dH[change.parameter, k] -= change.between(left, right, s, float(w))
    return np.asarray(frfs.scale[:, None, None] * dH)


def _ends(frfs: Frfs, sensors: Any) -> tuple[ComplexArray, ComplexArray]:
    """Patterns (n, n_out) and (n, n_in) of the outputs and inputs."""
    rows = sensors.toarray() if hasattr(sensors, "toarray") else np.asarray(sensors)
    return tuple(np.asfortranarray(rows[list(at)].T, dtype=np.complex128) for at in (frfs.outputs, frfs.inputs))  # type: ignore[return-value]
