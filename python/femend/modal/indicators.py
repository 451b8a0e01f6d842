"""Indicators of modes in FRFs, and of how real a shape is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from femend.data import FRF
from femend.modal.lsfd import ModalFit

__all__ = ["cmif", "contributions", "lines_near", "mif", "mpc", "mpd"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def mif(frf: FRF) -> Real:
    """Multivariate mode indicator function, (n_freq, n_in), ascending, in [0, 1]: it dips to 0 at a normal mode.

    At a normal mode some force pattern moves all outputs in quadrature: the least of |Re x|^2 / |x|^2 over force
    patterns (Im for a mobility) is the smallest eigenvalue of A f = lambda (A + B) f with A = Re(H)^T Re(H),
    B = Im(H)^T Im(H) (Williams, Crowley and Vold, IMAC III (1985)). As many indicators dip at one frequency as there
    are modes. Lines without any response give 1. Raises nothing; `frf` may have any kind.
    """
    real, imag = frf.H.real, frf.H.imag
    if frf.kind == "mobility":
        real, imag = imag, real
    A = np.einsum("koi,koj->kij", real, real)
    total = A + np.einsum("koi,koj->kij", imag, imag)
    n_in = A.shape[1]
    found = np.ones((frf.n_freq, n_in))
    for k in range(frf.n_freq):
        size = float(np.trace(total[k]))
        if size > 0:
            found[k] = eigh(A[k], total[k] + 1e-14 * size * np.eye(n_in), eigvals_only=True)
    return np.clip(found, 0.0, 1.0)


def cmif(frf: FRF) -> Real:
    """Complex mode indicator function, (n_freq, min(n_out, n_in)), descending: squared singular values of H per line.

    It peaks at modes; a second value that peaks beside the first shows a close or repeated mode (Shih, Tsuei, Allemang
    and Brown, MSSP 2 (1988) 367-377). Units are those of `frf` squared. Raises nothing.
    """
    return np.asarray(np.linalg.svd(frf.H, compute_uv=False) ** 2)


def mpc(shapes: Complex) -> Real:
    """Modal phase collinearity (n_modes,) of `shapes` (n_dof, n_modes): 1 where all components share one phase.

    |psi^T psi|^2 / (psi^H psi)^2, which is ((a - b) / (a + b))^2 for the principal squares a, b of the components in
    the complex plane (Pappa, Elliott and Schenk, J. Guidance 16 (1993) 852-858). Raises nothing.

    >>> mpc(np.array([[1 + 1j, 1.0], [-2 - 2j, 1j]])).round(6)
    array([1., 0.])
    """
    size = np.sum(np.abs(shapes) ** 2, axis=0)
    return np.asarray(np.abs(np.sum(shapes**2, axis=0)) ** 2 / np.where(size > 0, size, 1.0) ** 2)


def mpd(shapes: Complex) -> Real:
    """Mean phase deviation (n_modes,) in degrees of `shapes` (n_dof, n_modes): 0 for a real shape, at most 45 or so.

    The angle of each component to the common phase line, weighted by its size (Reynders, Houbrechts and De Roeck,
    MSSP 29 (2012) 228-250). Raises nothing.

    >>> mpd(np.array([[1.0 + 0j], [-1.0 + 0j]])).round(6)
    array([0.])
    """
    turned = shapes * np.exp(-0.5j * np.angle(np.sum(shapes**2, axis=0)))
    weight = np.abs(turned)
    angle = np.arctan2(np.abs(turned.imag), np.abs(turned.real))
    total = np.sum(weight, axis=0)
    return np.degrees(np.sum(weight * angle, axis=0) / np.where(total > 0, total, 1.0))


def lines_near(freq: Real, pole: complex, widths: float = 1.0, at_least: int = 3) -> NDArray[np.int64]:
    """Positions of the lines `freq` (n_freq,) in Hz within f (1 ± `widths` zeta) of a `pole` in rad/s: 1 is the
    half-power band; the nearest `at_least` of them where fewer lie there. Raises nothing.

    >>> lines_near(np.arange(10.0), -0.5 + 2j * np.pi * 4).tolist()
    [3, 4, 5]
    """
    f, zeta = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
    lines = np.nonzero(np.abs(freq - f) <= widths * zeta * f)[0]
    if lines.size >= at_least:
        return lines
    return np.sort(np.argsort(np.abs(freq - f), kind="stable")[:at_least])


def contributions(freq: Real, d: int, fit: ModalFit, H: Complex) -> Real:
    """Share (n_modes,) of each mode of `fit` in the squares of H (n_freq, n_out, n_ref) within its half-power band.

    The band is f (1 ± zeta), at least three lines of `freq` (Hz); `d` as in `fit_residues`. A mode that stands alone
    has about 1; close modes of opposite phase can have more. Raises nothing.
    """
    s = 2j * np.pi * freq
    found = np.zeros(fit.poles.size)
    for r, p in enumerate(fit.poles):
        lines = lines_near(freq, p)
        at = s[lines][:, None, None]
        A = np.outer(fit.shapes[:, r], fit.participation[r])
        part = at**d * (A / (at - p) + A.conj() / (at - p.conjugate()))
        whole = float(np.sum(np.abs(H[lines]) ** 2))
        found[r] = float(np.sum(np.abs(part) ** 2)) / whole if whole else 0.0
    return found
