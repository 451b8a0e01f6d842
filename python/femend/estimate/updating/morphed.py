"""K and M of a deck whose geometry is a parameter: factors first, then the amplitudes of its morphs."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.errors import UpdatingError
from femend.model import Model
from femend.model.geometry.moved import moved_nodes

__all__ = ["MorphedMatrices"]

FloatArray = NDArray[np.float64]
_Parts = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class MorphedMatrices:
    """K and M (and C and H for FRFs) of `model` with its parameters and morphs.

    Derivatives with respect to a factor are exact; those with respect to an amplitude are central differences of the
    elements that moving nodes changes, with a relative error of some 1e-9 (`STEP` in
    `femend.model.geometry.node_fields`); each takes the geometry at two further points. Raises GeometryError where an
    element has no shape.
    """

    model: Model
    _last: list[tuple[bytes, _core.MovedNodes]] = field(default_factory=list, repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, then of the morphs."""
        return tuple(p.name for p in self.model.parameters) + tuple(m.name for m in self.model.morphs)

    @property
    def affine(self) -> bool:
        """K and M are no affine functions of positions."""
        return False

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

    def at(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values of K and M (nnz,) at `factors` (n_parameters + n_morphs,)."""
        K, M, _, _ = self._all(factors)
        return K, M

    def slopes(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives of K and M (n_parameters + n_morphs, nnz) at `factors` (n_parameters + n_morphs,)."""
        parts = self._slopes(factors)
        return np.array([p[0] for p in parts]), np.array([p[1] for p in parts])

    def damping(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values of C and H (nnz,) at `factors` (n_parameters + n_morphs,)."""
        _, _, C, H = self._all(factors)
        return C, H

    def damping_slopes(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives of C and H (n_parameters + n_morphs, nnz) at `factors` (n_parameters + n_morphs,)."""
        parts = self._slopes(factors)
        return np.array([p[2] for p in parts]), np.array([p[3] for p in parts])

    def _split(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        n = len(self.model.parameters)
        if factors.shape != (len(self.names),):
            raise UpdatingError(f"{factors.size} factors for {n} parameters and {len(self.model.morphs)} morphs")
        return np.ascontiguousarray(factors[:n], dtype=np.float64), np.ascontiguousarray(factors[n:], dtype=np.float64)

    def _moved(self, amplitudes: FloatArray) -> _core.MovedNodes:
        """Values and derivatives are asked for at the same point: the last one is kept."""
        key = amplitudes.tobytes()
        if not self._last or self._last[0][0] != key:
            self._last[:] = [(key, moved_nodes(self.model, amplitudes))]
        return self._last[0][1]

    def _all(self, factors: FloatArray) -> _Parts:
        own, amplitudes = self._split(factors)
        base, more = self.model.fe.assemble(own)[2:], self._moved(amplitudes).change(own)
        K, M, C, H = (a + b for a, b in zip(base, more, strict=True))
        return K, M, C, H

    def _slopes(self, factors: FloatArray) -> list[_Parts]:
        own, amplitudes = self._split(factors)
        moved = self._moved(amplitudes)
        out: list[_Parts] = []
        for i in range(len(own)):
            K, M, C, H = (
                a + b for a, b in zip(self.model.fe.derivative(i, own), moved.derivative(i, own), strict=True)
            )
            out.append((K, M, C, H))
        for j, h in enumerate(self.model.fields.step.tolist()):
            ends = []
            for way in (h, -h):
                there = amplitudes.copy()
                there[j] += way
                ends.append(moved_nodes(self.model, there))
            K, M, C, H = (change / (2 * h) for change in ends[0].minus(ends[1], own))
            out.append((K, M, C, H))
        return out
