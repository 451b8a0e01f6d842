"""Where the matrices of two models differ, and which parameter's values may be why."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csc_array

    from femend.model.model import Model

__all__ = ["Difference", "Matrices", "difference"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

NAMES = ("K", "M", "C", "H")
# of the largest value on the diagonal, of translations or of rotations: round-off of zeros of the element matrices
NOISE = 1e-14
# scale of a matrix without any value on its diagonal
LEAST = 1e-150
# values of each matrix that are looked at to tell parameters by, those furthest off
MOST = 2000
# correlation of the differences with what a parameter changes from which it is told as what may be wrong: one of two
# that are wrong alike has 0.7
LIKE = 0.3


@dataclass(frozen=True, eq=False)
class Matrices:
    """K, M, C and H (n_a, n_a) of a model in `values`, in this order, and which DOFs (n_a,) are `rotations`."""

    values: tuple[csc_array, ...]
    rotations: NDArray[np.bool_]

    @classmethod
    def of(
        cls, model: Model, factors: FloatArray | None = None, moved: tuple[Sequence[int], FloatArray] | None = None
    ) -> Matrices:
        """Those of `model` at `factors` (n_par,) with the nodes `moved`, given by their ids, at `xyz` (n, 3)."""
        indptr, indices, *values = model.fe.assemble(factors)
        if moved is not None:
            change = model.fe.moved(*moved).change(factors)
            values = [own + more for own, more in zip(values, change, strict=True)]
        return cls(tuple(_sparse(model, indptr, indices, v) for v in values), np.asarray(model.fe.dof_components) > 3)


@dataclass(frozen=True)
class Difference:
    """The value of `matrix` furthest off of those that `parameter` ("" where none) reaches, at a `row` and `column`:
    what was `found`, and `wanted`."""

    matrix: str
    row: int
    column: int
    found: float
    wanted: float
    parameter: str


@dataclass(frozen=True, eq=False)
class _Off:
    """Values of matrix number `matrix` that are off: `rows` and `columns` (n,), the `found` and `wanted` ones (n,), and
    the `scale` (n,) by which their size counts, the furthest off first."""

    matrix: int
    rows: IntArray
    columns: IntArray
    found: FloatArray
    wanted: FloatArray
    scale: FloatArray


@dataclass(frozen=True, eq=False)
class Differences:
    """All values that are `off`, matrix by matrix, none where the models are the same; `sizes` (n_a,) of the DOFs of
    each matrix, of which two make the scale of a value."""

    off: tuple[_Off, ...]
    sizes: tuple[FloatArray, ...]

    def parts(self, model: Model, factors: FloatArray) -> Iterator[Difference]:
        """The largest difference of each parameter of `model` that explains some, at `factors` (n_par,); one without a
        parameter for what none reaches."""
        if not self.off:
            return
        slopes, whole = self._slopes(model, factors)
        change = np.concatenate([(o.found - o.wanted) / o.scale for o in self.off])
        number = np.concatenate([np.full(o.rows.size, i) for i, o in enumerate(self.off)])
        within = np.concatenate([np.arange(o.rows.size) for o in self.off])
        left = np.ones(change.size, dtype=np.bool_)
        while left.any():
            # the parameter along whose own change, as a whole, the differences lie best
            like = np.abs(slopes[:, left] @ change[left]) / (whole * np.linalg.norm(change[left]))
            best = int(np.argmax(like)) if like.size else -1
            named = best >= 0 and like[best] > LIKE
            reached = left & (slopes[best] != 0) if named else left.copy()
            k = int(np.argmax(np.where(reached, np.abs(change), -1.0)))
            one, at = self.off[number[k]], within[k]
            yield Difference(
                NAMES[one.matrix], int(one.rows[at]), int(one.columns[at]), float(one.found[at]),
                float(one.wanted[at]), model.parameters[best].name if named else "",
            )  # fmt: skip
            left &= ~reached

    def _slopes(self, model: Model, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives with respect to every factor (n_par, n) of the n values that are off, scaled alike, and the norm
        (n_par,) of those of all values."""
        indptr, indices, *_ = model.fe.assemble(factors)
        columns = np.repeat(np.arange(model.fe.n_a), np.diff(indptr))
        found, norms = [], []
        for i in range(len(model.parameters)):
            own = model.fe.derivative(i, factors)
            values = [_sparse(model, indptr, indices, d) for d in own]
            found.append(np.concatenate([_at(values[o.matrix], o.rows, o.columns) / o.scale for o in self.off]))
            scaled = [d / (size[indices] * size[columns]) for d, size in zip(own, self.sizes, strict=True)]
            norms.append(float(np.linalg.norm(np.concatenate(scaled))))
        n = sum(o.rows.size for o in self.off)
        return np.array(found).reshape(-1, n), np.maximum(np.array(norms), LEAST)


def difference(wanted: Matrices, found: Matrices, tolerance: float) -> Differences:
    """Where the matrices `found` differ from those `wanted` by more than `tolerance` of the values themselves and of
    what the two DOFs have on the diagonal."""
    off, sizes = [], []
    for i, (a, b) in enumerate(zip(wanted.values, found.values, strict=True)):
        size = np.sqrt(_diagonal(a, b, wanted.rotations))
        sizes.append(size)
        apart = abs(b - a).tocoo()
        rows, columns = (k.astype(np.int64) for k in apart.coords)
        by_dofs = size[rows] * size[columns]
        # what is no number is off too
        far = np.flatnonzero(~(apart.data <= tolerance * by_dofs))
        if not far.size:
            continue
        far = far[np.argsort(-apart.data[far] / by_dofs[far], kind="stable")]
        own, new = _at(a, rows[far], columns[far]), _at(b, rows[far], columns[far])
        keep = np.flatnonzero(~(np.abs(new - own) <= tolerance * np.abs(own)))[:MOST]
        far = far[keep]
        if far.size:
            off.append(_Off(i, rows[far], columns[far], new[keep], own[keep], by_dofs[far]))
    return Differences(tuple(off), tuple(sizes))


def _diagonal(a: csc_array, b: csc_array, rotations: NDArray[np.bool_]) -> FloatArray:
    """The larger of both diagonals (n_a,), and at least what round-off makes of zeros."""
    d = np.maximum(np.abs(a.diagonal()), np.abs(b.diagonal()))
    for group in (rotations, ~rotations):
        d[group] = np.maximum(d[group], max(NOISE * d[group].max(initial=0.0), LEAST))
    return np.asarray(d, dtype=np.float64)


def _sparse(model: Model, indptr: NDArray[np.int32], indices: NDArray[np.int32], values: FloatArray) -> csc_array:
    from scipy.sparse import csc_array

    return csc_array((values, indices, indptr), shape=(model.fe.n_a, model.fe.n_a))


def _at(matrix: csc_array, rows: IntArray, columns: IntArray) -> FloatArray:
    """Values (n,) of `matrix`, whose rows ascend in every column; 0 where it has none."""
    n = matrix.shape[0]
    own = np.repeat(np.arange(n, dtype=np.int64), np.diff(matrix.indptr)) * n + matrix.indices
    wanted = columns * n + rows
    at = np.minimum(np.searchsorted(own, wanted), max(own.size - 1, 0))
    there = own[at] == wanted if own.size else np.zeros(wanted.size, dtype=np.bool_)
    return np.where(there, matrix.data[at] if own.size else 0.0, 0.0)
