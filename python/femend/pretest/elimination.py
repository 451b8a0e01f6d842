"""Sensors by taking places away: least AutoMAC off the diagonal, and Guyan's reduction place by place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import PretestError
from femend.pretest.placement import Placement, candidates, target_shapes

__all__ = ["iterative_guyan", "mac_elimination"]

FloatArray = NDArray[np.float64]

# full matrices of this size are eliminated DOF by DOF in well under a minute
FULL = 4000


def mac_elimination(
    phi: ArrayLike, n_sensors: int, *, allowed: ArrayLike | None = None, placed: Sequence[int] = ()
) -> Placement:
    """`n_sensors` rows of `phi` (n_dof, n_modes) whose AutoMAC is least off the diagonal.

    From all `allowed` rows the one is taken away without which the largest off-diagonal MAC is least, until
    `n_sensors` are left (the criterion of Carne and Dohrmann, IMAC 13, 1995, backwards). `allowed`, `placed` as in
    `effective_independence`. The score is the largest off-diagonal MAC. Raises PretestError as there, and for a single
    mode, which has no MAC with another.

    >>> mac_elimination([[1.0, 1.0], [1.0, -1.0], [1.0, 0.9]], 2).rows.tolist()
    [0, 1]
    """
    x = target_shapes(phi)
    if x.shape[1] < 2:
        raise PretestError("one target mode has no MAC with another; take effective independence")
    rows, kept = candidates(x.shape[0], n_sensors, allowed, placed)
    x = x[rows] / np.maximum(np.abs(x[rows]).max(axis=0), 1e-300)
    fixed = np.isin(rows, kept)
    alive = np.arange(len(rows))
    score = [_worst((x.T @ x)[None])[0]]
    while len(alive) > n_sensors:
        part = x[alive]
        worst = _worst(part.T @ part - part[:, :, None] * part[:, None, :])
        worst[fixed[alive]] = np.inf
        k = int(np.argmin(worst))
        score.append(float(worst[k]))
        alive = np.delete(alive, k)
    return Placement("MAC elimination", rows[alive], kept, np.array(score), "largest off-diagonal MAC")


def _worst(G: FloatArray) -> FloatArray:
    """Largest off-diagonal MAC (n,) of Gram matrices (n, m, m); a mode that does not move counts 1 with all."""
    d = np.diagonal(G, axis1=1, axis2=2)
    scale = d[:, :, None] * d[:, None, :]
    seen = d > 1e-12 * max(float(d.max()), 1e-300)
    both = seen[:, :, None] & seen[:, None, :]
    value = np.where(both, G**2 / np.where(both, scale, 1.0), 1.0)
    own = np.arange(G.shape[1])
    value[:, own, own] = 0.0
    return np.asarray(value.max(axis=(1, 2)))


def iterative_guyan(
    K: Any, M: Any, n_sensors: int, *, allowed: ArrayLike | None = None, placed: Sequence[int] = ()
) -> Placement:
    """`n_sensors` DOFs that carry the low modes of `K`, `M` (n, n) best after static condensation.

    DOF after DOF the one with the largest K_ii / M_ii is condensed out by Guyan's reduction, whose rest is used for the
    next choice (Henshell and Ong 1974; Penny, Friswell and Garvey 1994, AIAA J. 32, 407-414). DOFs that are not
    `allowed` go first. The score is the least frequency sqrt(K_ii / M_ii) / 2 pi in Hz of each DOF taken away.
    `allowed`, `placed` as in `effective_independence`. Raises PretestError for more than 4000 DOFs, for sizes that do
    not fit, and for a DOF without stiffness that would have to go.

    >>> K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    >>> iterative_guyan(K, np.diag([1.0, 1.0, 4.0]), 1).rows.tolist()
    [2]
    """
    k, m = _full(K, "stiffness"), _full(M, "mass")
    if k.shape != m.shape:
        raise PretestError(f"stiffness {k.shape} and mass {m.shape} are not of one model")
    n = k.shape[0]
    rows, kept = candidates(n, n_sensors, allowed, placed)
    outside = np.ones(n, dtype=bool)
    outside[rows] = False
    fixed = np.zeros(n, dtype=bool)
    fixed[kept] = True
    alive = np.arange(n)
    score = []
    while len(alive) > n_sensors:
        stiff, heavy = np.diag(k).copy(), np.diag(m)
        ratio = stiff / np.maximum(heavy, 1e-14 * np.abs(heavy).max())
        may_go = outside[alive] if outside[alive].any() else ~fixed[alive]
        i = int(np.argmax(np.where(may_go, ratio, -np.inf)))
        if stiff[i] <= 1e-14 * np.abs(stiff).max():
            raise PretestError(
                f"DOF {int(alive[i])} has no stiffness and cannot be condensed out; hold rigid-body motion, or place it"
            )
        score.append(float(np.sqrt(ratio[i]) / (2 * np.pi)))
        t = k[i] / stiff[i]
        k = k - np.outer(t, t) * stiff[i]
        m = m - np.outer(t, m[i]) - np.outer(m[i], t) + np.outer(t, t) * heavy[i]
        keep = np.arange(len(alive)) != i
        k, m, alive = k[np.ix_(keep, keep)], m[np.ix_(keep, keep)], alive[keep]
    return Placement("iterative Guyan", alive.astype(np.int64), kept, np.array(score or [np.nan]), "frequency in Hz")


def _full(A: Any, what: str) -> FloatArray:
    size = A.shape if hasattr(A, "shape") else np.shape(A)
    if len(size) != 2 or size[0] != size[1]:
        raise PretestError(f"the {what} matrix has shape {size}; it is (n, n)")
    if size[0] > FULL:
        raise PretestError(
            f"the {what} matrix has {size[0]} DOFs, more than {FULL}: reduce it to the accessible DOFs first (guyan)"
        )
    return np.array(A.toarray() if hasattr(A, "toarray") else A, dtype=np.float64)
