"""First-order perturbation of the identified poles and shapes by what single blocks of the recording say.

Each block's Hankel matrix differs from the mean by Delta H; the derivative of the whole identification in that
direction is the block's influence on a pole or shape, and the scatter of the influences over the blocks is its
variance. With T = [vec Delta H_b] this is the first-order propagation J T T^T J^T of Reynders, Pintelon and De Roeck,
Uncertainty bounds on modal parameters obtained from stochastic subspace identification, MSSP 22 (2008) 948-969,
in the form of Döhler and Mevel, Efficient multi-order uncertainty computation for stochastic subspace
identification, MSSP 38 (2013) 346-366 (eqs. 28-37 for the subspace, Lemma 5 for poles and shapes; here the columns of T
are propagated and no Jacobian is formed).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.modal.output_only.ssi import OrderPoles, Subspace, hankel

__all__ = ["BlockEffects", "Influence", "block_effects", "influences", "long_run_variance"]


@dataclass(frozen=True, slots=True, eq=False)
class BlockEffects:
    """What every order needs of the blocks' Delta H = H_b - H, N the largest order, c = n_rows n_ref:

    `outside_q` (n_b, 2 N, N) and `outside_r` (n_b, 2 N, N) products of the part of Delta H V outside the range of H
    with the vectors behind the left pole vectors and the residuals, `outside_c` (n_b, n_ch, N) its first block row;
    `inside_left` (n_b, c, N) = U^T Delta H V_N, `inside_right` (n_b, N, c) = U_N^T Delta H V; `q_in_U`, `r_in_U`
    (2 N, c) the same vectors in the basis U.
    """

    outside_q: NDArray[np.float64]
    outside_r: NDArray[np.float64]
    outside_c: NDArray[np.float64]
    inside_left: NDArray[np.float64]
    inside_right: NDArray[np.float64]
    q_in_U: NDArray[np.float64]
    r_in_U: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Influence:
    """Influence of each block on the poles of one order: `mu` (n_b, p) in rad/s and observed shapes `shape`
    (n_b, n_ch, p), of which the first-order estimate of the block alone would differ from the whole."""

    mu: NDArray[np.complex128]
    shape: NDArray[np.complex128]


def block_effects(space: Subspace, blocks: NDArray[np.float64]) -> BlockEffects:
    """Reduces the `blocks` (n_b, n_lags, n_ch, n_ref) of correlations to small matrices shared by all orders."""
    N, n_ch, U = space.max_order, space.n_ch, space.U
    c = U.shape[1]
    blank = np.zeros((n_ch, N))
    # A left pole vector is [0; l] - z [l; 0] with l in the span of Q; a residual is [O_down psi - z O_up psi; 0].
    q = np.concatenate([np.vstack([blank, space.Q]), np.vstack([space.Q, blank])], axis=1)
    r = np.concatenate([np.vstack([U[n_ch:, :N], blank]), np.vstack([U[:-n_ch, :N], blank])], axis=1)
    q_in_U, r_in_U = q.T @ U, r.T @ U
    left = np.hstack([U, q - U @ q_in_U.T, r - U @ r_in_U.T]).T.copy()
    first = U[:n_ch]
    n_b, mean = blocks.shape[0], blocks.mean(axis=0)
    shape_q = (n_b, 2 * N, N)
    out_q, out_r = np.empty(shape_q), np.empty(shape_q)
    out_c, in_l, in_r = np.empty((n_b, n_ch, N)), np.empty((n_b, c, N)), np.empty((n_b, N, c))
    V_N, U_N = np.ascontiguousarray(space.V[:, :N]), np.ascontiguousarray(U[:, :N].T)
    for b in range(n_b):
        D = hankel(blocks[b] - mean, space.n_rows)
        E = D @ V_N
        products = left @ E
        in_l[b], out_q[b], out_r[b] = products[:c], products[c : c + 2 * N], products[c + 2 * N :]
        out_c[b] = E[:n_ch] - first @ in_l[b]
        in_r[b] = (U_N @ D) @ space.V
    return BlockEffects(out_q, out_r, out_c, in_l, in_r, q_in_U, r_in_U)


def influences(space: Subspace, effects: BlockEffects, found: OrderPoles, which: NDArray[np.int64]) -> Influence:
    """Influence of every block on the poles `which` (positions in `found`) of one order.

    With O = U_n, Delta O = (outside part) S^-1 + U_rest P, P_kj = (s_j u_k^T DH v_j + s_k v_k^T DH^T u_j) /
    (s_j^2 - s_k^2); the part inside U_n is a change of basis that no pole or shape sees.
    Delta A psi = O_up^+ (DO_down psi - z DO_up psi) + (O_up^T O_up)^-1 DO_up^T (O_down psi - z O_up psi).
    """
    n, N = found.order, space.max_order
    s, s_rest = space.s[:n], space.s[n:]
    z, psi = found.z[which], found.psi[:, which]
    mixed = effects.inside_left[:, n:, :n] * s + effects.inside_right[:, :n, n:].transpose(0, 2, 1) * s_rest[:, None]
    P = mixed / (s**2 - s_rest[:, None] ** 2)
    rows = np.r_[0:n, N : N + n]  # the first n vectors of either half
    P_psi, scaled = _times(P, psi), psi / s[:, None]
    D_psi = _times(effects.outside_q[:, rows, :n], scaled) + _left(effects.q_in_U[rows][:, n:], P_psi)
    upward = D_psi[:, :n] - z * D_psi[:, n:]  # Q^T (DO_down psi - z DO_up psi), (n_b, n, p)
    residual = np.concatenate([psi, -z * psi])  # of the vectors O_down, O_up, (2 n, p)
    D_r = _left((1 / s)[:, None] * np.eye(n), _transposed(effects.outside_r[:, rows, :n], residual))
    D_r = D_r + _transposed(P, effects.r_in_U[rows][:, n:].T @ residual)
    T = space.T[:n, :n]
    D_A_psi = _left(np.linalg.inv(T), upward + _left(np.linalg.inv(T).T, D_r))
    modal = _left(found.chi_all, D_A_psi)  # chi_k^T DA psi_i, (n_b, n, p)
    own = found.positions[which]
    D_z = modal[:, own, np.arange(own.size)]
    gaps = z[None, :] - found.z_all[:, None]
    gaps[own, np.arange(own.size)] = np.inf
    D_psi_state = _left(found.psi_all, modal / gaps)
    C = space.U[: space.n_ch]
    D_shape = _times(effects.outside_c[:, :, :n], scaled) + _left(C[:, n:], P_psi) + _left(C[:, :n], D_psi_state)
    return Influence(D_z / (z * space.dt), D_shape)


def long_run_variance(series: NDArray[np.float64]) -> NDArray[np.float64]:
    """Variance of the mean of a zero-mean `series` (n_b, ...) whose neighbours may be correlated.

    Bartlett-weighted autocovariances (Newey and West, A simple, positive semi-definite, heteroskedasticity and
    autocorrelation consistent covariance matrix, Econometrica 55 (1987) 703-708) up to lag n_b^(1/3), with the
    small-sample factor n_b / (n_b - 1).

    >>> float(long_run_variance(np.array([1.0, -1.0])))
    1.0
    """
    n_b = series.shape[0]
    total = np.sum(series**2, axis=0)
    n_lags = int(n_b ** (1 / 3)) if n_b >= 8 else 0
    for k in range(1, n_lags + 1):
        total = total + 2 * (1 - k / (n_lags + 1)) * np.sum(series[k:] * series[:-k], axis=0)
    return np.maximum(total, 0.0) / (n_b * (n_b - 1))


def _times(stack: NDArray[np.float64], right: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """stack (n_b, a, n) real times right (n, p) complex in one real product."""
    p = right.shape[1]
    product = stack @ np.hstack([right.real, right.imag])
    return product[..., :p] + 1j * product[..., p:]


def _transposed(stack: NDArray[np.float64], right: NDArray[np.complex128]) -> NDArray[np.complex128]:
    return _times(stack.transpose(0, 2, 1), right)


def _left(matrix: NDArray, stack: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """matrix (a, n) times every stack (n_b, n, p)."""
    n_b, n, p = stack.shape
    flat = stack.transpose(1, 0, 2).reshape(n, n_b * p)
    if not np.iscomplexobj(matrix):
        out = matrix @ np.ascontiguousarray(flat.real) + 1j * (matrix @ np.ascontiguousarray(flat.imag))
    else:
        out = matrix @ flat
    return out.reshape(-1, n_b, p).transpose(1, 0, 2)
