"""Least squares in the frequency domain (LSFD): residues and residual terms of FRFs with known poles.

The modal model of an FRF row of kind d (0 receptance, 1 mobility, 2 accelerance), s = i omega (equation 7):

    H(s) = s^d ( sum_r psi_r l_r^T / (s - p_r) + conj(psi_r) l_r^H / (s - conj p_r) + LR / s^2 + UR )

with real residual terms LR for the modes below and UR for those above the band. It is linear in psi, LR and UR, and all
outputs share one matrix, so that one QR factorisation serves them all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["RESIDUALS", "ModalFit", "derivative_power", "fit_residues", "synthesise"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

RESIDUALS = ("both", "upper", "lower", "none")
_POWER = {"receptance": 0, "mobility": 1, "accelerance": 2}


def derivative_power(kind: str) -> int:
    """d of s^d between a receptance and an FRF of `kind`.

    >>> derivative_power("accelerance")
    2
    """
    return _POWER[kind]


@dataclass(frozen=True, slots=True, eq=False)
class ModalFit:
    """A modal model of FRFs: `poles` (n_modes,) rad/s, `shapes` (n_out, n_modes), `participation` (n_modes, n_ref),
    residual terms `lower` and `upper` (n_out, n_ref) of the receptance (zero where not fitted)."""

    poles: Complex
    shapes: Complex
    participation: Complex
    lower: Real
    upper: Real


def columns(freq: Real, d: int, poles: Complex, participation: Complex, residuals: str = "both") -> Real:
    """Real matrix of the modal model, (2 n_freq n_ref, 2 n_modes + residual terms): Re rows, then Im rows."""
    s = 2j * np.pi * freq
    scale = s**d
    n_modes, n_ref = participation.shape
    g = scale[:, None] / (s[:, None] - poles[None, :])
    h = scale[:, None] / (s[:, None] - poles.conj()[None, :])
    a = g[:, None, :] * participation.T[None, :, :]
    b = h[:, None, :] * participation.conj().T[None, :, :]
    parts = np.empty((freq.size, n_ref, 2 * n_modes), dtype=np.complex128)
    parts[:, :, 0::2] = a + b
    parts[:, :, 1::2] = 1j * (a - b)
    blocks = [parts]
    for name, term in (("lower", scale / s**2), ("upper", scale)):
        if residuals in (name, "both"):
            blocks.append(term[:, None, None] * np.eye(n_ref)[None])
    full = np.concatenate(blocks, axis=2).reshape(freq.size * n_ref, -1)
    return np.concatenate([full.real, full.imag])


def stacked(H: Complex) -> Real:
    """H (n_freq, n_out, n_ref) as real right-hand sides (2 n_freq n_ref, n_out) that fit `columns`."""
    flat = H.transpose(0, 2, 1).reshape(-1, H.shape[1])
    return np.concatenate([flat.real, flat.imag])


def fit_residues(
    freq: Real, H: Complex, d: int, poles: Complex, participation: Complex, residuals: str = "both"
) -> ModalFit:
    """Shapes and residual terms of H by linear least squares with given poles and participation (equation 7).

    `freq` (n_freq,) in Hz without 0, `H` (n_freq, n_out, n_ref) of kind s^d times receptance, `poles` (n_modes,) in
    rad/s with Im(p) > 0, `participation` (n_modes, n_ref); `residuals` is one of RESIDUALS. Raises nothing.

    >>> f, p = np.linspace(1.0, 10.0, 50), np.array([-0.3 + 30j])
    >>> s = 2j * np.pi * f
    >>> H = (2j / (s - p) + -2j / (s - p.conj()) + 0.5)[:, None, None]
    >>> fit = fit_residues(f, H, 0, p, np.ones((1, 1)), "upper")
    >>> bool(abs(fit.shapes[0, 0] - 2j) < 1e-9), bool(abs(fit.upper[0, 0] - 0.5) < 1e-9)
    (True, True)
    """
    Phi = columns(freq, d, poles, participation, residuals)
    size = np.linalg.norm(Phi, axis=0)
    x = np.linalg.lstsq(Phi / size, stacked(H), rcond=None)[0] / size[:, None]
    return unpack(x, poles, participation, residuals)


def unpack(x: Real, poles: Complex, participation: Complex, residuals: str) -> ModalFit:
    """The modal model from coefficients x (n_columns, n_out) of `columns`."""
    n_modes, n_ref = participation.shape
    n_out = x.shape[1]
    shapes = (x[0 : 2 * n_modes : 2] + 1j * x[1 : 2 * n_modes : 2]).T
    terms = {"lower": np.zeros((n_out, n_ref)), "upper": np.zeros((n_out, n_ref))}
    at = 2 * n_modes
    for name in ("lower", "upper"):
        if residuals in (name, "both"):
            terms[name] = x[at : at + n_ref].T
            at += n_ref
    return ModalFit(poles, shapes, participation, terms["lower"], terms["upper"])


def synthesise(freq: Real, d: int, fit: ModalFit) -> Complex:
    """H (n_freq, n_out, n_ref) of the modal model `fit` at `freq` in Hz (not 0), kind s^d times receptance."""
    s = 2j * np.pi * freq
    g = fit.shapes[None] / (s[:, None, None] - fit.poles)
    h = fit.shapes.conj()[None] / (s[:, None, None] - fit.poles.conj())
    H = g @ fit.participation + h @ fit.participation.conj()
    H += fit.upper[None] + fit.lower[None] / (s**2)[:, None, None]
    return np.asarray(H * (s**d)[:, None, None])
