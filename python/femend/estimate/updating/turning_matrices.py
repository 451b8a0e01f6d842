"""Matrices of a structure that turns, as functions of the factors: those at rest, and what the speed adds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import ModelError
from femend.estimate.updating.damped import damping_of, damping_slopes_of
from femend.estimate.updating.matrices import DeckMatrices, Matrices
from femend.estimate.updating.requests import DAMPING
from femend.estimate.updating.speed_terms import SpeedTerm
from femend.model.reduced.one_pattern import on_one_pattern
from femend.model.terms.spinning import SpinningPart, gyroscopic, gyroscopic_slopes

__all__ = ["Change", "Turned", "TurningMatrices"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# pivots off the diagonal are taken where the diagonal's is smaller than this share of the largest in its column
PIVOT = 0.01


@dataclass(frozen=True, eq=False)
class Change:
    """Derivative of the dynamic stiffness with respect to one `parameter`, by position: `values` (m,) of s in rad/s and
    the shaft's speed in rad/s, at `rows` and `columns` (m,)."""

    parameter: int
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: Callable[[complex, float], ComplexArray]

    def between(self, left: ComplexArray, right: ComplexArray, s: complex, speed: float) -> ComplexArray:
        """left^T (d D) right (k, m) at `s` and `speed`, for `left` (n, k) and `right` (n, m)."""
        weighed = left[self.rows] * self.values(s, speed)[:, None]
        return np.asarray(weighed.T @ right[self.columns])


@dataclass(frozen=True, eq=False)
class Turned:
    """K, M, C, H and G on one pattern at one set of factors, and what every term counts there.

    `still` (5, nnz) are the values of K, M, C, H and G, `terms` (n_terms, nnz) those of the terms times their factors.
    """

    indptr: NDArray[Any]
    indices: NDArray[Any]
    still: FloatArray
    terms: FloatArray
    of: tuple[SpeedTerm, ...]

    def sparse(self, values: NDArray[Any]) -> Any:
        """The matrix (n, n) of `values` (nnz,)."""
        from scipy.sparse import csc_array

        n = self.indptr.size - 1
        return csc_array((values, self.indices, self.indptr), shape=(n, n))

    def added(self, kind: str, speed: float) -> FloatArray:
        """What the terms of a `kind` add to stiffness or damping at `speed` in rad/s, (nnz,)."""
        weights = [float(t.weights(np.array([speed]))[0]) if t.kind == kind else 0.0 for t in self.of]
        return np.asarray(np.array(weights) @ self.terms if weights else np.zeros(self.indices.size))

    def damping(self, speed: float) -> FloatArray:
        """C + c(W) + W G (nnz,) at `speed` W in rad/s."""
        return np.asarray(self.still[2] + self.added("damping", speed) + speed * self.still[4])

    def dynamic(self, s: complex, speed: float) -> Any:
        """D = K + i H + k(W) + s (C + c(W) + W G) + s^2 M (n, n) at `s` in rad/s and the shaft's `speed` W in rad/s."""
        K, M, _, H, _ = self.still
        values = K + 1j * H + self.added("stiffness", speed) + s * self.damping(speed) + s**2 * M
        # half of a shell's entries are zeros of the pattern, and would fill a factor; the pattern itself stays
        D = self.sparse(values).copy()
        D.eliminate_zeros()
        return D

    def factor(self, s: complex, speed: float) -> Any:
        """`dynamic` at `s` and `speed` factorised with pivots, as it is not symmetric (SuperLU: Demmel and others, SIAM
        J. Matrix Anal. Appl. 20 (1999) 720). Raises ModelError where it is singular."""
        from scipy.sparse.linalg import splu

        D = self.dynamic(s, speed)
        try:
            # the pattern is symmetric and fills least in the order of D + D^T
            return splu(D, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=PIVOT, options={"SymmetricMode": True})
        except RuntimeError as error:
            raise ModelError(
                f"the dynamic stiffness is singular at {abs(s) / (2 * np.pi):.6g} Hz and a speed of {speed:.6g} rad/s "
                "(an undamped resonance, or a part that hangs on nothing); give the model damping, or leave "
                "the line out"
            ) from error


