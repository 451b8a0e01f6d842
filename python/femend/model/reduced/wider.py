"""A basis of a large model with a few vectors more, which shares the memory of the first: many places are opened."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Basis", "WiderBasis"]

FloatArray = NDArray[np.float64]


class WiderBasis:
    """The vectors `first` (n, r) and then `more` (n, m) as one basis (n, r + m), of which rows and products are asked
    for; NumPy makes a whole array of it where it has to."""

    def __init__(self, first: Basis, more: FloatArray) -> None:
        self.first, self.more = first, more

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and of vectors."""
        return len(self.more), self.first.shape[1] + self.more.shape[1]

    def __len__(self) -> int:
        return len(self.more)

    def __getitem__(self, rows: Any) -> FloatArray:
        return np.concatenate([self.first[rows], self.more[rows]], axis=-1)

    def __matmul__(self, right: FloatArray) -> FloatArray:
        r = self.first.shape[1]
        return np.asarray(self.first @ right[:r] + self.more @ right[r:])

    def onto(self, right: FloatArray) -> FloatArray:
        """Products (r + m, k) of all vectors with the columns `right` (n, k)."""
        return np.vstack([onto(self.first, right), self.more.T @ right])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> FloatArray:
        return np.asarray(np.hstack([np.asarray(self.first), self.more]), dtype=dtype)


Basis = FloatArray | WiderBasis


def onto(basis: Basis, right: FloatArray) -> FloatArray:
    """Products (r, k) of all vectors of a `basis` (n, r) with the columns `right` (n, k)."""
    return basis.onto(right) if isinstance(basis, WiderBasis) else np.asarray(basis.T @ right)
