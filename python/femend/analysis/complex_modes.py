"""Complex modes of damped and turning structures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.analysis.conservative import conservative, is_conservative
from femend.analysis.dense_modes import LARGEST, dense_modes, refined_modes
from femend.analysis.massless import condensed
from femend.analysis.turning import TurningSystem, as_turning_system
from femend.data.complex_modes import ComplexModes, PoleSet
from femend.data.mode_set import ModeSet
from femend.dof import Dof
from femend.errors import ConvergenceError, SingularModelError
from femend.model import Model
from femend.model.terms.spinning import SpinningPart
from femend.numerals import listed

__all__ = ["ComplexSolver", "complex_modes"]

_ANY = 1e3  # residuals are at most 1
_INFO = ("sigma", "counted", "n_rigid", "n_late", "vectors", "solves", "rounds")


class ComplexSolver:
    """Complex modes of one `system` at any number of speeds: one factorisation, one space that grows with the speeds.

    `n_modes` lowest by |pole|, or all up to `f_max` in Hz; `tolerance` bounds the residual of the whole model,
    `left_tolerance` that of left vectors. The stiffness at `speed` (rad/s) is the one that is factorised, where it
    is positive definite. Rows without mass are condensed (`condensed`, exact); of small systems the dense
    eigenproblem is solved where the core misses a tolerance (`dense_modes`). Raises what `solve_modes` raises:
    SingularModelError naming DOFs without stiffness and mass, ModelError for a stiffness with negative eigenvalues,
    ValueError for arguments that do not fit.
    """

    def __init__(
        self,
        system: TurningSystem,
        *,
        n_modes: int | None = None,
        f_max: float | None = None,
        speed: float = 0.0,
        tolerance: float = 1e-8,
        left_tolerance: float = 1e-4,
    ) -> None:
        self.system = system
        self._n_modes, self._f_max = n_modes, f_max
        self._tolerances = (tolerance, left_tolerance)
        self._condensed = condensed(system)
        self._dense, self._conservative = False, is_conservative(self._condensed.system)
        try:
            self._core = _core.ComplexProblem(
                *self._condensed.system.arrays(),
                n_modes,
                f_max,
                speed=float(speed),
                tolerance=tolerance,
                # left vectors of what neither loses nor gains energy are the conjugate right ones; with centrifugal
                # terms poles may be real
                left_tolerance=_ANY if self._conservative and system.S is None else left_tolerance,
            )
        except SingularModelError as error:
            moving = tuple(str(self._condensed.system.dofs[int(row)]) for row in error.dofs)
            shown = listed(moving, 12)
            message = (
                f"{len(moving)} DOF(s) move without stiffness and without mass: {shown}; constrain them, or give them "
                "stiffness or mass"
            )
            raise SingularModelError(message, dofs=moving) from error
        self._nodes = _at_nodes(system)

    @property
    def dofs(self) -> tuple[Dof, ...]:
        """Names of the rows of the shapes that `solve` returns: all DOFs of the nodes of a model, else those of the
        system."""
        return self._nodes[1]

    def at_nodes(self, v: NDArray[Any]) -> NDArray[Any]:
        """Rows of `dofs` from rows of the system: `v` (n, m)."""
        T = self._nodes[0]
        return v if T is None else np.asarray(T @ v)

    def to_system(self, f: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forces `f` (n_dof, m) at `dofs` as forces at the rows of the system."""
        T = self._nodes[0]
        return f if T is None else np.asarray(T.T @ f)

    @property
    def n_masses(self) -> int:
        """Rows that are left with massless ones condensed: no more modes than that oscillate."""
        return len(self._condensed.system.dofs)

    def receptance(
        self,
        b_out: NDArray[np.float64],
        b_in: NDArray[np.float64],
        s: NDArray[np.complex128],
        speed: float,
        tolerance: float,
    ) -> NDArray[np.complex128]:
        """b_out^T D(s)^-1 b_in (n_s, n_out, n_in) for patterns (n, m) over the rows of the system at `s` (n_s,) in
        rad/s, to `tolerance` of the forces. Raises ConvergenceError."""
        small = self._condensed
        out, into = small.kept(b_out), small.kept(b_in)
        # structural damping of massless rows makes forces complex: their parts go side by side
        parts = [np.hstack([b.real, b.imag]) if np.iscomplexobj(b) else b for b in (out, into)]
        left, right = (np.ascontiguousarray(b) for b in parts)
        found = self._core.receptance(left, right, s, speed, tolerance=tolerance)
        if np.iscomplexobj(out):
            found = found[:, : out.shape[1]] + 1j * found[:, out.shape[1] :]
            found = found[..., : into.shape[1]] + 1j * found[..., into.shape[1] :]
        return np.asarray(found + small.held(b_out, b_in))

    def raw(self, speed: float) -> dict[str, Any]:
        """Poles, kinds, vectors at the rows of the system and evidence at `speed` (rad/s), as the core gives them.

        Raises ConvergenceError, and ValueError where fewer modes oscillate than asked for.
        """
        found = (self._small(float(speed)) if self._dense else None) or self._large(float(speed))
        return {**found, "right": self._condensed.whole(found["right"]), "left": self._condensed.whole(found["left"])}

    def _large(self, speed: float) -> dict[str, Any]:
        """The modes of the core; the dense ones, from then on, where it misses a tolerance for a small system."""
        fits = self.n_masses <= LARGEST
        try:
            found = self._core.modes(speed)
        except (ConvergenceError, ValueError) as error:
            missed = isinstance(error, ConvergenceError) or "complex system is singular" in str(error)
            small = self._small(speed) if missed and fits else None
            if small is not None:
                self._dense = True
                return small
            if missed and not isinstance(error, ConvergenceError):
                raise ConvergenceError(
                    f"the modes at {speed:.6g} rad/s have no left vectors that rounding leaves: some DOFs have next to "
                    "no mass beside the others; ask for fewer modes, give light parts their mass (RHO of MAT1), or "
                    "leave them without any"
                ) from error
            raise
        if self._conservative:
            found = conservative(self._condensed.system, speed, found)
        if not self._misses(found):
            return found
        small = self._small(speed) if fits else None
        if small is not None and self._worst(small) < self._worst(found):
            self._dense = True
            return small
        # where the space is the whole one the core has nothing to add
        return refined_modes(self._condensed.system, speed, found) if found["vectors"] == self.n_masses else found

    def _misses(self, found: dict[str, Any]) -> bool:
        flexible = np.array(found["kinds"], dtype=object) != "rigid"
        sides = zip(("residual", "residual_left"), self._tolerances, strict=True)
        return any(np.any(found[name][flexible] > tolerance) for name, tolerance in sides)

    @staticmethod
    def _worst(found: dict[str, Any]) -> float:
        flexible = np.array(found["kinds"], dtype=object) != "rigid"
        return max(float(np.max(found[n][flexible], initial=0.0)) for n in ("residual", "residual_left"))

    def _small(self, speed: float) -> dict[str, Any] | None:
        return dense_modes(self._condensed.system, speed, self._n_modes, self._f_max)

    def solve(self, speed: float = 0.0) -> ComplexModes:
        """The modes at `speed` W in rad/s. Raises ConvergenceError where a residual stays too large."""
        found = self.raw(speed)
        kinds = np.array(found["kinds"], dtype=object)
        right, left = self.at_nodes(found["right"]), self.at_nodes(found["left"])

        def some(kind: str) -> PoleSet:
            at = np.flatnonzero(kinds == kind)
            return PoleSet(found["poles"][at], right[:, at], left[:, at], found["modal_a"][at], found["residual"][at])

        at = np.flatnonzero((kinds == "rigid") | (kinds == "oscillatory"))
        poles = found["poles"][at]
        size = np.abs(poles)
        zeta = np.where(size > 0, -poles.real / np.where(size > 0, size, 1.0), 0.0)
        return ComplexModes(
            ModeSet(size / (2 * np.pi), zeta, right[:, at], self.dofs),
            poles,
            left[:, at],
            np.where(kinds[at] == "rigid", 0.0, found["modal_a"][at]),
            found["residual"][at],
            found["residual_left"][at],
            found["condition"][at],
            some("overdamped"),
            some("mirrored"),
            float(speed),
            {name: found[name] for name in _INFO},
        )


