"""Amplitudes that nobody measured, eliminated from a comparison by linear least squares (variable projection)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.estimate.updating.responses import Compared

__all__ = ["Eliminated", "compared", "eliminate"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# below this share of the largest singular value, columns scaled to unit length, amplitudes are not told apart
DEPENDENT = 1e-10


@dataclass(frozen=True, eq=False)
class Eliminated:
    """The `amplitudes` (n_sets, n_free) that leave least of the values, their deviations `sd` (real and imaginary part
    each, at these parameters), what is left, `residual` (n_sets, n_values), and its derivatives `slopes`
    (n_parameters, n_sets, n_values), None where not asked for."""

    amplitudes: ComplexArray
    sd: FloatArray
    residual: ComplexArray
    slopes: ComplexArray | None


def eliminate(
    A: ComplexArray, y: ComplexArray, dA: ComplexArray | None, sets: Sequence[str], who: str, unknown: str
) -> Eliminated:
    """r = A x - y with the x that makes |r| least in each set, for `A` (n_sets, n_values, n_free) and `y` (n_sets,
    n_values), both over the deviations, and dr for `dA` (n_parameters, n_sets, n_values, n_free).

    With the projector P off the columns of A, r = -P y (Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413) and
    dr = P dA x (Kaufman, BIT 15 (1975) 49). What dr leaves out of the whole derivative lies in the columns of A, where
    r has no part: the gradient of |r|^2 is exact, and dr^H dr is what is left of the normal matrix of parameters and
    amplitudes together once the amplitudes are eliminated (its Schur complement), so that deviations of parameters hold
    what the amplitudes are free to do. Raises UpdatingError, naming the set (`sets`) and `who` compares, where the
    `unknown` amplitudes move nothing that was measured, or cannot be told apart.
    """
    length = np.linalg.norm(A, axis=1)
    if not np.all(length > 0):
        k, j = (int(i) for i in np.argwhere(~(length > 0))[0])
        raise UpdatingError(
            f"{who}: {unknown} {j + 1} of {length.shape[1]} moves no sensor{sets[k]}: its place is held, or its path "
            "to the sensors is missing in the model; take it away"
        )
    U, s, Vh = np.linalg.svd(A / length[:, None, :], full_matrices=False)
    weak = s[:, -1] <= DEPENDENT * s[:, 0]
    if weak.any():
        k = int(np.flatnonzero(weak)[0])
        raise UpdatingError(
            f"{who}: the sensors do not tell the {length.shape[1]} {unknown}s apart{sets[k]} (condition "
            f"{s[k, 0] / max(float(s[k, -1]), 1e-300):.1e}): take a place away, or add sensors"
        )
    inverse = (Vh.conj().swapaxes(1, 2) / s[:, None, :]) / length[:, :, None]
    Uh = U.conj().swapaxes(1, 2)
    x = (inverse @ (Uh @ y[:, :, None]))[:, :, 0]
    residual = -_off(U, Uh, y[:, :, None])[:, :, 0]
    slopes = None
    if dA is not None:
        moved = np.einsum("pkmq,kq->kmp", dA, x)
        slopes = np.asarray(_off(U, Uh, moved).transpose(2, 0, 1))
    sd = np.sqrt((np.abs(inverse) ** 2).sum(axis=2))
    return Eliminated(x, sd, residual, slopes)


def _off(U: ComplexArray, Uh: ComplexArray, values: ComplexArray) -> ComplexArray:
    """The part of `values` (n_sets, n_values, n) off the columns of `U`; twice, so that rounding stays small beside
    it."""
    once = values - U @ (Uh @ values)
    return np.asarray(once - U @ (Uh @ once))


def compared(residual: ComplexArray, slopes: ComplexArray | None, there: NDArray[np.bool_], taken: int = 0) -> Compared:
    """Complex `residual` (n_freq, n_out) and `slopes` (n_parameters, n_freq, n_out) where `there` (n_freq, n_out), real
    parts before imaginary ones; `taken` as of `Compared`."""
    r = residual[there]
    d = None if slopes is None else slopes[:, there]
    return Compared(
        np.concatenate([r.real, r.imag]), None if d is None else np.concatenate([d.real, d.imag], axis=1), taken
    )
