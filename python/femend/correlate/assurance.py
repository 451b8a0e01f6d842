"""MAC and its nearest kin: AutoMAC, MACX, the modal scale factor, MAC against a subspace."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import (
    fraction,
    gram,
    mass_matrix,
    mass_times,
    modulus2,
    ratio,
    scaled,
    shape_pair,
    shapes,
    square,
    weighted_fraction,
    with_square,
)
from femend.errors import CorrelationError
from femend.numerals import plain

__all__ = ["automac", "dac", "mac", "macx", "msf", "principal_cosines", "subspace_mac"]


def mac(phi_a: ArrayLike, phi_b: ArrayLike, weight: Any = None) -> NDArray[np.float64]:
    """Modal assurance criterion of `phi_a` (..., n_dof, n_a) with `phi_b` (..., n_dof, n_b): (..., n_a, n_b) in [0, 1].

    MAC = |a^H W b|^2 / ((a^H W a)(b^H W b)) (Allemang and Brown 1982; Allemang, Sound and Vibration 37(8), 2003,
    "MAC"); the conjugate makes it right for complex shapes. `weight` W is None (identity), a vector (n_dof,), or a
    symmetric matrix (n_dof, n_dof), dense or sparse: with the mass matrix the root of MAC is the cross-orthogonality.
    NaN for a shape that is zero. Leading axes are a batch; one vector (n_dof,) counts as one mode. Independent of
    scale, sign and complex phase. Raises CorrelationError for sizes that do not fit, values that are not finite, or a
    weight that is not symmetric, or not positive on these shapes.

    >>> mac([[1.0, 1.0], [1.0, -1.0]], [[1.0], [0.0]]).round(12).tolist()
    [[0.5], [0.5]]
    """
    (a, a2), (b, b2) = (with_square(x) for x in shape_pair(phi_a, phi_b))
    if weight is None:
        return fraction(modulus2(gram(a, b)), a2[..., :, None] * b2[..., None, :])
    mass = mass_matrix(weight, b.shape[-2])
    heavy = mass_times(mass, b)
    na, nb = _weighted_square(a, mass_times(mass, a)), _weighted_square(b, heavy)
    return weighted_fraction(modulus2(gram(a, heavy)), na[..., :, None] * nb[..., None, :])


def automac(phi: ArrayLike, weight: Any = None) -> NDArray[np.float64]:
    """MAC of `phi` (..., n_dof, n_modes) with itself, (..., n_modes, n_modes).

    Off the diagonal it tells which modes the chosen DOFs cannot tell apart. `weight` as in `mac`. Raises
    CorrelationError as `mac` does.

    >>> automac([[1.0, 0.0], [0.0, 2.0]]).tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    return mac(phi, phi, weight)


def dac(W_a: ArrayLike, W_b: ArrayLike) -> NDArray[np.float64]:
    """Displacement assurance criterion of operating shapes `W_a` (n_dof, n_a) with `W_b` (n_dof, n_b), (n_a, n_b).

    DAC = |w_a^H w_b|^2 / ((w_a^H w_a)(w_b^H w_b)): MAC between operating shapes, one column per speed or frequency
    (Dascotte and Strobbe, IMAC XVII, 1999; Guggenberger, EASC 2009). It says nothing of the amplitude: see `csf`.
    NaN for a shape that is zero. Raises CorrelationError as `mac` does.

    >>> dac([[1.0], [1j]], [[2.0], [2j]]).tolist()
    [[1.0]]
    """
    return mac(W_a, W_b)


def macx(phi_a: ArrayLike, phi_b: ArrayLike) -> NDArray[np.float64]:
    """MAC extended to complex shapes of `phi_a` (..., n_dof, n_a) and `phi_b` (..., n_dof, n_b): (..., n_a, n_b).

    MACX = (|a^H b| + |a^T b|)^2 / ((a^H a + |a^T a|)(b^H b + |b^T b|)) (Vacher, Jacquier and Bucharles, ISMA 2010,
    "Extensions of the MAC criterion to complex modes"). It compares the motions, for which a shape and its conjugate
    count the same, so that MACX(a, conj(a)) = 1; for real shapes it is MAC. NaN for a zero shape. Raises
    CorrelationError for sizes that do not fit or values that are not finite.

    >>> macx([1.0, 1j], [1.0, -1j]).tolist(), mac([1.0, 1j], [1.0, -1j]).tolist()
    ([[1.0]], [[0.0]])
    """
    a, b = shape_pair(phi_a, phi_b)
    a, b = scaled(a, -2), scaled(b, -2)
    top = np.abs(gram(a, b)) + np.abs(np.matmul(np.swapaxes(a, -1, -2), b))
    na = square(a, -2) + np.abs(np.sum(a * a, axis=-2))
    nb = square(b, -2) + np.abs(np.sum(b * b, axis=-2))
    return fraction(top * top, na[..., :, None] * nb[..., None, :])


