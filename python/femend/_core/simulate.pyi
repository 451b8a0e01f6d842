"""Simulations, branches of periodic motions, laws."""

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

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
    decimate: int = 1,
    output: str = "acceleration",
    residual_compliance: NDArray[np.float64] | None = None,
) -> _Histories:
    """Response from rest of a modal model whose coordinates `w` carry laws, closed loop.

    Parameters: `omega` (r,) rad/s, `zeta` (r,), mass-normalised `phi_in` (n_in, r), `phi_out` (n_out, r), `w` (n_w, r)
    with n_w <= 10; `laws` one list of (name, parameters) for each row of w, their forces add up; `u` (n_in, n) in N at
    steps of `dt` s, linear between samples; each step is cut into `substeps`; every `stride`-th sample is kept, and of
    these `decimate` are filtered to one, as a recorder does it (flat to 0.41 of the rate that is left, 60 dB down from
    0.59 on).
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
    decimate: int = 1,
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
    decimate: int = 1,
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
