"""Orthogonality of shapes with respect to a mass matrix, whole or reduced to the measured DOFs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import gram, mass_matrix, mass_times, scaled, shape_pair, shapes
from femend.errors import CorrelationError
from femend.numerals import plain

__all__ = ["cross_orthogonality", "orthogonality"]


def orthogonality(phi: ArrayLike, M: Any) -> NDArray[Any]:
    """Self-orthogonality phi^H M phi of `phi` (n_dof, n_modes) at unit modal mass: (n_modes, n_modes).

    O_rs = phi_r^H M phi_s / sqrt((phi_r^H M phi_r)(phi_s^H M phi_s)) (Ewins, Modal Testing, 2nd ed. 2000, chapter 5).
    `M` is (n_dof, n_dof), dense or sparse, or its diagonal (n_dof,); for measured shapes reduce it to the measured
    DOFs (TAM). The diagonal is 1; NASA-STD-5002 asks |O_rs| <= 0.1 off it. Raises CorrelationError for sizes that do
    not fit, values that are not finite, an M that is not symmetric, or a shape without positive modal mass.

    >>> orthogonality([[1.0, 1.0], [1.0, -1.0]], [3.0, 1.0]).round(12).tolist()
    [[1.0, 0.5], [0.5, 1.0]]
    """
    x = shapes(phi, "the set of shapes")
    return cross_orthogonality(x, x, M)


def cross_orthogonality(phi_a: ArrayLike, phi_b: ArrayLike, M: Any) -> NDArray[Any]:
    """Cross-orthogonality of `phi_a` (n_dof, n_a) with `phi_b` (n_dof, n_b) over `M`: (n_a, n_b), signed or complex.

    X_rs = a_r^H M b_s / sqrt((a_r^H M a_r)(b_s^H M b_s)) (Ewins 2000, chapter 5). `M` as in `orthogonality`; |X|^2 is
    the MAC weighted by M. NASA-STD-5002 asks |X| >= 0.9 for pairs and <= 0.1 otherwise. Raises CorrelationError for
    sizes that do not fit, values that are not finite, an M that is not symmetric, or a shape without positive modal
    mass.

    >>> cross_orthogonality([1.0, 1.0], [1.0, -1.0], [3.0, 1.0]).round(12).tolist()
    [[0.5]]
    """
    a, b = shape_pair(phi_a, phi_b)
    a, b = scaled(a, -2), scaled(b, -2)
    mass = mass_matrix(M, b.shape[-2])
    heavy = mass_times(mass, b)
    ma, mb = _modal_mass(a, mass_times(mass, a), "first"), _modal_mass(b, heavy, "second")
    return gram(a, heavy) / (np.sqrt(ma)[..., :, None] * np.sqrt(mb)[..., None, :])


def _modal_mass(x: NDArray[Any], heavy: NDArray[Any], which: str) -> NDArray[np.float64]:
    mass = np.real(np.sum(x.conj() * heavy, axis=-2))
    if not (mass > 0).all():
        mode = int(np.nonzero(~(mass > 0))[-1][0])
        raise CorrelationError(
            f"mode {mode + 1} of the {which} set has the modal mass {plain(np.min(mass))}; M has to be positive on the "
            "shapes: take the mass of the DOFs that are compared, and leave out shapes that do not move there"
        )
    return mass
