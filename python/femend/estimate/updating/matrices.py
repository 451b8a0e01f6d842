"""K and M as functions of the factors: affine sums of matrices, and decks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.model import Model

__all__ = ["AffineMatrices", "DeckMatrices", "Matrices", "affine_matrices"]

FloatArray = NDArray[np.float64]


class Matrices(Protocol):
    """Symmetric sparse K and M on one pattern (both triangles, rows ascending), with their derivatives."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""

    @property
    def indptr(self) -> NDArray[Any]:
        """Column pointers (n + 1,)."""

    @property
    def indices(self) -> NDArray[Any]:
        """Rows (nnz,)."""

    @property
    def affine(self) -> bool:
        """Are K and M affine in all factors?"""

    def at(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values of K and M (nnz,) at `factors` (n_parameters,)."""

    def slopes(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives of K and M (n_parameters, nnz) at `factors` (n_parameters,)."""


@dataclass(frozen=True, eq=False)
class AffineMatrices:
    """K = K0 + sum of factor x K_i, M likewise, on one pattern: made by `affine_matrices`."""

    names: tuple[str, ...]
    indptr: NDArray[np.int64]
    indices: NDArray[np.int64]
    K0: FloatArray
    M0: FloatArray
    dK: FloatArray
    dM: FloatArray
    affine: bool = True

    def at(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values of K and M (nnz,) at `factors` (n_parameters,)."""
        return self.K0 + factors @ self.dK, self.M0 + factors @ self.dM

    def slopes(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives (n_parameters, nnz), the same at all `factors` (n_parameters,)."""
        return self.dK, self.dM


def affine_matrices(
    K: Mapping[str, Any], M: Any, *, K_fixed: Any = None, M_parts: Mapping[str, Any] | None = None
) -> AffineMatrices:
    """Matrices from parts, dense or sparse (n, n): K = `K_fixed` + sum of factor x `K`[name], M = `M` + sum of factor x
    `M_parts`[name]; a name may be in both.

    Raises UpdatingError for parts of different sizes or that are not symmetric, or without any part.

    >>> two = affine_matrices({"k": [[2.0, -1.0], [-1.0, 1.0]]}, np.eye(2))
    >>> two.at(np.array([2.0]))[0].tolist()
    [4.0, -2.0, -2.0, 2.0]
    """
    import scipy.sparse as sp

    masses = dict(M_parts or {})
    names = tuple(dict.fromkeys([*K, *masses]))
    if not names:
        raise UpdatingError("no matrix belongs to a parameter; give at least one part of K or M by name")
    parts = {("K", n): _sparse(A) for n, A in K.items()} | {("M", n): _sparse(A) for n, A in masses.items()}
    parts["M", ""] = _sparse(M)
    shape = parts["M", ""].shape
    if K_fixed is not None:
        parts["K", ""] = _sparse(K_fixed)
    for (kind, name), A in parts.items():
        label = f"{kind} of {name!r}" if name else f"the fixed part of {kind}"
        if A.shape != shape or shape[0] != shape[1]:
            raise UpdatingError(f"{label} is {A.shape}, the mass matrix {shape}; all parts are (n, n) of one model")
        if A.nnz and abs(A - A.T).max() > 1e-9 * abs(A).max():
            raise UpdatingError(f"{label} is not symmetric; give both triangles")
    pattern = sp.csc_array(sum((abs(A) for A in parts.values()), sp.csc_array(shape)) + sp.eye_array(shape[0]))
    pattern.sort_indices()
    columns = np.repeat(np.arange(shape[1]), np.diff(pattern.indptr))

    def on(kind: str, name: str) -> FloatArray:
        A = parts.get((kind, name))
        if A is None:
            return np.zeros(pattern.nnz)
        return np.asarray(sp.csr_array(A)[pattern.indices, columns], dtype=np.float64).ravel()

    return AffineMatrices(
        names,
        pattern.indptr.astype(np.int64),
        pattern.indices.astype(np.int64),
        on("K", ""),
        on("M", ""),
        np.array([on("K", n) for n in names]),
        np.array([on("M", n) for n in names]),
    )


def _sparse(A: Any) -> Any:
    from scipy.sparse import csc_array, issparse

    given: Any = A if issparse(A) else np.asarray(A, dtype=np.float64)
    return csc_array(given).astype(np.float64)


@dataclass(frozen=True, eq=False)
class DeckMatrices:
    """K and M of a deck with its parameters."""

    model: Model

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the deck's parameters."""
        return tuple(p.name for p in self.model.parameters)

    @cached_property
    def _pattern(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        return self.model.fe.assemble()[:2]

    @property
    def indptr(self) -> NDArray[np.int32]:
        """Column pointers (n + 1,)."""
        return self._pattern[0]

    @property
    def indices(self) -> NDArray[np.int32]:
        """Rows (nnz,)."""
        return self._pattern[1]

    @property
    def affine(self) -> bool:
        """Are K and M affine in all factors?"""
        return self.model.fe.affine

    def at(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values of K and M (nnz,) at `factors` (n_parameters,)."""
        _, _, K, M, _, _ = self.model.fe.assemble(np.ascontiguousarray(factors, dtype=np.float64))
        return K, M

    @cached_property
    def _constant(self) -> tuple[FloatArray, FloatArray]:
        return self._derivatives(None)

    def _derivatives(self, factors: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        parts = [self.model.fe.derivative(i, factors) for i in range(len(self.names))]
        return np.array([p[0] for p in parts]), np.array([p[1] for p in parts])

    def damping(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values of C and H (nnz,) at `factors` (n_parameters,)."""
        own = self.model.fe.assemble(np.ascontiguousarray(factors, dtype=np.float64))
        return own[4], own[5]

    def damping_slopes(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives of C and H (n_parameters, nnz) at `factors` (n_parameters,)."""
        at = np.ascontiguousarray(factors, dtype=np.float64)
        own = [self.model.fe.derivative(i, at) for i in range(len(self.names))]
        return np.array([p[2] for p in own]), np.array([p[3] for p in own])

    def slopes(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives of K and M (n_parameters, nnz) at `factors` (n_parameters,)."""
        return self._constant if self.affine else self._derivatives(np.ascontiguousarray(factors, dtype=np.float64))
