"""Sparse factors, modes, FRFs, residual vectors."""

from collections.abc import Sequence
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Indices: TypeAlias = NDArray[np.int32] | NDArray[np.int64]

@final
class Symbolic:
    """Ordering and symbolic factor of a symmetric pattern (both triangles, sorted): computed once, used often."""

    def __new__(cls, indptr: _Indices, indices: _Indices, ordering: str = "auto") -> Symbolic: ...
    @property
    def ordering(self) -> str: ...
    @property
    def flops(self) -> float: ...
    @property
    def nnz(self) -> int: ...
    @property
    def memory(self) -> int: ...
    def modes_memory(self, n_modes: int | None = None, check: bool = True) -> int: ...

@final
class Factor:
    """Factor of a sparse symmetric matrix: Cholesky where positive definite, else with 1x1 and 2x2 pivots."""

    def __new__(
        cls,
        indptr: _Indices,
        indices: _Indices,
        values: NDArray[np.float64],
        ordering: str = "auto",
        *,
        symbolic: Symbolic | None = None,
        indefinite: bool | None = None,
    ) -> Factor: ...
    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]: ...
    @property
    def inertia(self) -> int: ...
    @property
    def flops(self) -> float: ...
    @property
    def nnz(self) -> int: ...
    @property
    def probe(self) -> float: ...
    @property
    def kind(self) -> str: ...

@final
class ComplexProblem:
    """Complex modes of M u'' + (C + W G) u' + (K + W N + W^2 S + i D) u = 0 at any number of speeds W in rad/s.

    `k`, `m` (nnz,) and the values of the `terms` lie on the symmetric pattern `indptr`, `indices`; a term is (what it
    belongs to: "K", "C", "M" or "D"; the power of W that goes with it; values, symmetric or not). The lowest
    `n_modes` by |pole|, or all up to `f_max` in Hz. The stiffness at `speed` is factorised. `tolerance` bounds
    |D(pole) psi| beside the sum of the norms of its terms, `left_tolerance` the same of left vectors. Raises as
    `modes`.
    """

    def __new__(
        cls,
        indptr: _Indices,
        indices: _Indices,
        k: NDArray[np.float64],
        m: NDArray[np.float64],
        terms: Sequence[tuple[str, int, NDArray[np.float64]]],
        n_modes: int | None = None,
        f_max: float | None = None,
        *,
        speed: float = 0.0,
        tolerance: float = 1e-8,
        left_tolerance: float = 1e-8,
        symbolic: Symbolic | None = None,
    ) -> ComplexProblem: ...
    def modes(self, speed: float = 0.0) -> dict[str, Any]:
        """Modes at `speed`: `poles` (m,), `kinds` ("rigid", "oscillatory", "overdamped", "mirrored"), `right` and
        `left` (n, m), `modal_a`, `residual`, `residual_left`, `condition` (m,), and `sigma`, `counted`, `n_rigid`,
        `n_late`, `vectors`, `solves`, `rounds`. Raises ConvergenceError, and ValueError where fewer modes oscillate
        than asked for.
        """

    def receptance(
        self,
        b_out: NDArray[np.float64],
        b_in: NDArray[np.float64],
        s: NDArray[np.complex128],
        speed: float = 0.0,
        *,
        tolerance: float = 1e-9,
    ) -> NDArray[np.complex128]:
        """b_out^T D(s)^-1 b_in, (n_s, n_out, n_in), for `b_out` (n, n_out), `b_in` (n, n_in) at `s` (n_s,) in rad/s,
        from the space of the modes, enlarged until |b_in - D(s) u| <= `tolerance` |b_in|. Raises ConvergenceError.
        """

def modes(
    indptr: _Indices,
    indices: _Indices,
    k: NDArray[np.float64],
    m: NDArray[np.float64],
    n_modes: int | None = None,
    f_max: float | None = None,
    sigma: float | None = None,
    *,
    start: NDArray[np.float64] | None = None,
    check: bool = True,
    ordering: str = "auto",
    symbolic: Symbolic | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], dict[str, Any]]: ...
def frf_modal(
    omega: NDArray[np.float64],
    zeta: NDArray[np.float64],
    phi_out: NDArray[np.float64],
    phi_in: NDArray[np.float64],
    s: NDArray[np.complex128],
    kind: str = "receptance",
    residual: NDArray[np.float64] | NDArray[np.complex128] | None = None,
    *,
    out: NDArray[np.complex128] | None = None,
) -> NDArray[np.complex128]: ...
def frf_modal_scores(
    omega: NDArray[np.float64],
    zeta: NDArray[np.float64],
    phi_out: NDArray[np.float64],
    phi_in: NDArray[np.float64],
    s: NDArray[np.complex128],
    measured: NDArray[np.complex128],
    kind: str = "receptance",
    residual: NDArray[np.float64] | NDArray[np.complex128] | None = None,
) -> dict[str, Any]:
    """Agreement of what `frf_modal` would return with `measured` (n_lines, n_out, n_in), never stored.

    `frac` and `faac` (n_out, n_in), `csac` and `csf` (n_lines,), defined as in `femend.correlate`; `misfit`, the sum of
    |H - measured|^2. NaN where an FRF is zero. Raises ValueError for shapes that do not fit or an undamped pole.
    """

def frf_reduced(
    indptr: _Indices,
    indices: _Indices,
    matrices: NDArray[np.float64],
    coefficients: NDArray[np.complex128],
    b_out: NDArray[np.float64],
    b_in: NDArray[np.float64],
    s: NDArray[np.complex128],
    kind: str = "receptance",
    *,
    tolerance: float = 1e-6,
    max_solutions: int = 60,
) -> tuple[NDArray[np.complex128], dict[str, Any]]:
    """FRFs (n_lines, n_out, n_in) of sum_t c_t A_t by reduced direct solution, and an account of it.

    `matrices` (n_t, nnz) real symmetric on one pattern, `coefficients` (n_t, n_lines): 1 for K, s for viscous, i for
    structural damping, s^2 for M, any function of the line for a viscoelastic part. Some lines are solved directly; all
    others are solved in the space of those solutions and their slopes (rational Krylov; Beattie and Gugercin 2009).

    The account holds `converged`; `error`, the true error beside the largest magnitude, measured on the lines with the
    largest residual of all before they joined; `residual`, the largest ||B - Z X|| / ||B||; `solved`, the lines solved
    directly; `basis`, its size. Raises ValueError for shapes that do not fit or a singular line.
    """

def frf_direct(
    indptr: _Indices,
    indices: _Indices,
    k: NDArray[np.float64],
    m: NDArray[np.float64],
    b_out: NDArray[np.float64],
    b_in: NDArray[np.float64],
    s: NDArray[np.complex128],
    kind: str = "receptance",
    *,
    c: NDArray[np.float64] | None = None,
    h: NDArray[np.float64] | None = None,
) -> NDArray[np.complex128]: ...
def residual_vectors(
    indptr: _Indices,
    indices: _Indices,
    k: NDArray[np.float64],
    m: NDArray[np.float64],
    phi: NDArray[np.float64],
    b: NDArray[np.float64],
    *,
    ordering: str = "auto",
    symbolic: Symbolic | None = None,
) -> NDArray[np.float64]: ...
