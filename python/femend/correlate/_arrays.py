"""Checks and inner products that all criteria share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import CorrelationError
from femend.numerals import plain

__all__: list[str] = []

# Products of squared lengths inside these limits neither overflow nor underflow.
_SAFE = (1e-140, 1e140)
# A mass matrix written out with seven digits is symmetric to this share of its largest entry.
_ASYMMETRY = 1e-6
# Rounding lifts a quotient above 1 by a few last digits per DOF; a weight that is not positive by more than that.
_OVER = 1e-9


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
    if array.ndim == 0:
        raise CorrelationError(f"{what} is a single number; shapes are (n_dof, n_modes), one DOF is [value]")
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
    if axis != -2 or a.ndim < 2:
        return np.sum(modulus2(a), axis=axis)
    # a sum of products without an array of squares: a third of the time, the same digits
    if not np.iscomplexobj(a):
        return np.asarray(np.einsum("...ij,...ij->...j", a, a))
    if a.flags.c_contiguous:
        parts = square(a.view(np.float64), -2)
        return np.asarray(parts[..., ::2] + parts[..., 1::2])
    return square(a.real, -2) + square(a.imag, -2)


def modulus2(a: NDArray[Any]) -> NDArray[np.float64]:
    """|a|^2, element by element."""
    return a.real**2 + a.imag**2 if np.iscomplexobj(a) else a * a


def scaled(a: NDArray[Any], axis: int | tuple[int, ...]) -> NDArray[Any]:
    """`a`, divided by its largest modulus along `axis` where squares would leave the range of the numbers.

    Criteria that do not depend on scale then do not depend on it for numbers of any size either.
    """
    with np.errstate(over="ignore", under="ignore"):
        length2 = square(a, axis)
    return a if _safe(length2) else _rescaled(a, axis)


def with_square(a: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Columns as `scaled` gives them, and their squared lengths (..., n_modes), which that needs anyway."""
    with np.errstate(over="ignore", under="ignore"):
        length2 = square(a, -2)
    if _safe(length2):
        return a, length2
    a = _rescaled(a, -2)
    return a, square(a, -2)


def _safe(length2: NDArray[np.float64]) -> bool:
    return bool(np.all((length2 > _SAFE[0]) & (length2 < _SAFE[1])))


def _rescaled(a: NDArray[Any], axis: int | tuple[int, ...]) -> NDArray[Any]:
    if not np.iscomplexobj(a):
        return np.ldexp(a, -_exponent(a, axis))  # a power of two changes no digit
    out = np.empty_like(a)
    power = -np.maximum(_exponent(a.real, axis), _exponent(a.imag, axis))
    out.real, out.imag = np.ldexp(a.real, power), np.ldexp(a.imag, power)
    return out


def _exponent(a: NDArray[np.float64], axis: int | tuple[int, ...]) -> NDArray[np.int32]:
    """Power of two just above the largest modulus along `axis`, far below any other where all is zero."""
    peak = np.max(np.abs(a), axis=axis, keepdims=True)
    return np.where(peak > 0, np.frexp(peak)[1], -1074).astype(np.int32)


def ratio(numerator: NDArray[Any], denominator: NDArray[Any]) -> NDArray[Any]:
    """Quotient that is NaN where the denominator is 0: nothing moves there, so there is nothing to compare."""
    shape = np.broadcast_shapes(np.shape(numerator), np.shape(denominator))
    out = np.full(shape, np.nan, dtype=np.result_type(numerator, 1.0))
    return np.divide(numerator, denominator, out=out, where=np.asarray(denominator) != 0)


def fraction(numerator: NDArray[Any], denominator: NDArray[Any]) -> NDArray[np.float64]:
    """`ratio` of what Cauchy-Schwarz keeps inside [0, 1]; only rounding can leave it, and that is cut off."""
    return np.clip(ratio(numerator, denominator), 0.0, 1.0)


def weighted_fraction(numerator: NDArray[Any], denominator: NDArray[Any]) -> NDArray[np.float64]:
    """`fraction` over a weight, for which Cauchy-Schwarz holds only where it is positive; raises where it is not."""
    value = ratio(numerator, denominator)
    if (value > 1.0 + _OVER).any():
        raise CorrelationError(
            f"over this weight two shapes have the quotient {plain(np.nanmax(value))}, where 1 is the most: the weight "
            "is not positive; take a mass matrix (reduced, not cut out), or none"
        )
    return np.clip(value, 0.0, 1.0)


def mass_matrix(M: Any, n_dof: int) -> Any:
    """`M` checked: a vector of diagonal masses (n_dof,), a dense or a sparse matrix (n_dof, n_dof), symmetric."""
    import scipy.sparse

    if scipy.sparse.issparse(M):
        sparse: Any = M
        finite(sparse.data if sparse.nnz else np.zeros(1), "the mass matrix")
        if sparse.shape != (n_dof, n_dof):
            raise CorrelationError(_misfit(sparse.shape, n_dof))
        rows = sparse.tocsr()
        off, peak = abs(rows - rows.conj().T.tocsr()).max(), abs(rows).max()
    else:
        mass = finite(M, "the mass matrix")
        if mass.shape == (n_dof,):
            return mass
        if mass.shape != (n_dof, n_dof):
            raise CorrelationError(_misfit(mass.shape, n_dof))
        sparse = mass
        off, peak = np.abs(mass - mass.conj().T).max(), np.abs(mass).max()
    if off > _ASYMMETRY * peak:
        raise CorrelationError(
            f"the mass matrix differs from its transpose by {plain(off)}, with {plain(peak)} its largest entry; give "
            "both triangles of it"
        )
    return sparse


def mass_times(mass: Any, b: NDArray[Any]) -> NDArray[Any]:
    """M b for what `mass_matrix` gave."""
    import scipy.sparse

    if scipy.sparse.issparse(mass):
        if b.ndim != 2:
            raise CorrelationError(f"a sparse mass matrix takes one set of shapes, not a batch of shape {b.shape}")
        return np.asarray(mass @ b)
    return mass[:, None] * b if mass.ndim == 1 else np.matmul(mass, b)


def _misfit(shape: tuple[int, ...], n_dof: int) -> str:
    return (
        f"a mass matrix of shape {shape} does not fit shapes with {n_dof} DOFs; reduce it to the measured DOFs "
        "(Guyan, SEREP), or expand the shapes"
    )
