"""A free force at a place, with all that is needed to tell how near a linear law comes to it in the closed loop.

Where the model's unknowns stay as they are, a law of dynamic stiffness kappa in place of the free force F leaves
|F + kappa D|² more of a record, as the sensors tell forces there: D is the motion under the law,
(1 + kappa C)⁻¹ (D_F - C F), not that under the free force, D_F.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from femend import _core

__all__ = ["FreeForce"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class FreeForce:
    """A free force on the lines `s` (K,) of a record: the motion `D` (K, n_w) it acts in, itself `F` (K, n_w), what the
    model moves by forces of one `C` (K, n_w, n_w), and how well the sensors tell it, `gram` (K, n_w, n_w)."""

    s: ComplexArray
    D: ComplexArray
    F: ComplexArray
    C: ComplexArray
    gram: ComplexArray

    def thinned(self, limit: int) -> FreeForce:
        """The same on every so many lines, about `limit` in all."""
        step = max(1, len(self.s) // limit)
        return FreeForce(*(a[::step] for a in (self.s, self.D, self.F, self.C, self.gram)))

    @cached_property
    def without(self) -> ComplexArray:
        """The motion (K, n_w) where nothing acts."""
        return np.asarray(self.D - np.einsum("kvw,kw->kv", self.C, self.F))

    @cached_property
    def core(self) -> _core.FreeForce:
        """The same in the compiled core, where laws are fitted to it."""
        return _core.FreeForce(self.s, self.without, self.F, self.C, self.gram)

    def left(self, kappa: ComplexArray) -> FloatArray:
        """What laws of dynamic stiffness `kappa` (n_laws, K) leave of the free force, as the sensors tell it
        (n_laws,)."""
        return self.core.left(kappa)
