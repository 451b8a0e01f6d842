"""Small sparse models with known answers, and their K and M on one pattern as the core wants them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


class Pencil(NamedTuple):
    """K and M on one pattern, both triangles stored."""

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    k: NDArray[np.float64]
    m: NDArray[np.float64]
    K: sp.csc_matrix
    M: sp.csc_matrix


def on_pattern(matrix: sp.spmatrix, pattern: sp.csc_matrix) -> NDArray[np.float64]:
    """Values of `matrix` in the order of `pattern`, explicit zeros where it has none."""
    a, p = sp.coo_matrix(matrix), sp.coo_matrix(pattern)
    stacked = (np.r_[a.data, np.zeros(p.nnz)], (np.r_[a.row, p.row], np.r_[a.col, p.col]))
    full = sp.csc_matrix(stacked, shape=pattern.shape)
    full.sum_duplicates()
    full.sort_indices()
    assert (full.indices == pattern.indices).all()
    return full.data


def pencil(K: sp.spmatrix, M: sp.spmatrix) -> Pencil:
    """K and M brought to the union of their patterns and the diagonal."""
    parts = [sp.coo_matrix(a) for a in (K, M, sp.eye(K.shape[0]))]
    row, col = (np.concatenate([getattr(a, name) for a in parts]) for name in ("row", "col"))
    union = sp.csc_matrix((np.ones(row.size), (row, col)), shape=K.shape)
    union.sum_duplicates()
    union.sort_indices()
    return Pencil(
        union.indptr, union.indices, on_pattern(K, union), on_pattern(M, union), sp.csc_matrix(K), sp.csc_matrix(M)
    )


def chain(n: int, *, fixed: bool = True, k: float = 1.0, m: float = 1.0) -> Pencil:
    """Masses in a row; clamped at both ends, or free at both."""
    diagonal = np.full(n, 2.0 * k)
    if not fixed:
        diagonal[[0, -1]] = k
    off = np.full(n - 1, -k)
    return pencil(sp.diags([off, diagonal, off], [-1, 0, 1]), m * sp.eye(n))


def membrane(n: int) -> Pencil:
    """n x n masses on a square net clamped at its rim: modes (p, q) and (q, p) coincide."""
    line = sp.diags([-np.ones(n - 1), np.full(n, 2.0), -np.ones(n - 1)], [-1, 0, 1])
    eye = sp.eye(n)
    return pencil(sp.kron(line, eye) + sp.kron(eye, line), sp.eye(n * n))


def beam(n: int, *, clamped: bool) -> Pencil:
    """Bernoulli beam of n cubic elements, length 1, EI = rho A = 1, consistent mass; clamped-free or free-free."""
    h = 1.0 / n
    ke = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h]])
    ke = np.vstack([ke, [-ke[0], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]]) / h**3
    me = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h]])
    me = np.vstack([me, [[54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]]) * h / 420
    dofs = 2 * np.arange(n)[:, None] + np.arange(4)
    rows, cols = np.repeat(dofs, 4, axis=1).ravel(), np.tile(dofs, (1, 4)).ravel()
    size = 2 * n + 2
    K = sp.coo_matrix((np.tile(np.vstack(ke).astype(float).ravel(), n), (rows, cols)), shape=(size, size)).tocsc()
    M = sp.coo_matrix((np.tile(me.ravel(), n), (rows, cols)), shape=(size, size)).tocsc()
    return pencil(K[2:, 2:], M[2:, 2:]) if clamped else pencil(K, M)
