"""DOFs that the deck holds set free again: the same small model, in a basis in which they move too.

The basis gets, for every DOF set free, the static answer to its unit displacement with the others held (Craig and
Bampton, Coupling of substructures for dynamic analyses, AIAA J. 6 (1968) 1313-1319), and what the inertia of that
answer adds to it. With springs of any stiffness under these DOFs the model is then as good as the one it came from:
from held (the basis had that) to free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import ModelError
from femend.model.model import Model
from femend.model.places.place import AXES, Place
from femend.model.reduced.reduction import ReducedModel, Term, project_model
from femend.model.reduced.static_basis import static_responses, static_shift

__all__ = ["SPRING_SD", "freed", "reactions", "with_springs"]

FloatArray = NDArray[np.float64]

# prior ln standard deviation of a support's stiffness around where it is sought: free but for absurd values
SPRING_SD = 3.0
# share of a vector's length outside the span of the others up to which it is round-off; what inertia adds is small, but
# not nothing
NOTHING_NEW = 1e-9


def _positions(free: Model, rows: Sequence[int]) -> NDArray[np.int64]:
    """Positions of DOFs `rows` of the g-set among the independent ones of the model without supports.

    Raises ModelError for one that nothing but the supports holds: a dependent DOF, or one held at its GRID.
    """
    at = {int(g): i for i, g in enumerate(free.g_rows())}
    for row in rows:
        if int(row) not in at:
            dof = f"{int(free.node_ids[row // 6])} {AXES[row % 6]}"
            raise ModelError(f"DOF {dof} cannot be set free: no SPC set of the deck holds it; release it there by hand")
    return np.array([at[int(row)] for row in rows], dtype=np.int64)


def reactions(reduced: ReducedModel, rows: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """What held DOFs `rows` of the g-set take from the structure: their rows (n, r) of stiffness and mass in the basis,
    at the deck's values. Raises ModelError as `freed`."""
    free = reduced.model.unsupported
    V = reduced.V[free.g_rows()]
    at = _positions(free, rows)
    K, M = (np.asarray(A.tocsr()[at] @ V) for A in free.matrices())
    return K, M


def own_stiffness(model: Model, rows: Sequence[int]) -> FloatArray:
    """Stiffness (n,) against the motion of each of the held DOFs `rows` by itself, all others held; 0 for those that
    more than an SPC set holds (their GRID, the rigid element they belong to)."""
    free = model.unsupported
    at = {int(g): i for i, g in enumerate(free.g_rows())}
    diagonal = free.matrices()[0].diagonal()
    return np.array([diagonal[at[row]] if row in at else 0.0 for row in rows])


def freed(reduced: ReducedModel, rows: Sequence[int]) -> ReducedModel:
    """The model with held DOFs `rows` of the g-set free, and with its parameters alone: no form errors, nothing added.

    Rows that move in the basis already stay as they are. Raises ModelError for a DOF that no SPC set holds.
    """
    free = reduced.model.unsupported
    g = free.g_rows()
    V_a = reduced.V[g]
    own = reduced.model.g_rows()
    new = [row for row in rows if not reduced.V[row].any()]
    if new:
        inside = np.flatnonzero(np.isin(g, own))
        V_a = _extended(V_a, free, _positions(free, new), inside, static_shift(2 * np.pi * reduced.freq))
    made = project_model(free, V_a, np.asarray(free.transformation() @ V_a))
    made = replace(made, model=reduced.model, V_a=made.V[own])
    return made if reduced.beams is None else made.without(reduced.beams)


def _extended(V: FloatArray, free: Model, at: NDArray[np.int64], inside: NDArray[np.int64], shift: float) -> FloatArray:
    """The basis V (n_a, r) with static answers to unit displacements of DOFs `at`, and what their inertia adds; DOFs
    `inside` answer, all others are held."""
    K, M = (A.tocsc() for A in free.matrices())
    inner = (K + shift * M)[inside][:, inside]
    static = np.zeros((V.shape[0], len(at)))
    static[at, np.arange(len(at))] = 1.0
    static[inside] = static_responses(inner, -np.asarray((K + shift * M)[inside][:, at].toarray()))
    inertial = np.zeros_like(static)
    inertial[inside] = static_responses(inner, np.asarray(M @ static)[inside])
    for column in np.hstack([static, inertial]).T:
        V = _joined(V, column, M)
    return V


def _joined(V: FloatArray, column: FloatArray, M: Any) -> FloatArray:
    """The M-orthonormal basis with one more column, if that adds anything."""
    length = np.sqrt(max(column @ (M @ column), 0.0))
    vector = column.copy()
    for _ in range(2):
        vector = vector - V @ (V.T @ (M @ vector))
    left = np.sqrt(max(vector @ (M @ vector), 0.0))
    return np.hstack([V, (vector / left)[:, None]]) if left > NOTHING_NEW * length and left > 0 else V


def with_springs(place: Place, reduced: ReducedModel) -> ReducedModel:
    """A model whose DOFs under `place.springs` are free, with a spring to ground under each and its ln stiffness over
    the place's as one more unknown."""
    n = len(reduced.names)
    terms, names = [], []
    for i, (row, k) in enumerate(place.springs):
        v = reduced.V[row]
        terms.append(Term(((n + i, 1.0),), k * np.outer(v, v)))
        names.append(f"spring at {place.nodes[0]} {AXES[row % 6]}")
    return replace(
        reduced,
        terms=(*reduced.terms, *terms),
        names=(*reduced.names, *names),
        prior_sd=np.append(reduced.prior_sd, np.full(len(names), SPRING_SD)),
        extra=reduced.extra + len(names),
        members=(*reduced.members, place),
    )
