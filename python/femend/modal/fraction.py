"""What matrix fractions in z = exp(i theta) need, whatever they are fitted to: FRFs or half spectra.

Peeters, Van der Auweraer, Guillaume and Leuridan, Shock and Vibration 11 (2004) 395-409; the numbers in brackets are
those of the equations on the page python/docs/modal.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

__all__ = ["denominator", "lag_sums", "roots"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def lag_sums(theta: Real, x: NDArray[Any], n: int) -> Complex:
    """sum_k x_k exp(i theta_k l) for l = -n..n along the first axis of `x` (K, ...), for angles `theta` (K,).

    By FFT on evenly spaced lines, else as a sum. On them the products of the normal equations are Toeplitz (4).
    """
    N = theta.size
    step = np.diff(theta)
    first = theta[0] / step.mean() if N > 1 else 0.0
    even = bool(np.ptp(step) < 1e-6 * step.mean()) and abs(first - round(first)) < 1e-6
    if even:
        offset = int(round(first))
        length = 2 * int(round(np.pi / step.mean()))
        if length >= 2 * n + 1:
            spread = np.zeros((max(length, offset + N), *x.shape[1:]), dtype=np.complex128)
            spread[offset : offset + N] = x
            if spread.shape[0] > length:  # the line at the end of the circle
                spread[: spread.shape[0] - length] += spread[length:]
                spread = spread[:length]
            sums = np.fft.ifft(spread, axis=0) * length
            return np.asarray(sums[np.arange(-n, n + 1)], dtype=np.complex128)
    kernel = np.exp(1j * np.outer(np.arange(-n, n + 1), theta))
    return np.asarray(np.tensordot(kernel, x, axes=(1, 0)), dtype=np.complex128)


def denominator(M: NDArray[Any], n_ref: int) -> NDArray[Any]:
    """Coefficients A_1 .. A_n, stacked (n n_ref, n_ref), that minimise tr(A^H M A) with A_0 = I (5), for a positive
    matrix `M` ((n + 1) n_ref, (n + 1) n_ref), real or complex."""
    A, b = M[n_ref:, n_ref:], -M[n_ref:, :n_ref]
    try:
        return np.asarray(cho_solve(cho_factor(A, check_finite=False), b, check_finite=False))
    except LinAlgError:  # noise-free data: more order than the data have content
        return np.asarray(np.linalg.lstsq(A, b, rcond=1e-13)[0])


def roots(blocks: NDArray[Any]) -> tuple[Complex, Complex]:
    """1/z and v (q, n) with (I + sum_r A_r z^r) v = 0, from the companion matrix in 1/z (6) of `blocks` A_1 .. A_n
    (n, q, q), real or complex. The vectors have no particular length; 1/z may be 0.

    >>> inverse, v = roots(np.array([[[-0.5]]]))
    >>> complex(inverse[0])
    (0.5+0j)
    """
    n, q = blocks.shape[:2]
    companion = np.zeros((n * q, n * q), dtype=blocks.dtype)
    companion[:q] = -blocks.transpose(1, 0, 2).reshape(q, n * q)
    companion[np.arange(q, n * q), np.arange((n - 1) * q)] = 1.0
    inverse, vectors = np.linalg.eig(companion)
    return inverse.astype(np.complex128), vectors[-q:].astype(np.complex128)
