"""Rows without mass taken out of a turning system: exactly, since they follow the others as springs do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.analysis.turning import TurningSystem

__all__ = ["Condensed", "condensed"]

# rows that stay are coupled with one another by those that go: matrices are dense up to these sizes
STAYING, ENTRIES = 1000, 4_000_000
# pivot beside the largest from which rows have no stiffness of their own
PIVOT = 1e-12


@dataclass(frozen=True, eq=False)
class Condensed:
    """A `system` of the rows with mass (r,), and `T` (n, r) from these to all n rows; None where no row went.

    `gone` (m,) are the rows that went, `solve` solves with their stiffness while the others are held.
    """

    system: TurningSystem
    T: NDArray[Any] | None = None
    gone: NDArray[np.int64] | None = None
    solve: Callable[[NDArray[Any]], NDArray[Any]] | None = None

    def whole(self, v: NDArray[Any]) -> NDArray[Any]:
        """Shapes `v` (r, m) at all rows."""
        return v if self.T is None else np.asarray(self.T @ v)

    def kept(self, f: NDArray[Any]) -> NDArray[Any]:
        """Forces `f` (n, m) at all rows as they act at those with mass."""
        return f if self.T is None else np.asarray(self.T.T @ f)

    def held(self, b_out: NDArray[np.float64], b_in: NDArray[np.float64]) -> NDArray[Any] | float:
        """What massless rows give way by themselves (n_out, n_in) between the patterns `b_out`, `b_in` (n, m)."""
        if self.gone is None or self.solve is None:
            return 0.0
        return np.asarray(b_out[self.gone].T @ self.solve(b_in[self.gone]))


def condensed(system: TurningSystem) -> Condensed:
    """`system` without the rows that have neither mass nor damping nor a term that goes with the speed.

    With K = [[K_rr, K_rm], [K_mr, K_mm]] these rows m say u_m = -K_mm^-1 K_mr u_r at every frequency, so that modes
    are those of K_rr - K_rm K_mm^-1 K_mr and the other matrices as they are (Guyan, AIAA J. 3 (1965) 380: exact where
    K_mm carries no mass); structural damping makes K complex, K + iD. In a companion form massless rows are infinite
    eigenvalues without enough vectors, near which finite ones lose their left vectors. The `system` itself comes back
    where all rows have mass or none, where massless rows lack stiffness, and where what stays would be large and
    dense.
    """
    from scipy.sparse import csc_array

    gone = np.ones(len(system.dofs), dtype=bool)
    for a in (system.M, system.C, system.G, system.N, system.S):
        if a is not None:
            gone &= (abs(a).sum(axis=0) == 0) & (abs(a).sum(axis=1) == 0)
    r, m = np.flatnonzero(~gone), np.flatnonzero(gone)
    if not m.size or not r.size or r.size > STAYING or r.size * m.size > ENTRIES:
        return Condensed(system)
    K = system.K.tocsc() if system.D is None else (system.K + 1j * system.D).tocsc()
    solve = _solver(K[m][:, m])
    if solve is None:
        return Condensed(system)
    carried = -solve(K[m][:, r].toarray())
    stiffness = K[r][:, r].toarray() + K[r][:, m] @ carried
    stiffness = (stiffness + stiffness.T) / 2
    T = np.zeros((len(system.dofs), r.size), dtype=carried.dtype)
    T[r], T[m] = np.eye(r.size), carried

    def some(a: csc_array | None) -> csc_array | None:
        return None if a is None else csc_array(a.tocsc()[r][:, r])

    small = replace(
        system,
        M=csc_array(system.M.tocsc()[r][:, r]),
        K=csc_array(stiffness.real.copy()),
        dofs=tuple(system.dofs[i] for i in r),
        C=some(system.C),
        D=None if system.D is None else csc_array(stiffness.imag.copy()),
        G=some(system.G),
        N=some(system.N),
        S=some(system.S),
        model=None,
    )
    return Condensed(small, T, m, solve)


def _solver(K: Any) -> Callable[[NDArray[Any]], NDArray[Any]] | None:
    """Solves with the stiffness of massless rows; None where they have none in some direction."""
    from scipy.sparse.linalg import splu

    try:
        factor = splu(K.tocsc())
    except RuntimeError:
        return None
    pivots = np.abs(factor.U.diagonal())
    if not pivots.min() > PIVOT * pivots.max():
        return None

    def solve(b: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(factor.solve(np.asfortranarray(b, dtype=K.dtype)))

    return solve
