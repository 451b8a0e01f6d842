"""Real normal modes of sparse K and M as a `ModeSet`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend import _core
from femend.data.mode_set import ModeSet
from femend.dof import Dof
from femend.errors import SingularModelError
from femend.numerals import listed

__all__ = ["SolvedModes", "modes_memory", "solve_modes"]


@dataclass(frozen=True, slots=True, eq=False)
class SolvedModes:
    """Modes with the evidence that they are right.

    `residual` (n_modes,) is |K phi - lambda M phi| / (|lambda - sigma| |M phi|); `info` tells the shift `sigma` in
    (rad/s)^2, the number of rigid-body modes `n_rigid`, the number of modes below the upper end by inertia `counted`
    (None for small models, which are solved completely), the work done, and the `eigenvalues` in (rad/s)^2.
    """

    modes: ModeSet
    residual: NDArray[np.float64]
    info: dict[str, Any]


def modes_memory(
    indptr: NDArray[np.int32] | NDArray[np.int64],
    indices: NDArray[np.int32] | NDArray[np.int64],
    n_modes: int | None = None,
    *,
    symbolic: _core.Symbolic | None = None,
) -> int:
    """Bytes that `solve_modes` will add to what is in use for `n_modes` of this pattern, about.

    `indptr`, `indices` are the compressed columns of K and M; `symbolic`, where at hand, saves the ordering. Two
    factors (the second counts the modes at the upper end), the Lanczos basis, the modes with their products and the
    values of K - sigma M; without `n_modes`, as for a band, the least. `solve_modes` compares this with what the
    machine, a container and `ulimit -v` leave and raises MemoryLimitError before it factorises. Raises ValueError for
    a pattern that is none.

    >>> modes_memory(np.array([0, 2, 4]), np.array([0, 1, 0, 1]), 1) < 1000
    True
    """
    return (symbolic or _core.Symbolic(indptr, indices)).modes_memory(n_modes)


def solve_modes(
    indptr: NDArray[np.int32] | NDArray[np.int64],
    indices: NDArray[np.int32] | NDArray[np.int64],
    K: NDArray[np.float64],
    M: NDArray[np.float64],
    dofs: Sequence[Dof],
    *,
    n_modes: int | None = None,
    f_max: float | None = None,
    zeta: ArrayLike = 0.0,
    start: NDArray[np.float64] | None = None,
    symbolic: _core.Symbolic | None = None,
) -> SolvedModes:
    """The lowest `n_modes`, or all modes up to `f_max` in Hz, of K phi = lambda M phi; none is missed.

    `indptr`, `indices` are the compressed columns of one pattern with both triangles, `K`, `M` (nnz,) the values on it,
    `dofs` (n,) the names of the rows. `zeta` is the damping fraction given to the modes, one value or one per mode.
    `start` (n, k) are shapes near the wanted ones, `symbolic` the symbolic factor of the pattern; both only save time.

    Raises SingularModelError naming the DOFs that have neither stiffness nor mass, ModelError for a stiffness with
    negative eigenvalues, a mass below nothing (with its rows) or values that are not finite, MemoryLimitError for modes
    that do not fit into memory (before anything is factorised: `modes_memory`), ConvergenceError, and ValueError for
    arguments that do not fit.

    Block Lanczos with shift-invert (Grimes, Lewis and Simon 1994), inertia count by Sylvester's law.

    >>> import numpy as np
    >>> dofs = [Dof(1, 3), Dof(2, 3)]
    >>> K = np.array([2.0, -1.0, -1.0, 2.0]) * (2 * np.pi) ** 2
    >>> M = np.array([1.0, 0.0, 0.0, 1.0])
    >>> solved = solve_modes(np.array([0, 2, 4]), np.array([0, 1, 0, 1]), K, M, dofs, n_modes=2)
    >>> solved.modes.freq.round(6).tolist()
    [1.0, 1.732051]
    """
    names = list(dofs)
    if len(names) != len(indptr) - 1:
        raise ValueError(f"{len(names)} DOF names for a model of {len(indptr) - 1} rows; name every row once")
    try:
        freq, phi, residual, info = _core.modes(
            indptr, indices, K, M, n_modes=n_modes, f_max=f_max, start=start, symbolic=symbolic
        )
    except SingularModelError as error:
        moving = tuple(str(names[int(row)]) for row in error.dofs)
        shown = listed(moving, 12)
        message = (
            f"{len(moving)} DOF(s) move without stiffness and without mass: {shown}; constrain them, or give them "
            "stiffness or mass"
        )
        raise SingularModelError(message, dofs=moving) from error
    damping = np.broadcast_to(np.asarray(zeta, dtype=np.float64), freq.shape)
    return SolvedModes(ModeSet(freq, damping, phi, tuple(names)), residual, info)
