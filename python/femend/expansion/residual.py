"""Expansion by least dynamic residual in the energy norm, weighted by the measurement's variance, with its error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ExpansionError
from femend.expansion._matrices import measured_rows, same_size, sensor_shapes, sparse
from femend.expansion.dynamic_residual import DynamicResidual, DynamicStiffness, energy_norm
from femend.expansion.reductions import guyan

__all__ = ["ResidualExpansion", "expand_residual", "residual_forms"]

FloatArray = NDArray[np.float64]


# limits of the model error that is sought
LEAST_ERROR, LARGEST_ERROR = 1e-4, 1.0
# what it is walked down by, in its logarithm
STRIDE = 1.2


@dataclass(frozen=True, eq=False)
class ResidualExpansion:
    """`phi` (n, n_modes) and what the equations of motion lack there.

    `residual` (n, n_modes) are the displacements d of K d = (K - omega^2 M) phi, `energy` (n_modes,) d^T K d over
    phi^T K phi, which is 0 where model and test agree; `misfit` (n_a, n_modes) is phi - test at the sensors in
    deviations; `sd` (len(of), n_modes) the standard deviation of phi at the DOFs `of`. `model_error` e was given or
    found, `cost` (n_modes,) the minimum, `strain` (n_modes,) the energy E = phi^T K phi it was scaled by.
    """

    phi: FloatArray
    residual: FloatArray
    energy: FloatArray
    misfit: FloatArray
    of: NDArray[np.int64]
    sd: FloatArray
    model_error: float
    cost: FloatArray
    strain: FloatArray


def expand_residual(
    K: Any,
    M: Any,
    rows: ArrayLike,
    phi: ArrayLike,
    freq: ArrayLike,
    sd: ArrayLike,
    *,
    model_error: float | None = None,
    error_at: Sequence[int] = (),
) -> ResidualExpansion:
    """Expands real shapes `phi` (n_a, n_modes), measured at `rows` (n_a,) of `K`, `M` (n, n) with frequencies `freq`
    (n_modes,) in Hz.

    Minimises d^T K d / (e^2 E) + sum ((phi_a - test) / sd)^2, K d = (K - omega^2 M) phi, mode by mode: minimum
    dynamic residual expansion (Balmes 2000, "Review and evaluation of shape expansion methods", IMAC 18, MDRE-WE), the
    error in the constitutive relation of Ladeveze with discrete measurements. `sd` is the deviation of the measured
    values (a number, (n_a,), or (n_a, n_modes)). `model_error` e is the relative error of the stiffness between mode
    shapes: an error e omega_i omega_j of the modal stiffness mixes e omega_i omega_j / (omega_i^2 - omega_j^2) of mode
    j into mode i, which is just what this form allows. None seeks the e with which the minimum is what chance gives:
    the number of measured values less one per mode, between 1e-4 and 1. The deviations at DOFs `error_at` follow from
    the same quadratic form. A free structure is held by a small share of its mass in the norm. Raises ExpansionError
    for sizes that do not fit and deviations or a model error not above 0.
    """
    k, m = sparse(K, "stiffness"), sparse(M, "mass")
    same_size(k, m)
    at = measured_rows(rows, k.shape[0])
    if np.iscomplexobj(phi):
        raise ExpansionError("the measured shapes are complex; turn them real (femend.correlate tells how complex)")
    y = sensor_shapes(phi, len(at)).astype(np.float64)
    f = np.asarray(freq, dtype=np.float64).ravel()
    if f.shape != (y.shape[1],):
        raise ExpansionError(f"{f.size} frequencies for {y.shape[1]} shapes; one each")
    given = np.asarray(sd, dtype=np.float64)
    scatter = np.array(np.broadcast_to(given[:, None] if given.ndim == 1 else given, y.shape))
    if not ((scatter > 0).all() and np.isfinite(scatter).all() and (model_error is None or model_error > 0)):
        raise ExpansionError("deviations of shapes and the model error have to be above 0")
    norm = energy_norm(k, m)
    strain = np.array([_start_energy(k, at, y[:, r]) for r in range(f.size)])
    shown = np.asarray(error_at, dtype=np.int64)

    stiffness = [DynamicStiffness(norm, k, m, w, at) for w in (2 * np.pi * f) ** 2]

    def run(e: float, energy: FloatArray, deviations: bool) -> ResidualExpansion:
        return _at_error(k, stiffness, y, scatter, e, energy, shown if deviations else shown[:0])

    if model_error is None:
        model_error = _sought(lambda e: float(run(e, strain, False).cost.sum()), y.size - y.shape[1])
    for _ in range(2):  # the scale of the energy is that of the result
        strain = run(model_error, strain, False).strain
    return run(model_error, strain, True)


def residual_forms(
    K: Any, M: Any, rows: ArrayLike, freq: ArrayLike, sd: ArrayLike, expansion: ResidualExpansion
) -> list[DynamicResidual]:
    """The quadratic forms of an `expansion`, mode by mode.

    `K`, `M` (n, n), `rows` (n_a,), `freq` (n_modes,) in Hz and `sd` are those it was made with (`expand_residual`).

    Raises ExpansionError as there.
    """
    k, m = sparse(K, "stiffness"), sparse(M, "mass")
    at = measured_rows(rows, k.shape[0])
    given = np.asarray(sd, dtype=np.float64)
    scatter = np.array(np.broadcast_to(given[:, None] if given.ndim == 1 else given, expansion.misfit.shape))
    norm = energy_norm(k, m)
    omega2 = (2 * np.pi * np.asarray(freq, dtype=np.float64).ravel()) ** 2
    a = expansion.model_error**2 * expansion.strain
    return [
        DynamicResidual(DynamicStiffness(norm, k, m, float(w), at), scatter[:, r], float(a[r]))
        for r, w in enumerate(omega2)
    ]


def _at_error(
    k: Any,
    stiffness: Sequence[DynamicStiffness],
    y: FloatArray,
    scatter: FloatArray,
    e: float,
    strain: FloatArray,
    shown: NDArray[np.int64],
) -> ResidualExpansion:
    n, n_modes, at, norm = k.shape[0], len(stiffness), stiffness[0].rows, stiffness[0].norm
    phi, residual, sd = np.zeros((n, n_modes)), np.zeros((n, n_modes)), np.zeros((shown.size, n_modes))
    for r, own in enumerate(stiffness):
        form = DynamicResidual(own, scatter[:, r], float(e**2 * strain[r]))
        residual[:, r], phi[:, r] = form.minimum(y=y[:, r])
        if shown.size:
            sd[:, r] = form.deviation(shown)
    misfit = (phi[at] - y) / scatter
    lost = np.einsum("nm,nm->m", residual, np.asarray(norm @ residual))
    energy = np.einsum("nm,nm->m", phi, np.asarray(k @ phi))
    cost = lost / (e**2 * strain) + (misfit**2).sum(axis=0)
    energy = np.where(energy > 0, energy, strain)
    return ResidualExpansion(phi, residual, lost / energy, misfit, shown, sd, e, cost, energy)


def _sought(cost: Callable[[float], float], expected: float) -> float:
    """The model error with which the falling `cost` is `expected`.

    It is walked down to from above: at an error far below the one sought the sensors' share of the system is rounding,
    and there may be no solution.
    """
    high = float(np.log(LARGEST_ERROR))
    if cost(LARGEST_ERROR) >= expected:
        return LARGEST_ERROR
    while True:
        low = max(high - STRIDE, float(np.log(LEAST_ERROR)))
        if cost(float(np.exp(low))) > expected:
            break
        if low <= np.log(LEAST_ERROR):
            return LEAST_ERROR
        high = low
    while high - low > 0.05:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if cost(float(np.exp(middle))) > expected else (low, middle)
    return float(np.exp(0.5 * (low + high)))


def _start_energy(k: Any, at: NDArray[np.int64], y: FloatArray) -> float:
    """Strain energy of the shape that follows the sensors statically, or a bound of it for free structures."""
    try:
        u = guyan(k, at).T @ y
        energy = float(u @ (k @ u))
    except ExpansionError:
        energy = 0.0
    return energy if energy > 0 else float(k.diagonal()[at] @ y**2)