@dataclass(frozen=True, eq=False)
class TurningMatrices:
    """`matrices` at rest with alpha, beta and eta, gyroscopic matrices of the `parts` of their deck, and `terms`."""

    matrices: Matrices
    parts: tuple[SpinningPart, ...]
    terms: tuple[SpeedTerm, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters: those of the matrices, of their damping, and of the terms."""
        return self.matrices.names + DAMPING + tuple(dict.fromkeys(t.name for t in self.terms))

    @cached_property
    def _pattern(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.int64], FloatArray]:
        """indptr, indices of all together, places (nnz at rest,) of the matrices' own entries, and values of the
        terms."""
        from scipy.sparse import csc_array

        n, nnz = len(self.matrices.indptr) - 1, len(self.matrices.indices)
        # numbered from 1: an entry that the terms alone have holds 0
        own = csc_array((np.arange(1.0, nnz + 1), self.matrices.indices, self.matrices.indptr), shape=(n, n))
        indptr, indices, values = on_one_pattern([own, *(t.matrix for t in self.terms)])
        at = np.empty(nnz, dtype=np.int64)
        here = np.flatnonzero(values[0])
        at[values[0][here].astype(np.int64) - 1] = here
        return indptr, indices, at, np.array(values[1:]).reshape(len(self.terms), indices.size)

    def _own(self, factors: FloatArray) -> FloatArray:
        return np.ascontiguousarray(factors[: len(self.matrices.names)], dtype=np.float64)

    def _still(self, factors: FloatArray) -> FloatArray:
        return np.ascontiguousarray(factors[: len(self.matrices.names) + len(DAMPING)], dtype=np.float64)

    def at(self, factors: FloatArray) -> Turned:
        """The matrices at `factors` (n_parameters,)."""
        own = self._own(factors)
        K, M = self.matrices.at(own)
        C, H = damping_of(self.matrices, K, M, self._still(factors))
        G = np.zeros_like(K)
        if self.parts and isinstance(self.matrices, DeckMatrices):
            G = gyroscopic(self.matrices.model, self.parts, own)
        indptr, indices, at, terms = self._pattern
        still = np.zeros((5, indices.size))
        still[:, at] = [K, M, C, H, G]
        by_name = dict(zip(self.names, factors.tolist(), strict=True))
        sizes = np.array([by_name[t.name] for t in self.terms])
        return Turned(indptr, indices, still, terms * sizes[:, None], self.terms)

    def changes(self, factors: FloatArray) -> list[Change]:
        """Derivatives of the dynamic stiffness at `factors` (n_parameters,); of the matrices' parameters and of damping
        first, then one a term."""
        own = self._own(factors)
        K, M = self.matrices.at(own)
        dK, dM = self.matrices.slopes(own)
        dC, dH = damping_slopes_of(self.matrices, K, M, dK, dM, self._still(factors))
        zero = np.zeros((len(DAMPING), K.size))
        dG = np.zeros_like(dK)
        if self.parts and isinstance(self.matrices, DeckMatrices):
            dG = gyroscopic_slopes(self.matrices.model, self.parts, own)
        rows = np.asarray(self.matrices.indices, dtype=np.int64)
        columns = np.repeat(np.arange(len(self.matrices.indptr) - 1), np.diff(self.matrices.indptr))
        dK, dM, dG = (np.vstack([d, zero]) for d in (dK, dM, dG))
        out = []
        for i in range(len(dK)):
            whole = np.array([d[i] for d in (dK, dM, dC, dH, dG)])
            e = np.flatnonzero(whole.any(axis=0))
            out.append(Change(i, rows[e], columns[e], _of_matrices(whole[:, e])))
        names = self.names
        for term in self.terms:
            entries = term.matrix.tocoo()
            out.append(Change(names.index(term.name), entries.row, entries.col, _of_term(term, entries.data)))
        return out


def _of_matrices(d: FloatArray) -> Callable[[complex, float], ComplexArray]:
    """Values of a change of K, M, C, H and G (5, m)."""
    dK, dM, dC, dH, dG = d
    return lambda s, speed: np.asarray(dK + 1j * dH + s * (dC + speed * dG) + s**2 * dM)


def _of_term(term: SpeedTerm, entries: FloatArray) -> Callable[[complex, float], ComplexArray]:
    """Values of a change of the factor of a term with `entries` (m,)."""

    def values(s: complex, speed: float) -> ComplexArray:
        weight = float(term.weights(np.array([speed]))[0])
        return np.asarray((s if term.kind == "damping" else 1.0) * weight * entries, dtype=np.complex128)

    return values
