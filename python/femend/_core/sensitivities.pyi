"""Projections and sensitivities of modes and FRFs, Ritz bases."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from femend._core.linear import Symbolic

_Indices: TypeAlias = NDArray[np.int32] | NDArray[np.int64]

def modal_projections(
    indptr: _Indices, indices: _Indices, values: NDArray[np.float64], phi: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Phi^T A_p Phi (n_p, r, r) of the symmetric matrices with `values` (n_p, nnz) on one pattern; phi (n, r)."""

def eigen_sensitivities(
    indptr: _Indices,
    indices: _Indices,
    dk: NDArray[np.float64],
    dm: NDArray[np.float64] | None,
    eigenvalues: NDArray[np.float64],
    phi: NDArray[np.float64],
    gap: float = 1e-8,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """d lambda/dp (n_p, n_modes) in (rad/s)^2 and the cluster number of each mode (n_modes,).

    `dk`, `dm` (n_p, nnz) on the pattern; `eigenvalues` (n_modes,) rising, `phi` (n, n_modes) M-normalised. Modes nearer
    than `gap` (relative in lambda) share a number; their derivatives are those of the branches, rising (Fox and
    Kapoor 1968, Lancaster 1964). Raises ValueError for shapes that do not fit.
    """

def shape_sensitivities(
    indptr: _Indices,
    indices: _Indices,
    k: NDArray[np.float64],
    m: NDArray[np.float64],
    dk: NDArray[np.float64],
    dm: NDArray[np.float64] | None,
    eigenvalues: NDArray[np.float64],
    phi: NDArray[np.float64],
    gap: float = 1e-8,
    *,
    ordering: str = "auto",
    symbolic: Symbolic | None = None,
) -> NDArray[np.float64]:
    """d phi/dp (n_p, n, n_modes), exact (Nelson 1976); `phi` must be all modes up to the last.

    Inside a cluster of coinciding modes the derivative is that of an M-orthonormal basis of their subspace. Raises
    ValueError for shapes that do not fit, or where a mode that is not in `phi` lies at or below one that is.
    """

def frf_modal_sensitivities(
    omega: NDArray[np.float64],
    zeta: NDArray[np.float64],
    phi_out: NDArray[np.float64],
    phi_in: NDArray[np.float64],
    a: NDArray[np.float64],
    b: NDArray[np.float64] | None,
    s: NDArray[np.complex128],
    kind: str = "receptance",
) -> NDArray[np.complex128]:
    """dH/dp (n_p, n_lines, n_out, n_in) of `frf_modal` with each mode's zeta held.

    `a`, `b` (n_p, r, r) are Phi^T dK Phi and Phi^T dM Phi. Exact for a complete set of modes, such as that of a Ritz
    basis. Raises ValueError for shapes that do not fit or a line on an undamped pole.
    """

def frf_direct_sensitivities(
    indptr: _Indices,
    indices: _Indices,
    k: NDArray[np.float64],
    m: NDArray[np.float64],
    dk: NDArray[np.float64],
    dm: NDArray[np.float64] | None,
    b_out: NDArray[np.float64],
    b_in: NDArray[np.float64],
    s: NDArray[np.complex128],
    kind: str = "receptance",
    *,
    c: NDArray[np.float64] | None = None,
    h: NDArray[np.float64] | None = None,
    dc: NDArray[np.float64] | None = None,
    dh: NDArray[np.float64] | None = None,
) -> NDArray[np.complex128]:
    """Exact dH/dp = -X_out^T dZ X_in, (n_p, n_lines, n_out, n_in), Z = K + iH + sC + s^2 M solved on every line."""

def ritz_basis(
    indptr: _Indices,
    indices: _Indices,
    k: NDArray[np.float64],
    m: NDArray[np.float64],
    loads: NDArray[np.float64],
    *,
    f_max: float | None = None,
    n_modes: int | None = None,
    dk: NDArray[np.float64] | None = None,
    dm: NDArray[np.float64] | None = None,
    drop: float = 1e-6,
    ordering: str = "auto",
    symbolic: Symbolic | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """M-orthonormal basis (n, r) and the frequencies in Hz of the modes it starts with.

    After the modes (up to `f_max` or `n_modes`) come the static responses to the columns of `loads` (n, n_b) beside
    them and the static derivative vectors of every mode for each parameter in `dk`, `dm` (n_p, nnz). Vectors whose new
    part is below `drop` of themselves are left out. Raises as `modes` and `residual_vectors`.
    """
