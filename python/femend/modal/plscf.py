"""Poles and participation factors of FRFs for a range of model orders: the pLSCF estimator (PolyMAX).

Peeters, Van der Auweraer, Guillaume and Leuridan, "The PolyMAX frequency-domain method: a new standard for modal
parameter estimation?", Shock and Vibration 11 (2004) 395-409; Guillaume et al., "A poly-reference implementation of
the least-squares complex frequency-domain estimator", IMAC XXI (2003). Numbers in brackets are those of the equations
on the page python/docs/modal.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from femend.errors import RecordingError
from femend.modal.fraction import denominator, lag_sums, roots

__all__ = ["PoleTable", "plscf_poles"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False)
class PoleTable:
    """Poles of all orders, one row each: `order` (n,), `poles` (n,) in rad/s with Im(p) > 0, `participation`
    (n, n_ref) complex with unit length. Unstable poles (Re(p) >= 0) are not in it."""

    order: NDArray[np.int64]
    poles: Complex
    participation: Complex

    @property
    def freq(self) -> Real:
        """Natural frequencies |p| / 2 pi in Hz, (n,)."""
        return np.abs(self.poles) / (2.0 * np.pi)

    @property
    def zeta(self) -> Real:
        """Damping ratios -Re(p) / |p|, (n,)."""
        return -self.poles.real / np.abs(self.poles)


def plscf_poles(freq: Real, H: Complex, max_order: int, *, min_order: int = 2, shift: float | None = None) -> PoleTable:
    """Stable poles inside the band of H for every order from `min_order` to `max_order`.

    `freq` (n_freq,) in Hz increases, `H` (n_freq, n_out, n_ref) is of any kind: a factor s^k changes residues, not
    poles. Rows of H should have comparable noise; n_ref, the size of the denominator, should be the smaller side.
    `shift` in Hz is where the unit circle begins (0 keeps the conjugate poles exact, the band's lower end spreads a
    narrow band over the whole half circle); None chooses: 0 unless the band starts above a tenth of its upper end.

    The right matrix fraction H = B A^-1 (1) in z = exp(i omega dt) (2) is fitted with real coefficients by linear least
    squares (3); the numerators are eliminated with Toeplitz blocks (4), which one FFT gives for evenly spaced lines,
    and A_0 = I is the constraint (5), which turns the mathematical poles unstable (Cauberghe et al., MSSP 19 (2005)
    989-1008). Poles and participation come from the companion matrix (6). The blocks of a lower order are corners of
    those of the highest, so that they are formed once.

    Raises RecordingError for too few lines for the order.

    >>> f = np.linspace(0.0, 20.0, 401)
    >>> p = -0.5 + 60j
    >>> H = (1 / (2j * np.pi * f - p) / 60j - 1 / (2j * np.pi * f - p.conjugate()) / 60j)[:, None, None]
    >>> table = plscf_poles(f, H, 8)
    >>> bool(abs(table.poles[table.order == 8] - p).min() < 0.005)
    True
    """
    n_ref = H.shape[2]
    if freq.size < 2 * (max_order + 1):
        raise RecordingError(
            f"pLSCF of order {max_order} needs at least {2 * (max_order + 1)} frequency lines, the band has "
            f"{freq.size}; widen the band or lower max_order"
        )
    if shift is None:
        shift = 0.0 if freq[0] < 0.1 * freq[-1] else float(freq[0])
    theta = np.pi * (freq - shift) / (freq[-1] - shift)
    dt = 1.0 / (2.0 * (freq[-1] - shift))
    T, V = _reduced_blocks(theta, H, max_order)
    subtracted = np.zeros_like(T)
    found: list[tuple[int, Complex, Complex]] = []
    for n in range(max_order + 1):
        rows = V[:, n, :]
        subtracted += rows.T @ rows
        if n < min_order:
            continue
        size = (n + 1) * n_ref
        M = T[:size, :size] - subtracted[:size, :size]
        z, w = _poles_of(denominator(M, n_ref), n_ref)
        s = np.log(z) / dt
        inside = (s.real < 0) & (s.imag > 0) & (s.imag < np.pi / dt * (1 - 1e-9))
        poles = s[inside] + 2j * np.pi * shift
        inband = (poles.imag >= 2 * np.pi * freq[0]) & (poles.imag <= 2 * np.pi * freq[-1])
        found.append((n, poles[inband], w[:, inside].T[inband]))
    return PoleTable(
        np.concatenate([np.full(p.size, n, dtype=np.int64) for n, p, _ in found]),
        np.concatenate([p for _, p, _ in found]),
        np.concatenate([w for _, _, w in found]),
    )


def _reduced_blocks(theta: Real, H: Complex, n: int) -> tuple[Real, Real]:
    """sum_o T_o, and the rows V_o = L^-1 S_o with R = L L^T, for order n (equation 4)."""
    n_out, n_ref = H.shape[1:]
    lag = np.arange(n + 1)[None, :] - np.arange(n + 1)[:, None] + n  # position of lag s - r
    R = lag_sums(theta, np.ones(theta.size), n).real[lag]
    power = np.einsum("koi,koj->kij", H.conj(), H, optimize=True)
    T = lag_sums(theta, power, n).real[lag].transpose(0, 2, 1, 3).reshape((n + 1) * n_ref, (n + 1) * n_ref)
    S = -lag_sums(theta, H, n).real[lag]  # (n+1, n+1, n_out, n_ref)
    flat = np.ascontiguousarray(S.transpose(0, 2, 1, 3)).reshape(n + 1, -1)
    # a part of the circle without lines leaves R singular to rounding at high order
    L = cholesky(R + 1e-12 * R[0, 0] * np.eye(n + 1), lower=True)
    V = solve_triangular(L, flat, lower=True).reshape(n + 1, n_out, (n + 1) * n_ref)
    return T, np.ascontiguousarray(V.transpose(1, 0, 2))


def _poles_of(coefficients: Real, n_ref: int) -> tuple[Complex, Complex]:
    """z with w^T sum_r A_r z^r = 0 and w (n_ref, n) of unit length, for A_1 .. A_n stacked (n n_ref, n_ref)."""
    mu, w = roots(coefficients.reshape(-1, n_ref, n_ref).transpose(0, 2, 1))
    keep = np.abs(mu) > 1e-12
    length = np.linalg.norm(w[:, keep], axis=0)
    return 1.0 / mu[keep], w[:, keep] / np.where(length > 0, length, 1.0)
