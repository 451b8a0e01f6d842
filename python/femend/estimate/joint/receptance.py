"""Dynamic stiffness of a small damped model on many lines, its inverse, and what changes with the unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.model.terms.configured import ConfiguredModel

__all__ = ["Receptance", "receptance"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Receptance:
    """X(s) = (K + s C + s^2 M + what turning adds)^-1 (n_lines, r, r) of a configuration at `s` (n_lines,) rad/s."""

    s: ComplexArray
    X: ComplexArray

    def between(self, out: FloatArray, into: FloatArray) -> ComplexArray:
        """Accelerance (n_lines, n_out, n_in) between rows `out` (n_out, r) and `into` (n_in, r) of the basis."""
        return np.asarray((self.s**2)[:, None, None] * ((out @ self.X) @ into.T))

    def changes(
        self, left: ComplexArray, right: ComplexArray, dK: FloatArray, dM: FloatArray, dC: FloatArray
    ) -> ComplexArray:
        """-left dZ right (m, n_lines, n_left, n_right): derivatives of a receptance with respect to m unknowns.

        `left` (n_lines, n_left, r) and `right` (n_lines, r, n_right) are X times rows; dK, dM, dC (m, r, r). From
        d(Z^-1) = -Z^-1 dZ Z^-1 (Magnus and Neudecker, Matrix Differential Calculus, 3rd ed., ch. 8, eq. 3).
        """
        s = self.s[:, None, None]
        done = []
        for k, m, c in zip(dK, dM, dC, strict=True):
            # matrix times few columns first: no matrix (r, r) is made on every line
            done.append(-(left @ (k @ right + s * (c @ right) + s**2 * (m @ right))))
        return np.array(done)


def receptance(model: ConfiguredModel, p: FloatArray, s: NDArray[Any], speed: FloatArray | None = None) -> Receptance:
    """The receptance matrix of `model` at unknowns p (n,) on complex lines `s` (n_lines,) in rad/s, at rest or turning
    at `speed` (n_lines,) rad/s."""
    K, M, C = model.matrices(p)
    lines = np.asarray(s, dtype=np.complex128)
    at = lines[:, None, None]
    Z = K + at * C + at**2 * M
    if speed is not None and model.turning:
        Z = Z + model.turning_stiffness(p, lines, speed)
    return Receptance(lines, np.asarray(np.linalg.inv(Z), dtype=np.complex128))
