from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, TypeAlias, TypedDict, final

import numpy as np
from numpy.typing import NDArray

__version__: str

_Indices: TypeAlias = NDArray[np.int32] | NDArray[np.int64]

class _SimulationStatus(TypedDict):
    """How a simulation went.

    `converged` is False where a step failed; then `failed_at` is the first kept sample that was not computed (NaN from
    there on) and `advice` says what to do. `n_static_modes` modes were too fast for the substep and followed their
    force statically. `added_compliance` (0 to 1) is the share of the stabilising compliance that a stiff law asked for.
    """

    converged: bool
    failed_at: int | None
    advice: str
    n_iterations: int
    n_static_modes: int
    added_compliance: float

_LawSpec: TypeAlias = tuple[str, Mapping[str, float] | Sequence[float] | NDArray[np.float64]]
_Histories: TypeAlias = tuple[
    NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], _SimulationStatus
]
_Branch: TypeAlias = tuple[
    NDArray[np.float64],
    NDArray[np.complex128],
    NDArray[np.complex128],
    NDArray[np.complex128],
    list[tuple[int, bool]],
    str,
    int,
]

def simulate(
    omega: NDArray[np.float64],
    zeta: NDArray[np.float64],
    phi_in: NDArray[np.float64],
    phi_out: NDArray[np.float64],
    w: NDArray[np.float64],
    laws: Sequence[Sequence[_LawSpec]],
    u: NDArray[np.float64],
    dt: float,
    *,
    substeps: int = 1,
    stride: int = 1,
    output: str = "acceleration",
    residual_compliance: NDArray[np.float64] | None = None,
) -> _Histories:
    """Response from rest of a modal model whose coordinates `w` carry laws, closed loop.

    Parameters: `omega` (r,) rad/s, `zeta` (r,), mass-normalised `phi_in` (n_in, r), `phi_out` (n_out, r), `w` (n_w, r)
    with n_w <= 6; `laws` one list of (name, parameters) for each row of w, their forces add up; `u` (n_in, n) in N at
    steps of `dt` s, linear between samples; each step is cut into `substeps`; every `stride`-th sample is kept.
    `output` is "displacement", "velocity" or "acceleration" (with the instantaneous effect of the forces there).
    `residual_compliance` (n_w, n_w) m/N is the static compliance of the omitted modes at w.

    Returns y (n_out, n_kept), d, v, f (n_w, n_kept) and a status; f acts against the motion:
    M q'' + C q' + K q = f_ext - w f. Raises `LawParameterError` and ValueError.

    Modes are stepped exactly for linear forces (Van Loan 1978); the law's force is implicit at the end of a substep.
    """

