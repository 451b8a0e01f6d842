"""Correlation of frequency response functions: over frequency per DOF pair, and over the DOFs per frequency.

FRFs are (..., n_freq, n_out, n_in); leading axes are a batch (samples of a model, say). Both sets have the same DOFs
in the same order and, but for `fdac`, the same lines.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import finite, fraction, modulus2, ratio, scaled, square
from femend.errors import CorrelationError

__all__ = ["coherence_criterion", "csac", "csf", "faac", "fdac", "frac", "lac", "rvac"]

_LINES, _PLACES, _OUT = -3, (-2, -1), -2


def frac(H_a: ArrayLike, H_b: ArrayLike) -> NDArray[np.float64]:
    """Frequency response assurance criterion of `H_a`, `H_b` (..., n_freq, n_out, n_in): (..., n_out, n_in).

    FRAC_pq = |sum_w H_a conj(H_b)|^2 / (sum_w |H_a|^2 sum_w |H_b|^2) (Heylen and Lammens, ISMA 1996; Allemang 2003,
    "FRAC"): agreement of one FRF in shape over the band, in [0, 1], whatever its scale. NaN where one is 0 at all
    lines. Raises CorrelationError for sizes that do not fit or values that are not finite.

    >>> frac([[[1.0]], [[1j]]], [[[2.0]], [[2j]]]).tolist(), frac([[[1.0]], [[1j]]], [[[1.0]], [[-1j]]]).tolist()
    ([[1.0]], [[0.0]])
    """
    return _shape_agreement(*_frf_pair(H_a, H_b), _LINES)


def faac(H_a: ArrayLike, H_b: ArrayLike) -> NDArray[np.float64]:
    """Frequency amplitude assurance criterion of `H_a`, `H_b` (..., n_freq, n_out, n_in): (..., n_out, n_in).

    FAAC_pq = 2 |sum_w H_a conj(H_b)| / (sum_w |H_a|^2 + sum_w |H_b|^2) (Zang, Schwingshackl and Ewins, Comput. Methods
    Appl. Mech. Eng. 197, 2008): agreement of one FRF in shape and amplitude, in [0, 1]. NaN where both are 0 at all
    lines. Raises CorrelationError for sizes that do not fit or values that are not finite.

    >>> faac([[[1.0]], [[1j]]], [[[2.0]], [[2j]]]).tolist()
    [[0.8]]
    """
    return _scale_agreement(*_frf_pair(H_a, H_b), _LINES)


def csac(H_a: ArrayLike, H_b: ArrayLike) -> NDArray[np.float64]:
    """Cross signature assurance criterion of `H_a`, `H_b` (..., n_freq, n_out, n_in): (..., n_freq) in [0, 1].

    CSAC(w) = |H_a^H H_b|^2 / ((H_a^H H_a)(H_b^H H_b)), with H(w) the vector of all responses to all forces (Dascotte
    and Strobbe, IMAC XVII, 1999; Zang, Grafe and Imregun, Mech. Syst. Signal Process. 15, 2001, 139-155, global shape
    criterion): agreement in shape at one line. NaN where one of them is 0, as an accelerance is at 0 Hz. Raises
    CorrelationError for sizes that do not fit or values that are not finite.

    >>> csac([[[1.0], [1.0]]], [[[2.0], [0.0]]]).round(12).tolist()
    [0.5]
    """
    return _shape_agreement(*_frf_pair(H_a, H_b), _PLACES)


def csf(H_a: ArrayLike, H_b: ArrayLike) -> NDArray[np.float64]:
    """Cross signature scale factor of `H_a`, `H_b` (..., n_freq, n_out, n_in): (..., n_freq) in [0, 1].

    CSF(w) = 2 |H_a^H H_b| / (H_a^H H_a + H_b^H H_b) (Dascotte and Strobbe 1999; Zang et al. 2001, global amplitude
    criterion): agreement in shape and amplitude at one line, 1 only for equal FRFs but for one phase. NaN where both
    are 0. Raises CorrelationError for sizes that do not fit or values that are not finite.

    >>> csf([[[1.0], [1.0]]], [[[2.0], [2.0]]]).tolist()
    [0.8]
    """
    return _scale_agreement(*_frf_pair(H_a, H_b), _PLACES)


def rvac(H_a: ArrayLike, H_b: ArrayLike) -> NDArray[np.float64]:
    """Response vector assurance criterion of `H_a`, `H_b` (..., n_freq, n_out, n_in): (..., n_freq, n_in) in [0, 1].

    RVAC(w, q) = |h_a^H h_b|^2 / ((h_a^H h_a)(h_b^H h_b)), with h the responses to force q (Heylen, Lammens and Sas,
    Modal Analysis Theory and Testing, 1997): the diagonal of FDAC. NaN where one is 0. Raises CorrelationError for
    sizes that do not fit or values that are not finite.

    >>> rvac([[[1.0], [1.0]]], [[[2.0], [0.0]]]).round(12).tolist()
    [[0.5]]
    """
    return _shape_agreement(*_frf_pair(H_a, H_b), _OUT)


def fdac(H_a: ArrayLike, H_b: ArrayLike, *, signed: bool = False) -> NDArray[np.float64]:
    """Frequency domain assurance criterion of `H_a` (n_a, n_out, n_in) with `H_b` (n_b, n_out, n_in): (n_in, n_a, n_b).

    FDAC(w_a, w_b, q) = |h_a^H h_b|^2 / ((h_a^H h_a)(h_b^H h_b)) between the responses at every two lines (Pascual,
    Golinval and Razeto, IMAC XV, 1997); its ridge beside the diagonal is the shift of frequency. `signed` gives
    Re(h_a^H h_b) / (|h_a| |h_b|) in [-1, 1], the later form of the same authors, which also sees the phase. NaN where
    one is 0. Raises CorrelationError for sizes that do not fit or values that are not finite.

    >>> fdac([[[1.0], [1.0]]], [[[2.0], [0.0]], [[-3.0], [-3.0]]]).round(12).tolist()
    [[[0.5, 1.0]]]
    >>> fdac([[[1.0], [1.0]]], [[[-3.0], [-3.0]]], signed=True).round(12).tolist()
    [[[-1.0]]]
    """
    a, b = _frf(H_a, "the first FRF"), _frf(H_b, "the second FRF")
    if a.ndim != 3 or b.ndim != 3 or a.shape[1:] != b.shape[1:]:
        raise CorrelationError(
            f"FRFs of shapes {a.shape} and {b.shape}: FDAC takes (n_freq, n_out, n_in) with the same DOFs in both"
        )
    a, b = scaled(a, _OUT), scaled(b, _OUT)
    a, b = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    top = np.matmul(a.conj(), np.swapaxes(b, -1, -2))
    length2 = square(a, -1)[:, :, None] * square(b, -1)[:, None, :]
    if signed:
        return np.clip(ratio(np.real(top), np.sqrt(length2)), -1.0, 1.0)
    return fraction(modulus2(top), length2)


def coherence_criterion(H_a: ArrayLike, H_b: ArrayLike) -> NDArray[np.float64]:
    """Agreement of each FRF at each line, (..., n_freq, n_out, n_in) in [0, 1], of `H_a` and `H_b` of that shape.

    |H_a + H_b|^2 / (2 (|H_a|^2 + |H_b|^2)) (coherence criterion of frequency-based substructuring; van der Seijs,
    thesis TU Delft, 2016): 1 for equal values, 0 for opposite ones, phase and amplitude both count. NaN where both
    are 0. Raises CorrelationError for sizes that do not fit or values that are not finite.

    >>> coherence_criterion([[[1.0]], [[1.0]]], [[[1.0]], [[1j]]]).tolist()
    [[[1.0]], [[0.5]]]
    """
    a, b = _frf_pair(H_a, H_b)
    a, b = _scaled_alike(a, b)
    return fraction(modulus2(a + b), 2 * (modulus2(a) + modulus2(b)))


def lac(H_a: ArrayLike, H_b: ArrayLike) -> NDArray[np.float64]:
    """Local amplitude criterion, each FRF at each line: (..., n_freq, n_out, n_in) in [0, 1] of `H_a`, `H_b` alike.

    LAC = 2 |H_a conj(H_b)| / (|H_a|^2 + |H_b|^2): the cross signature scale factor (Dascotte and Strobbe 1999) of one
    FRF alone, as frequency-based substructuring uses it. Amplitude counts, phase and sign do not: see
    `coherence_criterion`. NaN where both are 0. Raises CorrelationError for sizes that do not fit or values that are
    not finite.

    >>> lac([[[1.0]], [[1.0]]], [[[2j]], [[-1.0]]]).tolist()
    [[[0.8]], [[1.0]]]
    """
    a, b = _scaled_alike(*_frf_pair(H_a, H_b))
    return fraction(2 * np.abs(a * b.conj()), modulus2(a) + modulus2(b))


def _shape_agreement(a: NDArray[Any], b: NDArray[Any], axis: int | tuple[int, ...]) -> NDArray[np.float64]:
    a, b = scaled(a, axis), scaled(b, axis)
    return fraction(modulus2(np.sum(a.conj() * b, axis=axis)), square(a, axis) * square(b, axis))


def _scale_agreement(a: NDArray[Any], b: NDArray[Any], axis: int | tuple[int, ...]) -> NDArray[np.float64]:
    a, b = _scaled_alike(a, b, *np.atleast_1d(axis).tolist())
    return fraction(2 * np.abs(np.sum(a.conj() * b, axis=axis)), square(a, axis) + square(b, axis))


def _scaled_alike(a: NDArray[Any], b: NDArray[Any], *axes: int) -> NDArray[Any]:
    """Both, one after the other, by one factor along `axes` where squares would leave the range of the numbers."""
    return scaled(np.stack(np.broadcast_arrays(a, b)), (0, *axes))


def _frf(H: ArrayLike, what: str) -> NDArray[np.complex128]:
    array = np.asarray(finite(H, what), dtype=np.complex128)
    if array.ndim < 3:
        raise CorrelationError(
            f"{what} has shape {array.shape}; FRFs are (n_freq, n_out, n_in), one FRF has H[:, None, None]"
        )
    return array


def _frf_pair(H_a: ArrayLike, H_b: ArrayLike) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    a, b = _frf(H_a, "the first FRF"), _frf(H_b, "the second FRF")
    if a.shape[-3:] != b.shape[-3:]:
        raise CorrelationError(
            f"FRFs of shapes {a.shape} and {b.shape} cannot be compared; bring both to the same lines, outputs "
            "and inputs"
        )
    return a, b
