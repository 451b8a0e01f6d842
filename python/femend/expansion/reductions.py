"""Reduction of a model to measured DOFs: u = T u_a, with the reduced mass and stiffness (TAM)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ExpansionError
from femend.expansion._matrices import Solver, measured_rows, others, same_size, sensor_shapes, sparse

__all__ = ["Reduction", "dynamic", "guyan", "hybrid", "irs", "serep"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

HELD = "the structure moves freely when the measured DOFs are held: add sensors, or take SEREP"


@dataclass(frozen=True, eq=False)
class Reduction:
    """`T` (n, n_a + n_generalised) of u = T [u_a; q], `rows` (n_a,) the measured DOFs, `method` its name.

    `n_generalised` coordinates q besides the measured ones are there in Craig and Bampton's reduction alone.
    """

    method: str
    T: FloatArray
    rows: IntArray
    n_generalised: int = 0

    def of(self, A: Any) -> FloatArray:
        """T^T A T of a matrix `A` (n, n): the reduced mass (TAM) or stiffness. Raises ExpansionError for another
        size."""
        full = sparse(A, "full")
        if full.shape[0] != self.T.shape[0]:
            raise ExpansionError(f"a matrix {full.shape} for a reduction of {self.T.shape[0]} DOFs")
        out = self.T.T @ np.asarray(full @ self.T)
        return np.asarray(0.5 * (out + out.T))

    def expand(self, phi: ArrayLike) -> NDArray[Any]:
        """T phi (n, n_modes) of shapes `phi` (n_a, n_modes) at the measured DOFs, real or complex.

        Raises ExpansionError for sizes that do not fit and for generalised coordinates, which no sensor measures.
        """
        if self.n_generalised:
            raise ExpansionError(
                f"{self.method} has {self.n_generalised} coordinates that no sensor measures; make it a TAM (hybrid)"
            )
        return np.asarray(self.T @ sensor_shapes(phi, len(self.rows)))

    def modes(self, K: Any, M: Any) -> tuple[FloatArray, FloatArray]:
        """Frequencies in Hz, ascending, and mass-normalised shapes of the reduced `K` and `M` (n, n): how good it is.

        Raises ExpansionError where the reduced mass is not positive definite (SEREP with fewer modes than DOFs).
        """
        from scipy.linalg import eigh

        try:
            lam, phi = eigh(self.of(K), self.of(M))
        except np.linalg.LinAlgError as error:
            raise ExpansionError(
                f"the mass reduced by {self.method} is singular: it knows fewer modes than DOFs"
            ) from error
        return np.sqrt(np.maximum(lam, 0.0)) / (2 * np.pi), np.asarray(phi)


def guyan(K: Any, rows: ArrayLike) -> Reduction:
    """Static reduction: what is not measured follows K_oo u_o = - K_oa u_a (Guyan 1965, AIAA J. 3, 380).

    `K` (n, n) dense or sparse, `rows` (n_a,) the measured DOFs. Exact where no mass is elsewhere. Raises
    ExpansionError for rows that do not fit or a structure that moves freely when they are held.

    >>> guyan(np.array([[2.0, -1.0], [-1.0, 1.0]]), [1]).T.ravel().round(9).tolist()
    [0.5, 1.0]
    """
    k = sparse(K, "stiffness")
    at = measured_rows(rows, k.shape[0])
    return Reduction("Guyan", _condensed(k, at, held_solver(k, at)), at)


def dynamic(K: Any, M: Any, rows: ArrayLike, freq: float) -> Reduction:
    """Dynamic reduction at `freq` in Hz: as `guyan` with Z = K - omega^2 M in K's place; exact at that frequency.

    `K`, `M` (n, n), `rows` (n_a,). Kidder 1973, AIAA J. 11, 892-893. Raises ExpansionError as `guyan`, and where `freq`
    is a natural frequency of the structure with the measured DOFs held.
    """
    k, m = sparse(K, "stiffness"), sparse(M, "mass")
    same_size(k, m)
    at = measured_rows(rows, k.shape[0])
    Z = k - (2 * np.pi * freq) ** 2 * m
    why = f"{freq:g} Hz is a natural frequency of the structure with the measured DOFs held: add a sensor"
    rest = others(at, k.shape[0])
    solve = Solver(Z[rest][:, rest], why, indefinite=True) if rest.size else None
    T = _condensed(Z, at, solve)
    if not np.isfinite(T).all() or np.abs(T).max() > 1e10:
        raise ExpansionError(why)
    return Reduction(f"dynamic at {freq:g} Hz", T, at)


def irs(K: Any, M: Any, rows: ArrayLike, iterations: int = 1) -> Reduction:
    """Improved reduced system: Guyan's with the inertia of what is not measured, to first order.

    T = T_s + S M T_s M_R^-1 K_R, S the flexibility with the measured DOFs held (O'Callahan 1989, IMAC 7); more
    `iterations` put the last T in (Friswell, Garvey and Penny 1995, J. Sound Vib. 186, 311-323) and converge to the
    lowest modes. `K`, `M` (n, n), `rows` (n_a,). Raises ExpansionError as `guyan`, and for fewer than one iteration.
    """
    if iterations < 1:
        raise ExpansionError(f"{iterations} iterations of IRS; it takes at least one (none is Guyan)")
    k, m = sparse(K, "stiffness"), sparse(M, "mass")
    same_size(k, m)
    at = measured_rows(rows, k.shape[0])
    rest = others(at, k.shape[0])
    solve = held_solver(k, at)
    T_s = _condensed(k, at, solve)
    T = T_s
    for _ in range(iterations if rest.size else 0):
        heavy = np.asarray(m @ T)
        M_R, K_R = T.T @ heavy, T.T @ np.asarray(k @ T)
        T = T_s.copy()
        assert solve is not None
        T[rest] += solve(heavy[rest]) @ np.linalg.solve(M_R, K_R)
    return Reduction("IRS" if iterations == 1 else f"IRS, {iterations} iterations", T, at)


def serep(phi: ArrayLike, rows: ArrayLike) -> Reduction:
    """System equivalent reduction: T = phi pinv(phi_a), exact for the modes `phi` (n, n_modes), real.

    `rows` (n_a,) are the measured DOFs; O'Callahan, Avitabile and Riemer 1989, IMAC 7. With more sensors than modes
    noise is averaged and the reduced matrices are singular. Raises ExpansionError for fewer sensors than modes, or
    modes that they do not tell apart.

    >>> serep([[0.5], [1.0]], [1]).T.ravel().tolist()
    [0.5, 1.0]
    """
    x = np.asarray(phi, dtype=np.float64)
    if x.ndim != 2 or not np.isfinite(x).all():
        raise ExpansionError(f"model shapes {x.shape}; they are finite (n_dof, n_modes)")
    at = measured_rows(rows, x.shape[0])
    return Reduction("SEREP", x @ _left_inverse(x[at]), at)


def hybrid(base: Reduction, phi: ArrayLike, M: Any) -> Reduction:
    """TAM that is exact for the modes `phi` (n, n_modes) and follows `base` for everything else.

    T = T_b + (T_m - T_b) phi_a phi_a^T M_m with T_m of SEREP and M_m its mass (Kammer 1991, J. Spacecraft 28,
    "A hybrid approach to test-analysis-model development"); for mass-normalised `phi` phi_a^T M_m is the left inverse
    of phi_a. `M` (n, n) is the mass. With a `craig_bampton` base the modes are first brought into its space, and its
    generalised coordinates follow the modes; what is no mode follows statically. Raises ExpansionError as `serep`.
    """
    x = np.asarray(phi, dtype=np.float64)
    back = _left_inverse(x[base.rows])
    n_a = len(base.rows)
    if base.n_generalised:
        heavy = np.asarray(sparse(M, "mass") @ base.T)
        q = np.linalg.solve(base.T.T @ heavy, heavy.T @ x)[n_a:]
        own = base.T[:, n_a:] @ q
        # at the measured DOFs the fixed-interface modes do not move: T stays the identity there
        return Reduction(f"hybrid {base.method}", base.T[:, :n_a] + own @ back, base.rows)
    return Reduction(f"hybrid {base.method}", base.T + (x - base.T @ x[base.rows]) @ back, base.rows)


def _left_inverse(x: FloatArray) -> FloatArray:
    if x.shape[0] < x.shape[1]:
        raise ExpansionError(f"{x.shape[0]} sensors for {x.shape[1]} modes; take at most as many modes as sensors")
    length = np.linalg.norm(x, axis=0)
    s = np.linalg.svd(x / np.where(length > 0, length, 1.0), compute_uv=False)
    if s[-1] <= 1e-10 * s[0] or not (length > 0).all():
        raise ExpansionError(
            f"the {x.shape[0]} sensors do not tell the {x.shape[1]} modes apart; add sensors or leave modes out"
        )
    return np.asarray(np.linalg.pinv(x, rcond=1e-13), dtype=np.float64)


def held_solver(k: Any, at: IntArray) -> Solver | None:
    """The solver with the measured DOFs `at` held, None where all are measured."""
    rest = others(at, k.shape[0])
    return Solver(k[rest][:, rest], HELD) if rest.size else None


def _condensed(A: Any, at: IntArray, solve: Solver | None) -> FloatArray:
    n = A.shape[0]
    T = np.zeros((n, len(at)))
    T[at] = np.eye(len(at))
    if solve is not None:
        rest = others(at, n)
        T[rest] = -solve(A[rest][:, at])
        if not np.isfinite(T).all():
            raise ExpansionError(HELD)
    return T
