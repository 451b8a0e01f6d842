"""Poly-reference least-squares complex frequency estimation on half spectra.

Sources: Peeters and Van der Auweraer, PolyMAX: a revolution in operational modal analysis, IOMAC (2005)
(half spectra, right matrix fraction, reduced normal equations); Peeters et al., The PolyMAX frequency-domain method,
Shock and Vibration 11 (2004) 395-409; Cauberghe, Guillaume, Verboven, Parloo and Vanlanduit, A poly-reference
implementation of the maximum likelihood complex frequency-domain estimator, IMAC (2004) (which coefficient is fixed).

The half spectrum of references is S+(w) = sum_k R(k) e^(-beta k dt) e^(-i w k dt), k = 1, 2, ...; with R(k) =
sum_r phi_r g_r^T e^(mu_r k dt) + conjugate it is a sum of phi_r g_r^T z_r / (e^(i w dt) - z_r), z_r = e^((mu_r - beta)
dt): exactly rational, and the exponential window is a known shift of every pole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.modal.fraction import denominator, lag_sums, roots

__all__ = ["FractionPoles", "HalfSpectrum", "fraction_poles", "half_spectrum"]

# The exponential window ends at this value: what is cut off the correlations is below the noise of the estimate.
WINDOW_END = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class HalfSpectrum:
    """`S` (n_freq, n_ch, n_ref) at `freq` (n_freq,) in Hz from correlations at steps of `dt` s windowed by
    e^(-`beta` t), beta in 1/s."""

    freq: NDArray[np.float64]
    S: NDArray[np.complex128]
    dt: float
    beta: float


@dataclass(frozen=True, slots=True, eq=False)
class FractionPoles:
    """Poles `mu` (p,) in rad/s of a matrix fraction with `order` poles, the window taken out, with the `shapes`
    (n_ch, p) of each."""

    order: int
    mu: NDArray[np.complex128]
    shapes: NDArray[np.complex128]


def half_spectrum(R: NDArray[np.float64], band: tuple[float, float], dt: float) -> HalfSpectrum:
    """Half spectrum inside `band` (Hz) of correlations `R` (n_lags, n_ch, n_ref) at lags 1, 2, ... of `dt` s."""
    n_lags = R.shape[0]
    beta = -np.log(WINDOW_END) / (n_lags * dt)
    lags = dt * np.arange(1, n_lags + 1)
    # Padded to twice the lags: lines closer than that carry nothing new.
    windowed = np.concatenate([np.zeros((1, *R.shape[1:])), R * np.exp(-beta * lags)[:, None, None]])
    S = np.fft.rfft(windowed, 2 * n_lags, axis=0)
    freq = np.arange(S.shape[0]) / (2 * n_lags * dt)
    inside = within_band(freq, band) & (freq > 0)
    return HalfSpectrum(freq[inside], S[inside], dt, beta)


def fraction_poles(half: HalfSpectrum, degrees: list[int], n_rows: int) -> list[FractionPoles]:
    """Poles of right matrix fractions S+ = B A^-1 of polynomial `degrees` in z = e^(s tau), tau = 1 / (2 bandwidth).

    The coefficients are complex and the frequencies count from the lower edge, so that only modes of the band are
    modelled. The denominator is estimated from the `n_rows` strongest combinations of the outputs; the coefficient of
    z^0 is the identity, which leaves noise poles with growing motion.
    """
    n_freq, n_ch, n_ref = half.S.shape
    flat = half.S.transpose(1, 0, 2).reshape(n_ch, -1)
    weights = np.linalg.eigh(flat @ flat.conj().T)[1][:, ::-1][:, :n_rows]
    rows = np.matmul(weights.conj().T, half.S)
    top, span = max(degrees), half.freq[-1] - half.freq[0]
    # On even lines X^H diag(h) X is Toeplitz in the powers: 2 top + 1 sums hold each product of the normal equations.
    theta = np.pi * (half.freq - half.freq[0]) / span
    at = np.arange(top + 1)[None, :] - np.arange(top + 1)[:, None] + top
    XX = lag_sums(theta, np.ones(n_freq), top)[at]
    XY = _blocks(lag_sums(theta, half.S, top), at)
    square = np.matmul(rows.conj().transpose(0, 2, 1), rows)
    YY = lag_sums(theta, square, top)[at].transpose(0, 2, 1, 3).reshape((top + 1) * n_ref, -1)
    return [_of_degree(half, n, XX, np.tensordot(weights.conj().T, XY, axes=1), YY, XY) for n in degrees]


def _blocks(values: NDArray[np.complex128], at: NDArray[np.int64]) -> NDArray[np.complex128]:
    """X^H Y of each output (n_ch, top + 1, (top + 1) n_ref) from `values` (2 top + 1, n_ch, n_ref)."""
    k = at.shape[0]
    return values[at].transpose(2, 0, 1, 3).reshape(values.shape[1], k, -1)


def _of_degree(
    half: HalfSpectrum,
    degree: int,
    XX: NDArray[np.complex128],
    XY: NDArray[np.complex128],
    YY: NDArray[np.complex128],
    all_XY: NDArray[np.complex128],
) -> FractionPoles:
    """Poles of one degree from the normal equations of the largest: blocks of them are those of a smaller degree."""
    n_ref = half.S.shape[2]
    k, m = degree + 1, (degree + 1) * n_ref
    solved = np.linalg.solve(XX[:k, :k], np.concatenate([XY[:, :k, :m], all_XY[:, :k, :m]]))
    n_rows = XY.shape[0]
    M = YY[:m, :m] - np.tensordot(XY[:, :k, :m].conj(), solved[:n_rows], axes=([0, 1], [0, 1]))
    alpha = np.concatenate([np.eye(n_ref), denominator(0.5 * (M + M.conj().T), n_ref)])
    # A(z) = sum_j alpha_j z^j with alpha_0 = I
    inverse_z, vectors = roots(alpha.reshape(k, n_ref, n_ref)[1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        log_z = -np.log(inverse_z)
        tau = 0.5 / (half.freq[-1] - half.freq[0])
        mu = log_z / tau + 2j * np.pi * half.freq[0]
    stable = np.isfinite(mu) & (mu.real < 0) & (log_z.imag >= 0)
    mu, v, z = mu[stable], vectors[:, stable], np.exp(log_z[stable])
    # v is the null vector of A(z); the shape is B(z) v, B = XX^-1 XY alpha.
    B = np.matmul(solved[n_rows:], alpha)
    powers = z[None, :] ** np.arange(k)[:, None]
    shapes = np.einsum("okr,kp,rp->op", B, powers, v, optimize=True)
    return FractionPoles(degree * n_ref, mu + half.beta, shapes)
