"""Expansion by least dynamic residual in the energy norm, weighted by the measurement's variance, with its error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ExpansionError
from femend.expansion._matrices import Solver, measured_rows, same_size, sparse, sensor_shapes

__all__ = ["ResidualExpansion", "expand_residual"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ResidualExpansion:
    """`phi` (n, n_modes) and what the equations of motion lack there.

    `residual` (n, n_modes) are the displacements d of K d = (K - omega^2 M) phi, `energy` (n_modes,) d^T K d over
    phi^T K phi, which is 0 where model and test agree; `misfit` (n_a, n_modes) is phi - test at the sensors in
    deviations; `sd` (len(of), n_modes) the standard deviation of phi at the DOFs `of`.
    """

    phi: FloatArray
    residual: FloatArray
    energy: FloatArray
    misfit: FloatArray
    of: NDArray[np.int64]
    sd: FloatArray


def expand_residual(
    K: Any,
    M: Any,
    rows: ArrayLike,
    phi: ArrayLike,
    freq: ArrayLike,
    sd: ArrayLike,
    *,
    model_error: float = 0.05,
    error_at: Sequence[int] = (),
) -> ResidualExpansion:
    """Expands real shapes `phi` (n_a, n_modes), measured at `rows` (n_a,) of `K`, `M` (n, n) with frequencies `freq`
    (n_modes,) in Hz.

    Minimises d^T K d / (e^2 E) + sum ((phi_a - test) / sd)^2, K d = (K - omega^2 M) phi, mode by mode: minimum
    dynamic residual expansion (Balmes 2000, Mech. Syst. Signal Process. 14, "Review and evaluation of shape expansion
    methods", MDRE-WE), the error in the constitutive relation of Ladeveze with a discrete measurement. `sd` is the
    deviation of the measured values (a number, (n_a,), or (n_a, n_modes)); `model_error` e is the relative error of the
    stiffness between mode shapes: an error e omega_i omega_j of the modal stiffness mixes e omega_i omega_j /
    (omega_i^2 - omega_j^2) of mode j into mode i, which is just what this prior allows. E = phi^T K phi is made from
    the result of a first pass. The deviations at DOFs `error_at` follow from the same quadratic form. A free structure
    is held by a small share of its mass in the norm. Raises ExpansionError for sizes that do not fit and deviations
    or a model error not above 0.
    """
    from scipy.sparse import block_array, csc_array

    k, m = sparse(K, "stiffness"), sparse(M, "mass")
    same_size(k, m)
    n = k.shape[0]
    at = measured_rows(rows, n)
    if np.iscomplexobj(phi):
        raise ExpansionError("the measured shapes are complex; turn them real (femend.correlate tells how complex)")
    y = sensor_shapes(phi, len(at)).astype(np.float64)
    f = np.asarray(freq, dtype=np.float64).ravel()
    if f.shape != (y.shape[1],):
        raise ExpansionError(f"{f.size} frequencies for {y.shape[1]} shapes; one each")
    given = np.asarray(sd, dtype=np.float64)
    scatter = np.array(np.broadcast_to(given[:, None] if given.ndim == 1 else given, y.shape))
    if not ((scatter > 0).all() and np.isfinite(scatter).all() and model_error > 0):
        raise ExpansionError("deviations of shapes and the model error have to be above 0")
    shown = np.asarray(error_at, dtype=np.int64)
    norm = _norm(k, m)
    size = norm.diagonal().max()
    B = csc_array((np.ones(len(at)), (np.arange(len(at)), at)), shape=(len(at), n))
    out, res, err = np.zeros((n, f.size)), np.zeros((n, f.size)), np.zeros((shown.size, f.size))
    energy = np.zeros(f.size)
    for r in range(f.size):
        Z = k - (2 * np.pi * f[r]) ** 2 * m
        strain = _start_energy(k, at, y[:, r])
        for _ in range(3):  # the scale of the energy is that of the result
            # one unit for both parts: the residual's weight is 1 / (e^2 E), the unknown d is scaled by it
            a = model_error**2 * strain
            W = B.T @ csc_array((1.0 / scatter[:, r] ** 2, (np.arange(len(at)), np.arange(len(at))))) @ B * a
            saddle = csc_array(block_array([[-norm / size, Z / size], [Z / size, W / size]]))
            solve = Solver(saddle, "the sensors do not determine the shape", indefinite=True)
            load = np.zeros(2 * n)
            load[n:] = B.T @ (y[:, r] / scatter[:, r] ** 2) * a / size
            x = solve(load)
            d, u = x[:n], x[n:]
            new = float(u @ (k @ u))
            if not np.isfinite(new) or new <= 0 or abs(new - strain) < 1e-3 * strain:
                break
            strain = new
        out[:, r], res[:, r] = u, d
        energy[r] = float(d @ (norm @ d)) / max(float(u @ (k @ u)), 1e-300)
        if shown.size:
            unit = np.zeros((2 * n, shown.size))
            unit[n + shown, np.arange(shown.size)] = a / size
            err[:, r] = np.sqrt(np.maximum(solve(unit)[n + shown, np.arange(shown.size)], 0.0))
    return ResidualExpansion(out, res, energy, (out[at] - y) / scatter, shown, err)


def _norm(k: Any, m: Any) -> Any:
    """K, with a little mass where the structure is free."""
    from scipy.sparse import csc_array

    try:
        if Solver(k, "free").inertia == 0 and _well(k):
            return k
    except ExpansionError:
        pass
    share = 1e-6 * k.diagonal().sum() / m.diagonal().sum()
    return csc_array(k + share * m)


def _well(k: Any) -> bool:
    """Is the stiffness far from singular? A unit load has to stay within what rounding allows."""
    load = np.ones(k.shape[0])
    x = Solver(k, "free")(load)
    return bool(np.isfinite(x).all() and np.abs(k @ x - load).max() < 1e-4)


def _start_energy(k: Any, at: NDArray[np.int64], y: FloatArray) -> float:
    """Strain energy of the shape that follows the sensors statically, or a bound of it for free structures."""
    from femend.expansion.reductions import guyan

    try:
        u = guyan(k, at).T @ y
        energy = float(u @ (k @ u))
    except ExpansionError:
        energy = 0.0
    return energy if energy > 0 else float(k.diagonal()[at] @ y**2)