def _at_nodes(system: TurningSystem) -> tuple[Any, tuple[Dof, ...]]:
    """Matrix from the system's rows to the DOFs of all nodes of its model, and their names."""
    model = system.model
    if model is None:
        return None, system.dofs
    grid = ~model.is_scalar
    dofs = tuple(Dof(int(n), c) for n in model.node_ids[grid] for c in range(1, 7))
    return model.transformation()[np.repeat(grid, 6)], dofs


def complex_modes(
    system: Model | TurningSystem,
    *,
    n_modes: int | None = None,
    f_max: float | None = None,
    speed: float = 0.0,
    parts: Sequence[SpinningPart] = (),
    preload: Mapping[Dof, float] | None = None,
    factors: Mapping[str, float] | None = None,
    tolerance: float = 1e-8,
    left_tolerance: float = 1e-4,
) -> ComplexModes:
    """The lowest `n_modes` complex modes (10 by default), or all up to `f_max` in Hz, at the shaft's `speed` in rad/s.

    Of M u'' + (C + W G) u' + (K + W N + W^2 S + i D) u = 0: dashpots, structural damping and, with `parts` that turn,
    gyroscopic moments. `system` is a model, with its own damping, the `preload` that stiffens it and `factors` on its
    parameters, or a `TurningSystem`, whose matrices are taken as they are. Modes come by |pole|; shapes are at every
    DOF of a model's nodes, psi^H M psi = 1. `tolerance` bounds the residuals |D(pole) psi| beside the sum of their
    terms, `left_tolerance` those of left vectors where matrices are not symmetric: modal a is as good as that, poles
    to the product of both.

    Galerkin projection on a second-order Krylov space of K^-1 (Lu, Su and Bai, SIAM J. Matrix Anal. Appl. 37 (2016)
    195; linearisation Tisseur and Meerbergen, SIAM Review 43 (2001) 235), enlarged by corrections (the equation of
    Jacobi-Davidson, solved roughly: Bai, Sleijpen and van der Vorst in Templates for the Solution of Algebraic
    Eigenvalue Problems, SIAM 2000, chapter 9) until the residuals of the whole model are small, and then by a random
    probe, which has to find nothing new. `info["counted"]` undamped modes at rest up to the highest pole are proved
    by inertia and are in the space (None: free or small models, whose real modes are all in it).

    Raises SingularModelError, ModelError, ConvergenceError, and ValueError: for arguments that do not fit, or more
    modes than oscillate (the message tells how many are overdamped).

    >>> from scipy.sparse import csc_array
    >>> one = csc_array([[1.0]])
    >>> found = complex_modes(TurningSystem(one, 100 * one, (Dof(1, 3),), C=2 * one), n_modes=1)
    >>> complex(np.round(found.poles[0], 6))
    (-1+9.949874j)
    >>> found.modes.zeta.round(6).tolist()
    [0.1]
    """
    system = as_turning_system(system, parts, preload, factors)
    if n_modes is None and f_max is None:
        n_modes = min(10, len(system.dofs))
    solver = ComplexSolver(
        system, n_modes=n_modes, f_max=f_max, speed=speed, tolerance=tolerance, left_tolerance=left_tolerance
    )
    return solver.solve(speed)