def msf(phi_a: ArrayLike, phi_b: ArrayLike) -> NDArray[Any]:
    """Modal scale factors (..., n_modes): `phi_b` times them is closest to `phi_a`, column by column.

    Both are (..., n_dof, n_modes). MSF = b^H a / (b^H b) (Allemang and Brown 1982; Allemang 2003, "modal scale
    factor"), the least-squares factor; its sign (or phase) is that which aligns the pair. NaN for a zero column of
    `phi_b`. Raises CorrelationError for sizes that do not fit or values that are not finite.

    >>> msf([2.0, -4.0], [-1.0, 2.0]).tolist()
    [-2.0]
    """
    a, b = shape_pair(phi_a, phi_b, paired=True)
    peak = np.max(np.abs(b), axis=-2, keepdims=True)
    unit = np.divide(b, peak, out=np.zeros_like(b), where=peak > 0)
    return ratio(ratio(np.sum(unit.conj() * a, axis=-2), square(unit, -2)), peak[..., 0, :])


def subspace_mac(phi: ArrayLike, basis: ArrayLike, tol: float = 1e-8) -> NDArray[np.float64]:
    """Share of each shape `phi` (n_dof, n_modes) that lies in the span of `basis` (n_dof, n_b): (n_modes,) in [0, 1].

    |P x|^2 / |x|^2 with P the orthogonal projector on the span; for two columns it is the S2MAC of D'Ambrogio and
    Fregolent (Mech. Syst. Signal Process. 17, 2003, 599-610). Close and repeated modes are any mixture inside their
    span, which this criterion does not mind. Columns of `basis` that depend on the others, to `tol` of the largest
    singular value of the columns at unit length, are left out. NaN for a zero shape or an empty span. Raises
    CorrelationError for sizes that do not fit or values that are not finite.

    >>> subspace_mac([1.0, 1.0, 0.0], [[1.0, 1.0], [0.0, 2.0], [0.0, 0.0]]).round(12).tolist()
    [1.0]
    """
    x, y = shape_pair(phi, basis)
    Q = orthonormal(y, tol)
    x = scaled(x, -2)
    if Q.shape[1] == 0:
        return np.full(x.shape[1], np.nan)
    return fraction(square(gram(Q, x), -2), square(x, -2))


def principal_cosines(phi_a: ArrayLike, phi_b: ArrayLike, tol: float = 1e-8) -> NDArray[np.float64]:
    """Squared cosines of the principal angles between the spans of `phi_a` (n_dof, n_a) and `phi_b` (n_dof, n_b).

    Largest first; their number is the lesser of both dimensions. All 1: one span holds the other, whatever the
    mixtures of its modes. Singular values of Q_a^H Q_b (Bjorck and Golub, Math. Comp. 27, 1973); `tol` as in
    `subspace_mac`. Raises CorrelationError for sizes that do not fit or values that are not finite.

    >>> principal_cosines([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0], [1.0]]).round(12).tolist()
    [0.5]
    """
    a, b = shape_pair(phi_a, phi_b)
    Qa, Qb = orthonormal(a, tol), orthonormal(b, tol)
    if min(Qa.shape[1], Qb.shape[1]) == 0:
        return np.zeros(0)
    return np.clip(np.linalg.svd(gram(Qa, Qb), compute_uv=False) ** 2, 0.0, 1.0)


def orthonormal(phi: ArrayLike, tol: float = 1e-8) -> NDArray[Any]:
    """Orthonormal columns (n_dof, rank) that span `phi` (n_dof, n_modes), to `tol` as in `subspace_mac`.

    Raises CorrelationError for a batch.
    """
    x = shapes(phi, "the basis")
    if x.ndim != 2:
        raise CorrelationError(f"a basis of shape {x.shape}: subspaces take one set of shapes (n_dof, n_modes)")
    x = scaled(x, -2)
    length = np.sqrt(square(x, -2))
    U, s, _ = np.linalg.svd(x[:, length > 0] / length[length > 0], full_matrices=False)
    return U[:, s > tol * s.max(initial=0.0)]


def _weighted_square(x: NDArray[Any], heavy: NDArray[Any]) -> NDArray[np.float64]:
    value = np.real(np.sum(x.conj() * heavy, axis=-2))
    if (value < 0).any():
        raise CorrelationError(
            f"the weight gives a shape the square {plain(np.min(value))}; a weight has to be symmetric and not negative"
        )
    return value
