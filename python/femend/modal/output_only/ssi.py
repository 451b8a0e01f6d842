"""Covariance-driven stochastic subspace identification with references: poles and shapes at all orders.

Sources: Peeters and De Roeck, Reference-based stochastic subspace identification for output-only modal analysis,
MSSP 13 (1999) 855-878 (SSI-cov/ref); Döhler and Mevel, Fast multi-order computation of system matrices in
subspace-based system identification, Control Eng. Pract. 20 (2012) 882-894 (one QR for all orders).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

__all__ = ["OrderPoles", "Subspace", "hankel", "order_poles", "subspace"]


def hankel(R: NDArray[np.float64], n_rows: int) -> NDArray[np.float64]:
    """Block Hankel matrix ((n_rows + 1) n_ch, n_rows n_ref) of correlations `R` (2 n_rows, n_ch, n_ref) at lags
    1, 2, ...: block (r, c) is lag r + c + 1, `n_rows` block columns and one block row more.

    >>> hankel(np.arange(1.0, 5.0).reshape(4, 1, 1), 2)
    array([[1., 2.],
           [2., 3.],
           [3., 4.]])
    """
    n_ch, n_ref = R.shape[1:]
    H = np.empty((n_rows + 1, n_ch, n_rows, n_ref))
    for r in range(n_rows + 1):
        H[r] = R[r : r + n_rows].transpose(1, 0, 2)
    return H.reshape((n_rows + 1) * n_ch, n_rows * n_ref)


@dataclass(frozen=True, slots=True, eq=False)
class Subspace:
    """Singular value decomposition H = U S V^T of the block Hankel matrix and what all orders share.

    `U` (m, c), `s` (c,), `V` (c, c) with m = (n_rows + 1) n_ch, c = n_rows n_ref; `Q` (m - n_ch, N), `T` (N, N) the
    QR decomposition of the upper rows of U[:, :N], `W` (N, N) = Q^T times the lower rows; N is the largest order.
    """

    U: NDArray[np.float64]
    s: NDArray[np.float64]
    V: NDArray[np.float64]
    Q: NDArray[np.float64]
    T: NDArray[np.float64]
    W: NDArray[np.float64]
    n_ch: int
    n_rows: int
    dt: float

    @property
    def max_order(self) -> int:
        """The largest order N."""
        return int(self.T.shape[0])


@dataclass(frozen=True, slots=True, eq=False)
class OrderPoles:
    """Poles of one model `order` with positive frequency: discrete eigenvalues `z` (p,), `mu` (p,) = ln z / dt in
    rad/s, right eigenvectors `psi` (order, p) of the state matrix A, rows `chi` (p, order) of the inverse of all
    eigenvectors, all eigenvalues `z_all` (order,), eigenvectors `psi_all` and rows `chi_all` (order, order)."""

    order: int
    z: NDArray[np.complex128]
    mu: NDArray[np.complex128]
    psi: NDArray[np.complex128]
    chi: NDArray[np.complex128]
    z_all: NDArray[np.complex128]
    psi_all: NDArray[np.complex128]
    chi_all: NDArray[np.complex128]
    positions: NDArray[np.int64]


def subspace(R: NDArray[np.float64], n_rows: int, max_order: int, dt: float) -> Subspace:
    """Factorises the block Hankel matrix of correlations `R` (2 n_rows, n_ch, n_ref), step `dt` s, `n_rows` block
    columns, for orders up to `max_order` (less where the matrix has fewer columns)."""
    n_ch = R.shape[1]
    H = hankel(R, n_rows)
    U, s, Vt = linalg.svd(H, full_matrices=False, overwrite_a=True, check_finite=False)
    N = min(max_order, s.size - 1, int(np.count_nonzero(s > 1e-12 * s[0])))
    Q, T = np.linalg.qr(U[:-n_ch, :N])
    return Subspace(U, s, Vt.T, Q, T, Q.T @ U[n_ch:, :N], n_ch, n_rows, dt)


def order_poles(space: Subspace, order: int) -> OrderPoles:
    """Eigenvalues of the state matrix A = O_up^+ O_down of one `order` (Peeters and De Roeck 1999)."""
    A = linalg.solve_triangular(space.T[:order, :order], space.W[:order, :order], check_finite=False)
    z, psi = np.linalg.eig(A)
    z, psi = z.astype(np.complex128), psi.astype(np.complex128)
    chi = np.linalg.inv(psi)
    with np.errstate(divide="ignore"):
        mu = np.log(z) / space.dt
    # One of each conjugate pair, and the poles of a decaying motion only.
    keep = np.flatnonzero((z.imag > 0) & (np.abs(z) < 1))
    return OrderPoles(order, z[keep], mu[keep], psi[:, keep], chi[keep], z, psi, chi, keep)
