"""The matrices of a damped structure with spinning parts, on one pattern."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from femend.analysis.preload import stress_stiffness
from femend.analysis.rotor import gyroscopic_matrices
from femend.dof import Dof
from femend.model import Model
from femend.model.reduced.one_pattern import on_one_pattern
from femend.model.terms.spinning import SpinningPart

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["TurningSystem", "as_turning_system", "turning_system"]

# name -> (what it multiplies in the core, power of the speed)
_TERMS = {"C": ("C", 0), "D": ("D", 0), "G": ("C", 1), "N": ("K", 1), "S": ("K", 2)}


@dataclass(frozen=True, slots=True, eq=False)
class TurningSystem:
    """M u'' + (C + W G) u' + (K + W N + W^2 S + i D) u = f with the shaft's speed W in rad/s; matrices (n, n), sparse.

    `M` and `K` symmetric, K positive semi-definite; `C` viscous, `D` structural damping, `G` gyroscopic per rad/s, `N`
    circulatory per rad/s (damping of turning parts, seen from axes at rest), `S` per (rad/s)^2; None is zero. `dofs`
    (n,) names the rows in axes of the basic system. `parts` turn; without a model their `elements` mean nothing, and
    all nodes count. Raises ValueError for shapes that do not fit.
    """

    M: csc_array
    K: csc_array
    dofs: tuple[Dof, ...]
    C: csc_array | None = None
    D: csc_array | None = None
    G: csc_array | None = None
    N: csc_array | None = None
    S: csc_array | None = None
    parts: tuple[SpinningPart, ...] = ()
    model: Model | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "dofs", tuple(self.dofs))
        n = len(self.dofs)
        for name in ("M", "K", *_TERMS):
            a = getattr(self, name)
            if a is not None and a.shape != (n, n):
                raise ValueError(f"{name} is {a.shape}, but there are {n} DOF names; name every row once")

    def arrays(
        self,
    ) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], list[tuple[str, int, NDArray[Any]]]]:
        """indptr, indices, K, M (nnz,) and the further terms (kind, power of speed, values) on one pattern, for the
        core."""
        given = [(name, getattr(self, name)) for name in _TERMS if getattr(self, name) is not None]
        indptr, indices, values = on_one_pattern([self.K, self.M, *(a for _, a in given)])
        terms = [(*_TERMS[name], v) for (name, _), v in zip(given, values[2:], strict=True)]
        return indptr, indices, values[0], values[1], terms

    def matrix(self, name: str, speed: float) -> csc_array:
        """ "damping" C + W G or "stiffness" K + W N + W^2 S (+ i D) at `speed` W in rad/s. Raises ValueError for
        another `name`."""
        if name not in ("damping", "stiffness"):
            raise ValueError(f"matrix {name!r} is neither 'damping' nor 'stiffness'")
        kind = "C" if name == "damping" else "K"
        total = 0.0 * self.K if name == "damping" else self.K.copy()
        for key, (what, power) in _TERMS.items():
            a = getattr(self, key)
            if a is not None and what == kind:
                total = total + speed**power * a
        if name == "stiffness" and self.D is not None:
            total = total + 1j * self.D
        return total


def turning_system(
    model: Model,
    parts: Sequence[SpinningPart] = (),
    *,
    preload: Mapping[Dof, float] | None = None,
    factors: Mapping[str, float] | None = None,
) -> TurningSystem:
    """The matrices of `model` with its dashpots (C) and structural damping (D), and with `parts` that turn.

    G is the sum of ratio x G of the parts and S of ratio^2 x S. `preload` are constant forces whose stress stiffens the
    model (`stress_stiffness`), `factors` factors on parameters. Raises what `gyroscopic_matrices` and
    `stress_stiffness` raise.

    >>> turning_system(model, [SpinningPart((1, 0, 0)), SpinningPart((1, 0, 0), (70,), ratio=2.5)])  # doctest: +SKIP
    """
    from scipy.sparse import csc_array

    indptr, indices, k, m, c, h = model.fe.assemble(model.factors(factors))
    shape = (model.fe.n_a, model.fe.n_a)

    def made(values: NDArray[np.float64]) -> csc_array:
        return csc_array((values, indices, indptr), shape=shape)

    K = made(k)
    if preload:
        K = made(k + stress_stiffness(model, preload, factors=factors).data)
    G = S = None
    for part in parts:
        g, s = gyroscopic_matrices(model, part.axis, elements=part.elements, axes=part.axes, factors=factors)
        G = made(part.ratio * g.data + (0.0 if G is None else G.data))
        S = made(part.ratio**2 * s.data + (0.0 if S is None else S.data))
    names = tuple(Dof(int(n), int(comp)) for n, comp in zip(model.fe.dof_nodes, model.fe.dof_components, strict=True))

    def some(a: csc_array | None) -> csc_array | None:
        return a if a is not None and a.data.any() else None

    return TurningSystem(
        made(m), K, names, C=some(made(c)), D=some(made(h)), G=some(G), S=some(S), parts=tuple(parts), model=model
    )


def as_turning_system(
    system: Model | TurningSystem,
    parts: Sequence[SpinningPart],
    preload: Mapping[Dof, float] | None,
    factors: Mapping[str, float] | None,
) -> TurningSystem:
    """A model with what belongs to it as a `TurningSystem`, and one of these as it is; raises ValueError where parts,
    preload or factors are given beside it, and what `turning_system` raises."""
    if isinstance(system, Model):
        return turning_system(system, parts, preload=preload, factors=factors)
    if parts or preload or factors:
        raise ValueError("parts, preload and factors belong to a model; a TurningSystem has its matrices already")
    return system
