"""Estimation on spectral lines."""

from collections.abc import Sequence
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

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
        dashpots: NDArray[np.float64] | None = None,
        dashpot_of: Sequence[int | None] | None = None,
    ) -> System:
        """`k_fixed`, `m_fixed` (r, r): the part that no parameter moves. `terms`: ([(parameter, exponent), ...], K, M),
        K and M (r, r) or None, multiplied by exp(sum exponent * p). `n_par` parameters, `n_tuned` <= r tuned modes,
        `mean` and `sd` (n,) of the priors; `dashpots` (n_d, r): rows of the basis at which the model has a dashpot of
        1 N s/m each, beside the damping of its modes; every hypothesis acts beside them. `dashpot_of` (n_d,): the
        parameter that is a factor on each, None for one that stays. Raises ModelError where sizes do not fit."""

    def modal(
        self, p: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """omega (r,) in rad/s with the frequency factors applied, zeta (r,), mass-normalised modes (r, r) in the basis,
        at the unknowns `p` (n,), all without dashpots; and these over the modes (n_d, r), of 1 N s/m each. Raises
        ModelError for a wrong number of unknowns and a mass that is not positive."""

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
        cut_off: NDArray[np.complex128] | None = None,
        picked_up: tuple[Sequence[int], NDArray[np.complex128], float] | None = None,
        driven_to: float = 0.0,
    ) -> RecordLines:
        """`s` (K,) rad/s, spectra `u` (K, n_in) of forces and `y` (K, n_out) of accelerations, `weight` (K, n_out) =
        1/sd, rows of the basis at sensors `out_rows` (n_out, r) and forces `in_rows` (n_in, r), step `dt` s, decay of
        the window `sigma` 1/s, `n_samples` of the record; each line stands for `thinning` lines and counts
        `tempering` * `thinning` in the cost; `cut_off` (K, n_out) are accelerations beside those of the model, whatever
        its unknowns are; `picked_up` are the sensors (m) that may hold shares, of this standard deviation, of the
        accelerations (K, m), which are eliminated; modes up to `driven_to` rad/s ring on beyond the record's end, those
        of the lines and a few above them in any case. Raises ModelError where sizes do not fit."""

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
        held: Sequence[float] | None = None,
    ) -> Hypothesis:
        """`w` (n_w, r) direction vectors in the basis, None for nothing; `laws` names whose forces add up, None for a
        free force; `compliance` (n_w,) m/N in series with the laws; `law_mean`, `law_sd`: priors of the logarithms of
        the laws' parameters, one after the other; `at` numbers of the coordinates of each law, all without it; at the
        last `free` coordinates a force free on every line acts too; `held` (n_w,) stiffnesses (N/m) of the coordinates
        that the system holds already, beyond which laws act. Raises ModelError where sizes do not fit or a law is not
        known, ValueError for coordinates of more or fewer laws."""

_Solved: TypeAlias = tuple[
    NDArray[np.float64], NDArray[np.float64], float, float, NDArray[np.float64], NDArray[np.float64], int, bool
]

