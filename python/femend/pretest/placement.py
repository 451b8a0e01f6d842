"""Sensors by the independence of the target modes: effective independence, and pivoted QR."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.dof import Dof
from femend.errors import PretestError
from femend.numerals import plain

__all__ = ["Placement", "effective_independence", "qr_placement"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# after so many removals the running inverse is made anew, so that rounding does not pile up
RENEW = 200


@dataclass(frozen=True, eq=False)
class Placement:
    """Rows (n_sensors,) that were chosen, ascending, by `method`; `score` is its `measure` while sensors went or came.

    `placed` are the rows that were there before and stay.
    """

    method: str
    rows: IntArray
    placed: IntArray
    score: FloatArray
    measure: str

    def dofs(self, dofs: Sequence[Dof]) -> tuple[Dof, ...]:
        """The chosen ones of `dofs`, which name the rows."""
        return tuple(dofs[int(i)] for i in self.rows)

    def __repr__(self) -> str:
        return (
            f"Placement({self.method}: {len(self.rows)} rows {self.rows.tolist()}; {self.measure} "
            f"{plain(self.score[-1])})"
        )


def effective_independence(
    phi: ArrayLike,
    n_sensors: int,
    *,
    allowed: ArrayLike | None = None,
    placed: Sequence[int] = (),
    sd: ArrayLike = 1.0,
) -> Placement:
    """`n_sensors` of the rows of `phi` (n_dof, n_modes) that keep the target modes independent.

    From all `allowed` rows (a mask (n_dof,) or row numbers; all by default) the one that adds least is taken away
    until `n_sensors` are left: the least E_i = phi_i Q^-1 phi_i^T, Q = sum phi_i^T phi_i (Kammer 1991, J. Guidance 14,
    251-259, eq. 15). A removal multiplies det Q by 1 - E_i; the score is its natural logarithm. `placed` rows stay and
    count among the `n_sensors`; `sd` (n_dof,) is the noise of each row, by which it is divided. Raises PretestError
    for complex shapes, fewer sensors than modes or than are placed, more than there are places, or modes that the
    allowed rows do not tell apart.

    >>> effective_independence([[1.0, 0.0], [0.9, 0.1], [0.0, 1.0]], 2).rows.tolist()
    [0, 2]
    """
    x = target_shapes(phi)
    noise = np.asarray(sd, dtype=np.float64)
    if not (np.isfinite(noise).all() and (noise > 0).all()):
        raise PretestError("the noise of a sensor is not above 0; give its standard deviation, or leave the row out")
    x = x / np.broadcast_to(noise[..., None] if noise.ndim else noise, x.shape)
    rows, kept = candidates(x.shape[0], n_sensors, allowed, placed)
    if n_sensors < x.shape[1]:
        raise PretestError(
            f"{n_sensors} sensors cannot tell {x.shape[1]} target modes apart; take as many sensors as modes, or fewer "
            "modes"
        )
    x = x[rows]
    fixed = np.isin(rows, kept)
    alive = np.ones(len(rows), dtype=bool)
    score: list[float] = []
    inverse, logdet, e = _information(x, rows)
    while True:
        score.append(logdet)
        if int(alive.sum()) == n_sensors:
            break
        if (len(score) % RENEW) == 0:
            inverse, logdet, part = _information(x[alive], rows[alive])
            e[alive] = part
        k = int(np.argmin(np.where(alive & ~fixed, e, np.inf)))
        rest = 1.0 - e[k]
        if rest < 1e-10:
            raise PretestError(
                f"without row {int(rows[k])} the target modes are no longer told apart, and {n_sensors} sensors are "
                "wanted besides the placed ones; ask for more sensors or fewer modes"
            )
        g = inverse @ x[k]
        e = e + (x @ g) ** 2 / rest
        inverse = inverse + np.outer(g, g) / rest
        logdet += float(np.log(rest))
        alive[k] = False
    return Placement("effective independence", rows[alive], kept, np.array(score), "ln det Q")


def qr_placement(
    phi: ArrayLike, n_sensors: int, *, allowed: ArrayLike | None = None, placed: Sequence[int] = ()
) -> Placement:
    """`n_sensors` rows of `phi` (n_dof, n_modes) by QR with column pivots of phi^T (Schedlinski and Link 1996, IMAC
    14).

    Each pivot is the row that is longest after what the rows before it span is taken out. When the span is full the
    rows left are pivoted anew. `allowed`, `placed` as in `effective_independence`: placed rows are taken out first. The
    score is the length of each pivot. Raises PretestError as there, but fewer sensors than modes are not refused.

    >>> qr_placement([[1.0, 0.0], [0.9, 0.1], [0.0, 0.8]], 2).rows.tolist()
    [0, 2]
    """
    x = target_shapes(phi)
    rows, kept = candidates(x.shape[0], n_sensors, allowed, placed)
    chosen = [int(r) for r in kept]
    free = [int(r) for r in rows if r not in set(chosen)]
    span = np.linalg.qr(x[chosen].T)[0] if 0 < len(chosen) < x.shape[1] else np.zeros((x.shape[1], 0))
    longest = float(np.linalg.norm(x[rows], axis=1).max())
    rest = x - x @ span @ span.T
    score: list[float] = []
    while len(chosen) < n_sensors:
        length = np.linalg.norm(rest[free], axis=1)
        k = int(np.argmax(length))
        if length[k] <= 1e-10 * longest:
            if not score or not np.any(x[free]):
                raise PretestError(f"after {len(chosen)} sensors no row left moves in the target modes; ask for fewer")
            rest = x.copy()  # the span is full: begin anew with the rows that are left
            length = np.linalg.norm(rest[free], axis=1)
            k = int(np.argmax(length))
        score.append(float(length[k]))
        row = free.pop(k)
        chosen.append(row)
        q = rest[row] / np.linalg.norm(rest[row])
        rest = rest - np.outer(rest @ q, q)
    return Placement("QR", np.array(sorted(chosen), dtype=np.int64), kept, np.array(score or [np.nan]), "pivot length")


def target_shapes(phi: ArrayLike) -> FloatArray:
    """Real, finite shapes `phi` (n_dof, n_modes); raises PretestError for others."""
    if np.iscomplexobj(phi):
        raise PretestError("the target modes are complex; plan with the real modes of the undamped model")
    x = np.asarray(phi, dtype=np.float64)
    if x.ndim != 2 or 0 in x.shape or not np.isfinite(x).all():
        raise PretestError(f"target shapes of shape {x.shape}: they are finite (n_dof, n_modes)")
    return x


def candidates(
    n_dof: int, n_sensors: int, allowed: ArrayLike | None, placed: Sequence[int]
) -> tuple[IntArray, IntArray]:
    """Ascending candidate rows (with the placed ones) of `n_dof` and the `placed` ones.

    `allowed` is a mask (n_dof,) or row numbers. Raises PretestError where `n_sensors` does not fit.
    """
    mask = np.ones(n_dof, dtype=bool)
    if allowed is not None:
        given = np.asarray(allowed)
        if given.dtype == bool:
            if given.shape != (n_dof,):
                raise PretestError(f"the mask of allowed rows has shape {given.shape} for {n_dof} DOFs")
            mask = given.copy()
        else:
            mask = np.zeros(n_dof, dtype=bool)
            mask[_rows(given, n_dof)] = True
    kept = np.unique(_rows(np.asarray(placed, dtype=np.int64), n_dof))
    mask[kept] = True
    rows = np.flatnonzero(mask).astype(np.int64)
    if not max(1, len(kept)) <= n_sensors <= len(rows):
        raise PretestError(
            f"{n_sensors} sensors are wanted; {len(kept)} are placed and {len(rows)} places are allowed (with those)"
        )
    return rows, kept


def _rows(given: NDArray, n_dof: int) -> IntArray:
    rows = np.asarray(given, dtype=np.int64).ravel()
    if rows.size and not (rows.min() >= 0 and rows.max() < n_dof):
        raise PretestError(f"row {int(rows.max())} is named, the shapes have rows 0 to {n_dof - 1}")
    return rows


def _information(x: FloatArray, rows: IntArray) -> tuple[FloatArray, float, FloatArray]:
    """Q^-1, ln det Q and E (n,) of the rows `x`; raises PretestError for modes that they do not tell apart."""
    q, s, Vt = np.linalg.svd(x, full_matrices=False)
    if len(s) < x.shape[1] or s[-1] <= 1e-10 * s[0]:
        raise PretestError(
            f"the {len(rows)} allowed rows do not tell the {x.shape[1]} target modes apart (rank "
            f"{int((s > 1e-10 * s[0]).sum())}); allow more places or take fewer modes"
        )
    return (Vt.T / s**2) @ Vt, float(2 * np.log(s).sum()), (q**2).sum(axis=1)
