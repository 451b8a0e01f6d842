"""Poles of a structure that turns, at given speeds, with their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.analysis.complex_modes import ComplexSolver
from femend.analysis.turning import TurningSystem
from femend.analysis.whirl import WhirlMeter
from femend.dof import Dof
from femend.errors import ConvergenceError
from femend.estimate.updating.turning_matrices import Change, Turned
from femend.model import Model
from femend.model.terms.spinning import SpinningPart

__all__ = ["PolesAt", "pole_slopes", "poles_at"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# poles nearer to each other than this share have the derivative of their mean: their vectors mix at will
EQUAL = 1e-6
# how far beside a pole its left vector is solved for, a share, and how often: poles are known to 1e-8
BESIDE, ROUNDS = 1e-9, 2


@dataclass(frozen=True, eq=False)
class PolesAt:
    """`poles` (m,) in rad/s with Im > 0 at one `speed` in rad/s, `right` vectors (n, m), and `whirl` (m,) from -1
    (backward) to 1 (forward), NaN where no part turns."""

    speed: float
    poles: ComplexArray
    right: ComplexArray
    whirl: FloatArray


def poles_at(turned: Turned, speed: float, n_modes: int, model: Model | None, parts: Sequence[SpinningPart]) -> PolesAt:
    """The lowest `n_modes` by |pole| of the `turned` matrices at `speed` in rad/s; `parts` of the `model` tell the
    sense of whirl. Raises ConvergenceError where fewer modes oscillate, and what `ComplexSolver` raises."""
    K, M, _, H, _ = turned.still
    stiffness = turned.sparse(K + turned.added("stiffness", speed))
    symmetric = (stiffness + stiffness.T) / 2
    circulatory = (stiffness - stiffness.T) / 2
    crossed = abs(circulatory).max() > 1e-12 * abs(symmetric).max()
    system = TurningSystem(
        turned.sparse(M),
        symmetric.tocsc(),
        _names(model, turned.indptr.size - 1),
        C=turned.sparse(turned.damping(speed)),
        D=turned.sparse(H) if H.any() else None,
        # at a "speed" of 1 it counts as it is; what is factorised stays symmetric
        N=circulatory.tocsc() if crossed else None,
        parts=tuple(parts),
        model=model,
    )
    try:
        found = ComplexSolver(system, n_modes=n_modes).raw(1.0 if crossed else 0.0)
    except ValueError as error:
        raise ConvergenceError(f"{n_modes} modes at {speed:.6g} rad/s: {error}") from error
    kinds = np.array(found["kinds"], dtype=object)
    at = np.flatnonzero((kinds == "rigid") | (kinds == "oscillatory"))[:n_modes]
    right = found["right"][:, at]
    return PolesAt(speed, found["poles"][at], right, WhirlMeter(system).of(right))


def pole_slopes(turned: Turned, changes: Sequence[Change], at: PolesAt, n_parameters: int) -> ComplexArray:
    """Derivatives (n_parameters, m) of the poles `at` a speed over the `changes` of D: -y^T dD(p) psi / y^T D'(p) psi
    (Adhikari and Friswell, Int. J. Numer. Meth. Eng. 51 (2001) 1419, for matrices that are not symmetric). Poles that
    coincide have that of their mean. Raises ModelError as `Turned.factor` does.

    Left vectors are solved for beside the pole (inverse iteration), since those of the space that gave the poles are
    good for nothing where poles nearly coincide, as the two planes of a rotor do at low speed."""
    mass, damping = turned.sparse(turned.still[1]), turned.sparse(turned.damping(at.speed))
    out = np.zeros((n_parameters, at.poles.size), dtype=np.complex128)
    todo = np.arange(at.poles.size)
    while todo.size:
        own = todo[np.abs(at.poles[todo] - at.poles[todo[0]]) <= EQUAL * abs(at.poles[todo[0]])]
        todo = np.setdiff1d(todo, own)
        p, psi = complex(at.poles[own].mean()), at.right[:, own]
        if p == 0:
            continue  # motions of a rigid body stay at 0 Hz
        slope = 2 * p * mass + damping
        factor = turned.factor(p * (1 + BESIDE), at.speed)
        y, _ = np.linalg.qr(psi.conj())
        for _ in range(ROUNDS):
            y, _ = np.linalg.qr(factor.solve(np.asfortranarray(slope.T @ y), trans="T"))
        steep = y.T @ (slope @ psi)
        for change in changes:
            moved = change.between(y, psi, p, at.speed)
            out[change.parameter, own] -= np.trace(np.linalg.solve(steep, moved)) / own.size
    return out


def _names(model: Model | None, n: int) -> tuple[Dof, ...]:
    """Names of the rows of a system, by number where there is no model."""
    if model is None:
        return tuple(Dof(i + 1, 1) for i in range(n))
    fe: Any = model.fe
    return tuple(Dof(int(node), int(c)) for node, c in zip(fe.dof_nodes, fe.dof_components, strict=True))
