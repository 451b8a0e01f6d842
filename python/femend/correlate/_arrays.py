"""Checks and inner products that all criteria share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import CorrelationError

__all__: list[str] = []

# Products of squared lengths inside these limits neither overflow nor underflow.
_SAFE = (1e-140, 1e140)


def finite(values: ArrayLike, what: str) -> NDArray[Any]:
    """`values` as float64 or complex128; raises CorrelationError where one is not finite or none is there."""
    array = np.asarray(values)
    array = array.astype(np.complex128 if np.iscomplexobj(array) else np.float64, copy=False)
    if array.size == 0:
        raise CorrelationError(f"{what} has shape {array.shape}: there is nothing to compare")
    if not np.isfinite(array).all():
        at = tuple(int(i[0]) for i in np.nonzero(~np.isfinite(array)))
        n_bad = int(array.size - np.isfinite(array).sum())
        raise CorrelationError(f"{what} has {n_bad} values that are not finite, the first at {at}; leave them out")
    return array


def shapes(values: ArrayLike, what: str) -> NDArray[Any]:
    """Shapes (..., n_dof, n_modes); one vector (n_dof,) becomes one column."""
    array = finite(values, what)
    return array[:, None] if array.ndim == 1 else array


def shape_pair(a: ArrayLike, b: ArrayLike, *, paired: bool = False) -> tuple[NDArray[Any], NDArray[Any]]:
    """Two sets of shapes over the same DOFs; `paired` asks for the same number of modes too."""
    first, second = shapes(a, "the first set of shapes"), shapes(b, "the second set of shapes")
    if first.shape[-2] != second.shape[-2]:
        raise CorrelationError(
            f"shapes with {first.shape[-2]} and {second.shape[-2]} DOFs cannot be compared; shapes are "
            "(n_dof, n_modes) over the same DOFs in the same order"
        )
    if paired and first.shape[-1] != second.shape[-1]:
        raise CorrelationError(
            f"{first.shape[-1]} and {second.shape[-1]} modes: this criterion takes modes in pairs; pair them first "
            "(pair_modes) and give the paired columns"
        )
    return first, second


def gram(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    """a^H b over the last two axes."""
    left = a.conj() if np.iscomplexobj(a) else a
    return np.matmul(np.swapaxes(left, -1, -2), b)


def square(a: NDArray[Any], axis: int | tuple[int, ...]) -> NDArray[np.float64]:
    """Sum of |a|^2 over `axis`."""
    return np.sum(modulus2(a), axis=axis)


def modulus2(a: NDArray[Any]) -> NDArray[np.float64]:
    """|a|^2, element by element."""
    return a.real**2 + a.imag**2 if np.iscomplexobj(a) else a * a


def scaled(a: NDArray[Any], axis: int | tuple[int, ...]) -> NDArray[Any]:
    """`a`, divided by its largest modulus along `axis` where squares would leave the range of the numbers.

    Criteria that do not depend on scale then do not depend on it for numbers of any size either.
    """
    with np.errstate(over="ignore", under="ignore"):
        length2 = square(a, axis)
    if np.all((length2 > _SAFE[0]) & (length2 < _SAFE[1])):
        return a
    peak = np.max(np.abs(a), axis=axis, keepdims=True)
    divisor = np.where(peak > 0, peak, 1.0)
    return a / 2.0 ** np.floor(np.log2(divisor))  # a power of two changes no digit


def ratio(numerator: NDArray[Any], denominator: NDArray[Any]) -> NDArray[Any]:
    """Quotient that is NaN where the denominator is 0: nothing moves there, so there is nothing to compare."""
    shape = np.broadcast_shapes(np.shape(numerator), np.shape(denominator))
    out = np.full(shape, np.nan, dtype=np.result_type(numerator, 1.0))
    return np.divide(numerator, denominator, out=out, where=np.asarray(denominator) != 0)


def fraction(numerator: NDArray[Any], denominator: NDArray[Any]) -> NDArray[np.float64]:
    """`ratio` of what Cauchy-Schwarz keeps inside [0, 1]; only rounding can leave it, and that is cut off."""
    return np.clip(ratio(numerator, denominator), 0.0, 1.0)


def mass_times(M: Any, b: NDArray[Any]) -> NDArray[Any]:
    """M b for a vector of diagonal masses (n_dof,), a dense or a sparse matrix (n_dof, n_dof)."""
    import scipy.sparse

    n_dof = b.shape[-2]
    if scipy.sparse.issparse(M):
        sparse: Any = M
        if sparse.shape != (n_dof, n_dof):
            raise CorrelationError(_misfit(sparse.shape, n_dof))
        if b.ndim != 2:
            raise CorrelationError(f"a sparse mass matrix takes one set of shapes, not a batch of shape {b.shape}")
        return np.asarray(sparse @ b)
    mass = finite(M, "the mass matrix")
    if mass.ndim == 1 and mass.shape == (n_dof,):
        return mass[:, None] * b
    if mass.shape != (n_dof, n_dof):
        raise CorrelationError(_misfit(mass.shape, n_dof))
    return np.matmul(mass, b)


def _misfit(shape: tuple[int, ...], n_dof: int) -> str:
    return (
        f"a mass matrix of shape {shape} does not fit shapes with {n_dof} DOFs; reduce it to the measured DOFs "
        "(Guyan, SEREP), or expand the shapes"
    )