def solve_hypotheses(
    jobs: Sequence[tuple[System, Hypothesis, NDArray[np.float64], NDArray[np.float64]]],
    records: Sequence[RecordLines],
    iterations: int = 20,
    tolerance: float = 1e-2,
    derivatives: bool = True,
    heats: Sequence[tuple[int, float]] = (),
    groups: Sequence[int] = (),
) -> list[_Solved | None]:
    """Minimises the cost of each job over the same `records`, in parallel (Levenberg-Marquardt, free forces and free
    decays projected out: Golub and Pereyra 1973 with Kaufman's Jacobian).

    A job is (system, hypothesis, start of the unknowns (n,), start of the ln law parameters (n_x,)); it takes at most
    `iterations` steps and ends when one lowers the cost by less than `tolerance` (plus a thousandth of it times the
    cost). Steps are found by a Gauss-Newton matrix without what modes far above the lines do;
    near the noise, by the exact gradient, and one matrix serves up to five steps while these come out as it says.

    Jobs race each other where there are `heats` (steps, ratio), in rising order: after so many steps those go on whose
    cost is at most this multiple of the lowest among the jobs of their group (`groups`, a number a job; all are one
    without), and the others come back where they stand. Given up jobs have not converged.

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

def force_products(
    system: System,
    record: RecordLines,
    row: NDArray[np.float64],
    spectra: NDArray[np.complex128],
    p: NDArray[np.float64],
) -> NDArray[np.float64] | None:
    """Products (m + 1, m + 1) of the record's residual, which comes first, and of the answers to m forces with the
    spectra in the columns of `spectra` (K, m), N, at the place `row` (r,) of the basis, as they count in the cost. The
    free decays are eliminated, as strong as the recorded forces alone make them.

    Of the matrix [[e, b^T], [b, A]] amplitudes A^-1 b leave the cost e - b^T A^-1 b. None where the model cannot be
    solved at the unknowns `p` (n,); raises ModelError for arrays that do not fit.
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

def n_decaying(omega: NDArray[np.float64], highest: float, n_tuned: int, driven: float = 0.0) -> int:
    """How many modes of circular frequencies `omega` (r,), rad/s in rising order, have free decays on lines up to
    `highest` (rad/s): the `n_tuned` of the band, and those above the lines whose skirts reach into them or
    that the forces, which excite up to `driven` (rad/s), make ring."""

def closing_sigma(duration: float) -> float:
    """Decay, 1/s, above which a window exp(-sigma t) has closed at the end of a record of `duration` s."""

class FreeForce:
    """A free force at a place of n coordinates on the K lines of a record."""

    def __new__(
        cls,
        s: NDArray[np.complex128],
        without: NDArray[np.complex128],
        force: NDArray[np.complex128],
        moved: NDArray[np.complex128],
        gram: NDArray[np.complex128],
    ) -> FreeForce:
        """Lines `s` (K,) in rad/s; motion `without` (K, n) where nothing acts; the free `force` (K, n) in N; what the
        model moves by forces of one, `moved` (K, n, n); how well the sensors tell a force, the Hermitian `gram`
        (K, n, n). Raises ValueError where shapes do not fit."""

    def left(self, kappa: NDArray[np.complex128]) -> NDArray[np.float64]:
        """What laws of dynamic stiffness `kappa` (n_laws, K) in N/m leave of the force, as the sensors tell it
        (n_laws,); inf where the motion under a law has no bounds."""

def follow_free_force(
    name: str,
    starts: Sequence[Sequence[float]] | Sequence[NDArray[np.float64]],
    free: Sequence[FreeForce],
    steps: int,
    longest: float,
    farthest: float,
) -> list[tuple[float, list[float]] | None]:
    """A linear law fitted to free forces by Levenberg-Marquardt, from each of its `starts`, ln parameters (n_p,): what
    is left and the end (n_p,), None where the law does not allow the start. At most so many `steps`, each of `longest`
    in a logarithm at most, and no further than `farthest` from the start. Raises LawParameterError for an unknown law.
    """

def pair_costs(
    lines: Sequence[tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.complex128]]],
    curvature: NDArray[np.float64],
    pull: NDArray[np.float64],
    prior: float,
) -> NDArray[np.float64]:
    """Cost (n, n) of free forces along every two of n directions after one linear step of n_p unknowns; inf on the
    diagonal and where two directions answer alike. `lines` are (h (n, n_out), e (n_out,), J (n_out, n_p)), weighted:
    answers to forces of one, the residual and the derivatives of the answers; `curvature` (n_p,) = 1/sd², `pull` (n_p,)
    = (p - mean)/sd² and `prior`, the sum of squared deviations, of the unknowns. Raises ValueError where sizes do not
    fit."""