def simulate_tangents(
    omega: NDArray[np.float64],
    zeta: NDArray[np.float64],
    phi_in: NDArray[np.float64],
    phi_out: NDArray[np.float64],
    w: NDArray[np.float64],
    laws: Sequence[Sequence[_LawSpec]],
    wanted: Sequence[bool],
    u: Sequence[NDArray[np.float64]],
    dt: float,
    *,
    substeps: int = 1,
    stride: int = 1,
    output: str = "acceleration",
    residual_compliance: NDArray[np.float64] | None = None,
) -> list[tuple[_Histories, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]:
    """`simulate` for every record, with dy/dp (n_wanted, n_out, n_kept) and df/dp (n_wanted, n_w, n_kept) over the law
    parameters that are `wanted` (n_p,), and y (n_moved, n_out, n_kept) and f (n_moved, n_w, n_kept) of models moved a
    little, the laws linear around the motion of the first. Every substep is differentiated.

    The modal arrays have one row (of `omega`, `zeta`) or matrix for the model and one for each moved model after it.
    Parameters are those of all laws in the order given, each in the order of `law_library`. With `phi_out` of no rows
    only df is computed, from which outputs follow as the response to -w f. The derivative over `sides` is zero.
    """

def simulate_batch(
    omega: NDArray[np.float64],
    zeta: NDArray[np.float64],
    phi_in: NDArray[np.float64],
    phi_out: NDArray[np.float64],
    w: NDArray[np.float64],
    laws: Sequence[Sequence[Sequence[_LawSpec]]],
    u: Sequence[NDArray[np.float64]],
    dt: float,
    *,
    substeps: int = 1,
    stride: int = 1,
    output: str = "acceleration",
    residual_compliance: NDArray[np.float64] | None = None,
) -> list[list[_Histories]]:
    """`simulate` for every set of laws and every record on all cores: result[set][record].

    Each of omega, zeta (r,) and phi_in, phi_out, w (n, r) may have a further first axis with one entry for each set.
    Records (n_in, n) may differ in length.
    """

def harmonic_branches(
    omega: NDArray[np.float64],
    zeta: NDArray[np.float64],
    phi_in: NDArray[np.float64],
    phi_out: NDArray[np.float64],
    w: NDArray[np.float64],
    laws: Sequence[Sequence[_LawSpec]],
    force: NDArray[np.complex128],
    levels: Sequence[float],
    band: tuple[float, float],
    *,
    harmonics: int = 7,
    samples: int = 128,
    settling: int = 2,
    max_step: float = 0.1,
    max_points: int = 4000,
    max_folds: int | None = None,
    residual_compliance: float = 0.0,
) -> list[list[_Branch]]:
    """Branches of periodic motions of a modal model with laws on one coordinate `w` (r,), over `band` in rad/s:
    result[set][level] for every set of (name, parameters) in `laws` and every factor on `force`.

    `omega`, `zeta` (r,), `phi_in` (n_in, r), `phi_out` (n_out, r); `force` (n_in,) complex amplitudes in N. The mean
    and `harmonics` harmonics are balanced by `samples` of a period; hysteretic laws settle for `settling` periods.
    Lengths along the branch are shares of the amplitude and of the band, a step is at most `max_step`;
    after `max_folds` turning points the branch is followed no further.
    `residual_compliance` (m/N) is that of the omitted modes at w.

    Each branch: frequencies (n,) in rad/s, harmonics (n, harmonics + 1) of the coordinate (m) and of the laws' force
    against it (N), of the displacement (n, n_out, harmonics + 1) at the outputs; turning points (point, whether
    frequency has a maximum there); "upper" or "lower" end of the band reached, "max_points", "max_folds" or "stuck";
    iterations.
    Raises `LawParameterError`, ValueError, and ConvergenceError where no motion is found at the lower end of the band.
    """

def law_force(
    name: str,
    parameters: Mapping[str, float] | Sequence[float] | NDArray[np.float64],
    d: NDArray[np.float64],
    v: NDArray[np.float64],
    a: NDArray[np.float64],
    dt: float,
) -> NDArray[np.float64]:
    """Force (n,) in N of a law along a given motion d, v, a (n,) at steps of `dt` s, from rest."""

def law_dynamic_stiffness(
    name: str,
    parameters: Mapping[str, float] | Sequence[float] | NDArray[np.float64],
    s: NDArray[np.complex128],
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """kappa(s) = F/D (n,) in N/m of a linear law at complex s (n,) in rad/s, and its parameter derivatives (n_p, n)."""

def law_library() -> dict[str, list[tuple[str, str]]]:
    """{law: [(parameter, SI unit), ...]}, parameters in the order in which arrays give them."""

def register_law(
    name: str,
    parameters: Sequence[tuple[str, str, str]],
    n_z: int,
    *,
    recorded: tuple[list[tuple[str, list[int], float]], list[int]] | None = None,
    function: Callable[[list[float]], list[float]] | None = None,
    slopes: Callable[[list[float]], list[float]] | None = None,
    scales: Sequence[float] = ...,
) -> None:
    """Makes a law known as `name`, in place of one registered before, by `femend.physics.register`.

    `parameters` are (name, unit, domain), `n_z` the number of internal variables; inputs are d, v, z.., p.. in this
    order, outputs the force and the rates of z. Either `recorded`: operations (name, operands, number) and where the
    outputs stand; or `function` of the inputs, with its `slopes` (outputs, inputs) row by row or else differences at
    the `scales` (n,) of the inputs. Raises ValueError for more than 16 parameters and internal variables together, and
    for an operation that is not known.
    """

def forget_law(name: str) -> None:
    """Takes a registered law out again."""

def law_slopes(name: str, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Force and rates of a registered law at `inputs` d, v, z.., p.., each followed by its slopes over the inputs.

    Raises ValueError for a law that is not registered or another number of inputs.
    """

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

@final
class Deck:
    """A Nastran bulk-data deck: cards, case control, and where everything stands."""

    @staticmethod
    def read(path: str | PathLike[str]) -> Deck: ...
    @property
    def path(self) -> str: ...
    @property
    def files(self) -> list[str]: ...
    @property
    def node_ids(self) -> NDArray[np.int64]:
        """Of the GRIDs (n,), ascending."""

    @property
    def scalar_points(self) -> NDArray[np.int64]:
        """Ids of SPOINT and of what CELAS3, 4, CDAMP3, 4 and CMASS3, 4 name, ascending."""

    @property
    def xyz(self) -> NDArray[np.float64]:
        """Of the GRIDs (n, 3), basic coordinates."""

    def card_counts(self) -> dict[str, int]: ...
    def ignored(self) -> dict[str, int]: ...
    def case_control(self) -> dict[str, str]: ...
    def params(self) -> dict[str, str]: ...
    def grid_coordinates(self, ids: Sequence[int], xyz: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 3) of basic points `xyz` (n, 3) as fields 4 to 6 of the GRIDs `ids` have them, angles in degrees."""

    def elements(self) -> list[tuple[int, str, int | None, tuple[int, ...]]]: ...
    def find(self, card: str, id: int) -> tuple[str, int]: ...
    def field_text(self, card: str, id: int, field: int) -> str: ...
    def next_id(self, kind: str) -> int: ...
    def patched(self, changes: Sequence[tuple[str, int, int, float]], additions: Sequence[str]) -> dict[str, bytes]: ...

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

_System: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

@final
class MovedNodes:
    """Elements of a model with some of its nodes elsewhere: `FeModel.moved`."""

    @property
    def rows(self) -> NDArray[np.int64]:
        """g-set rows whose row of T is another one there."""

    def change(self, factors: NDArray[np.float64] | None = None) -> _System:
        """What the new positions add to (K, M, C, H) at the factors, on the pattern of `FeModel.assemble`."""

    def minus(self, other: MovedNodes, factors: NDArray[np.float64] | None = None) -> _System:
        """(K, M, C, H) at these positions less those at the positions of `other`, a position of the same model."""

    def derivative(self, i: int, factors: NDArray[np.float64] | None = None) -> _System:
        """What the new positions add to `FeModel.derivative` with respect to factor i."""

@final
class FeModel:
    """Finite-element model of a deck with constraints eliminated: `u_g = T u_a`.

    Rows of the g-set are `6 * node_index + component - 1`, components in each node's displacement (CD) frame. Matrices
    are full symmetric compressed columns (both triangles, rows ascending) on one pattern; `factors` are one number
    per parameter, 1 = the deck's value, None = all one. Order everywhere: K, M, C, and structural damping H, where
    the stiffness is K + iH (GE of materials, springs and bushes, PARAM G, K42GG). Raises `ModelError` and `DeckError`.
    """

    def __new__(
        cls,
        deck: Deck,
        spc: int | None = None,
        parameters: Sequence[tuple[str, str, str, Sequence[int]]] | None = None,
        added_mass: Sequence[tuple[int, float]] | None = None,
        moving: tuple[Sequence[int], NDArray[np.float64]] | None = None,
    ) -> FeModel:
        """Model with SPC set `spc` (None: the one case control selects; 0: no set, all supports free).

        `parameters` are (name, property, target, ids): property one of E G nu rho eta A I1 I2 J t k1..k6 c1..c6 m,
        target one of material, property_id, elements, mass. `added_mass` are (node, mass) on top of the deck. `moving`
        are the ids of nodes that may move (`moved`) and a probe position (n, 3) of theirs: the pattern holds both.
        """

    def moved(self, ids: Sequence[int], xyz: NDArray[np.float64]) -> MovedNodes:
        """The model with nodes `ids` at `xyz` (n, 3), basic coordinates: what that changes.

        Raises GeometryError where an element has no shape there and ModelError for a model not made with `moving`.
        """

    @property
    def reached(self) -> NDArray[np.int64]:
        """Positions in `elements()` of the elements that moving nodes changes."""

    @property
    def n_a(self) -> int:
        """Number of independent DOFs."""

    @property
    def n_g(self) -> int:
        """Six per node."""

    @property
    def node_ids(self) -> NDArray[np.int64]:
        """(n_nodes,), in the order of the g-set, scalar points included."""

    @property
    def scalar_points(self) -> NDArray[np.int64]:
        """Ids of the nodes that are scalar points: their one DOF is carried as component 4, the others are held, and
        `xyz` has them in the middle of the other nodes."""

    @property
    def xyz(self) -> NDArray[np.float64]:
        """(n_nodes, 3), basic coordinates."""

    @property
    def frames(self) -> NDArray[np.float64]:
        """(n_nodes, 3, 3): row i is axis i of the node's displacement frame in basic coordinates."""

    @property
    def dof_nodes(self) -> NDArray[np.int64]:
        """(n_a,) node id of each a-set DOF."""

    @property
    def dof_components(self) -> NDArray[np.int64]:
        """(n_a,) component 1..6 of each a-set DOF."""

    @property
    def T(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """(indptr, indices, data) of the (n_g, n_a) matrix T, compressed columns."""

    @property
    def auto_constrained(self) -> list[str]:
        """DOFs held because nothing resists or loads them, as "node:component"."""

    @property
    def parameter_names(self) -> list[str]: ...
    @property
    def affine(self) -> bool:
        """Are K, M, C and H affine in all factors jointly? Then derivatives are constant."""

    def total_mass(self) -> float:
        """Mass of the whole structure, held nodes included, in mass units after WTMASS."""

    def elements(self) -> list[tuple[int, str, list[int]]]:
        """(id, card, node ids) of every element; masses added by a configuration have id 0."""

    def assemble(
        self, factors: NDArray[np.float64] | None = None
    ) -> tuple[
        NDArray[np.int32],
        NDArray[np.int32],
        NDArray[np.float64],
        NDArray[np.float64],
        NDArray[np.float64],
        NDArray[np.float64],
    ]:
        """(indptr, indices, K, M, C, H)."""

    def refill(self, matrix: str, factors: NDArray[np.float64] | None, out: NDArray[np.float64]) -> None:
        """Writes the values of one matrix ("K", "M", "C" or "H") at the factors into `out` (nnz,), on that pattern.

        Where the model is `affine` only the values that factors reach are read: little dearer than a copy. Raises
        ValueError for another matrix or an array that cannot be written, ModelError for another length.
        """

    def derivative(self, i: int, factors: NDArray[np.float64] | None = None) -> _System:
        """Exact derivatives of (K, M, C, H) with respect to factor i, on the pattern of `assemble`."""

    def project(self, factors: NDArray[np.float64] | None, v: NDArray[np.float64]) -> tuple[_System, _System]:
        """Reduced (K, M, C, H), each (r, r), on the basis v (n_a, r), and their derivatives, each (p, r, r)."""

    def element_matrices(
        self, eid: int, factors: NDArray[np.float64] | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """(g-set rows, K, M) of one element, in displacement frames: its part of K is T[rows]' K T[rows]."""

    def element_frame(self, eid: int) -> tuple[NDArray[np.float64], float]:
        """Local axes (3, 3) of a beam in basic coordinates, one per row, and its length between offset ends."""

    def stress_stiffness(
        self, u: NDArray[np.float64], factors: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Stress stiffness, on the pattern of `assemble`, of the preload that the displacements u (n_a,) make."""

    def gyroscopic(
        self,
        axis: Sequence[float],
        elements: Sequence[int] | None = None,
        rotating: bool = False,
        factors: NDArray[np.float64] | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(G, S) on the pattern of `assemble`: G antisymmetric per rad/s, S symmetric per (rad/s)^2.

        `axis` is the direction of spin (basic axes), `elements` the ids of the spinning part (None: all). In axes at
        rest (`rotating` false) S is zero and only beams along the axis and concentrated masses can spin.
        """

    def recover(self, v: NDArray[np.float64]) -> NDArray[np.float64]:
        """u_g = T v, (n_g, r), displacement frames, from v (n_a, r)."""

_Term: TypeAlias = tuple[Sequence[tuple[int, float]], NDArray[np.float64] | None, NDArray[np.float64] | None]

@final
class System:
    """Reduced model K(p), M(p) in a basis of r vectors, with its unknowns p and their Gaussian priors.

    Unknowns, in this order: ln factor of each parameter (n_par,), ln frequency factor of each of the first n_tuned
    modes, ln damping ratio of each of them, ln damping ratio of all modes above (1): n = n_par + 2 n_tuned + 1.
    """

    def __new__(
        cls,
        k_fixed: NDArray[np.float64],
        m_fixed: NDArray[np.float64],
        terms: Sequence[_Term],
        n_par: int,
        n_tuned: int,
        mean: NDArray[np.float64],
        sd: NDArray[np.float64],
    ) -> System:
        """`k_fixed`, `m_fixed` (r, r): the part that no parameter moves. `terms`: ([(parameter, exponent), ...], K, M),
        K and M (r, r) or None, multiplied by exp(sum exponent * p). `n_par` parameters, `n_tuned` <= r tuned modes,
        `mean` and `sd` (n,) of the priors. Raises ModelError where sizes do not fit."""

    def modal(self, p: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """omega (r,) in rad/s with the frequency factors applied, zeta (r,), mass-normalised modes (r, r) in the basis,
        at the unknowns `p` (n,). Raises ModelError for a wrong number of unknowns and a mass that is not positive."""

@final
class RecordLines:
    """One time record as weighted lines s = sigma + i omega of its exponentially windowed spectrum."""

    def __new__(
        cls,
        s: NDArray[np.complex128],
        u: NDArray[np.complex128],
        y: NDArray[np.complex128],
        weight: NDArray[np.float64],
        out_rows: NDArray[np.float64],
        in_rows: NDArray[np.float64],
        dt: float,
        sigma: float,
        n_samples: int,
        thinning: float,
        tempering: float,
    ) -> RecordLines:
        """`s` (K,) rad/s, spectra `u` (K, n_in) of forces and `y` (K, n_out) of accelerations, `weight` (K, n_out) =
        1/sd, rows of the basis at sensors `out_rows` (n_out, r) and forces `in_rows` (n_in, r), step `dt` s, decay of
        the window `sigma` 1/s, `n_samples` of the record; each line stands for `thinning` lines and counts
        `tempering` * `thinning` in the cost. Raises ModelError where sizes do not fit."""

@final
class Hypothesis:
    """What acts beside the model: nothing, a force free on every line, or linear laws."""

    def __new__(
        cls,
        w: NDArray[np.float64] | None = None,
        laws: Sequence[str] | None = None,
        compliance: Sequence[float] | None = None,
        law_mean: Sequence[float] | None = None,
        law_sd: Sequence[float] | None = None,
        at: Sequence[Sequence[int]] | None = None,
        free: int = 0,
    ) -> Hypothesis:
        """`w` (n_w, r) direction vectors in the basis, None for nothing; `laws` names whose forces add up, None for a
        free force; `compliance` (n_w,) m/N in series with the laws; `law_mean`, `law_sd`: priors of the logarithms of
        the laws' parameters, one after the other; `at` numbers of the coordinates of each law, all without it; at the
        last `free` coordinates a force free on every line acts too. Raises ModelError where sizes do not fit or a law
        is not known, ValueError for coordinates of more or fewer laws."""

_Solved: TypeAlias = tuple[
    NDArray[np.float64], NDArray[np.float64], float, float, NDArray[np.float64], NDArray[np.float64], int, bool
]

def solve_hypotheses(
    jobs: Sequence[tuple[System, Hypothesis, NDArray[np.float64], NDArray[np.float64]]],
    records: Sequence[RecordLines],
    iterations: int = 20,
    tolerance: float = 1e-2,
    derivatives: bool = True,
) -> list[_Solved | None]:
    """Minimises the cost of each job over the same `records`, in parallel (Levenberg-Marquardt, free forces and free
    decays projected out: Golub and Pereyra 1973 with Kaufman's Jacobian).

    A job is (system, hypothesis, start of the unknowns (n,), start of the ln law parameters (n_x,)); it takes at most
    `iterations` steps and ends when one lowers the cost by less than `tolerance` (plus a thousandth of it times the
    cost). Steps are found by a Gauss-Newton matrix without what modes far above the lines do;
    near the noise, by the exact gradient, and one matrix serves up to five steps while these come out as it says.

    Returns, for each job, unknowns p (n,), ln law parameters x (n_x,), cost, its prior part, misfit of each record
    (mean weighted square left per free complex value), Gauss-Newton matrix of half the cost (n + n_x, n + n_x) where
    `derivatives` are wanted (else what the search used), number of steps, convergence; None where the model or law
    cannot be solved at the start.
    Raises ModelError where sizes do not fit.
    """

def fitted_lines(
    system: System,
    hypothesis: Hypothesis,
    records: Sequence[RecordLines],
    p: NDArray[np.float64],
    x: NDArray[np.float64],
) -> list[tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.complex128]]]:
    """For each record: accelerations (K, n_out) with fitted free decays, displacements of the coordinates (K, n_w),
    forces on the structure there (K, n_w), for `hypothesis` on `system` at unknowns `p` and ln law parameters `x`.

    Raises ModelError where the model or a law cannot be solved there.
    """

def model_columns(
    system: System,
    record: RecordLines,
    w: NDArray[np.float64],
    kappa: NDArray[np.complex128],
    p: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Derivatives (2 K n_out, n) of the record's weighted accelerations with respect to the n unknowns of `system` at
    `p`, where the coordinates `w` (n_w, r) have the dynamic stiffness `kappa` (K, n_w), N/m: real parts of all lines,
    then imaginary parts, sensor after sensor.

    Raises ModelError for arrays that do not fit or a model that cannot be solved.
    """
