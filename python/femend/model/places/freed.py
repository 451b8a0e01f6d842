"""Motions that the deck holds set free again: the same small model, in a basis in which they move too.

The basis gets, for every motion set free, of one DOF or of a region of them as a rigid whole, the static answer to a
unit of it with the others held (Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA J. 6 (1968)
1313-1319), and what the inertia of that answer adds to it. With springs of any stiffness against these motions the
model is then as good as the one it came from: from held (the basis had that) to free.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import ModelError
from femend.model.model import Model
from femend.model.places.held_motion import HeldMotion
from femend.model.places.place import AXES, Place
from femend.model.reduced.reduction import ReducedModel, Term, project_model, ritz_frequencies
from femend.model.reduced.static_basis import static_responses, static_shift
from femend.model.reduced.wider import Basis

__all__ = ["SPRING_SD", "freed", "reactions", "with_springs"]

FloatArray = NDArray[np.float64]

# prior ln standard deviation of a support's stiffness around where it is sought: free but for absurd values
SPRING_SD = 3.0
# share of a vector's length outside the span of the others up to which it is round-off; what inertia adds is small, but
# not nothing
NOTHING_NEW = 1e-9


def _pattern(free: Model, motions: Sequence[HeldMotion]) -> FloatArray:
    """Displacements (n_a, n) of the independent DOFs of the model without supports in a unit of each motion.

    Raises ModelError for a DOF that nothing but the supports holds: a dependent one, or one held at its GRID.
    """
    at = {int(g): i for i, g in enumerate(free.g_rows())}
    T = np.zeros((len(at), len(motions)))
    for column, motion in zip(T.T, motions, strict=True):
        for row, value in zip(motion.rows, motion.values, strict=True):
            if row not in at:
                dof = f"{int(free.node_ids[row // 6])} {AXES[row % 6]}"
                raise ModelError(
                    f"DOF {dof} cannot be set free: no SPC set of the deck holds it; release it there by hand"
                )
            column[at[row]] = value
    return T


def reactions(reduced: ReducedModel, motions: Sequence[HeldMotion]) -> tuple[FloatArray, FloatArray]:
    """What held `motions` take from the structure: their rows (n, r) of stiffness and mass in the basis, at the deck's
    values. Raises ModelError as `freed`."""
    free = reduced.model.unsupported
    V = reduced.V[free.g_rows()]
    T = _pattern(free, motions)
    K, M = (np.asarray((A @ T).T @ V) for A in free.matrices())
    return K, M


def own_stiffness(model: Model, motions: Sequence[HeldMotion]) -> FloatArray:
    """Stiffness (n,) against each of the held `motions` by itself, all others held; 0 for those of DOFs that more than
    an SPC set holds (their GRID, the rigid element they belong to)."""
    free = model.unsupported
    there = {int(g) for g in free.g_rows()}
    known = [i for i, motion in enumerate(motions) if there.issuperset(motion.rows)]
    T = _pattern(free, [motions[i] for i in known])
    own = np.zeros(len(motions))
    own[known] = np.einsum("ij,ij->j", T, free.matrices()[0] @ T)
    return own


def freed(reduced: ReducedModel, motions: Sequence[HeldMotion], of: Sequence[HeldMotion] = ()) -> ReducedModel:
    """The model with held `motions` free, and with its parameters alone: no form errors, nothing added.

    Where others of the motions `of` one support are asked for again and again, the model with all of these free is made
    once, and the others held in it. DOFs that move in the basis already stay as they are. Raises ModelError for a DOF
    that no SPC set holds.
    """
    own = reduced.model.g_rows()
    if of and set(motions) <= set(of):
        loose = _all_free(reduced, tuple(of))
        rest = [i for i, m in enumerate(of) if m not in motions and not reduced.V[list(m.rows)].any()]
        made = _held_again(loose, _amplitudes(loose, of)[rest], reduced.r)
    else:
        made = _free(reduced, motions)
    made = replace(made, model=reduced.model, V_a=made.V[own])
    return made if reduced.beams is None else made.without(reduced.beams)


# of every model the last one with motions free, which knows the deck without supports alone: its basis before, and the
# motions
_kept: weakref.WeakKeyDictionary[Model, tuple[Basis, tuple[HeldMotion, ...], ReducedModel]] = (
    weakref.WeakKeyDictionary()
)


def _all_free(reduced: ReducedModel, motions: tuple[HeldMotion, ...]) -> ReducedModel:
    """The model with all `motions` free, by its deck without supports; made once for a basis."""
    kept = _kept.get(reduced.model)
    if kept is None or kept[0] is not reduced.V or kept[1] != motions:
        kept = _kept[reduced.model] = (reduced.V, motions, _free(reduced, motions))
    return kept[2]


def _free(reduced: ReducedModel, motions: Sequence[HeldMotion]) -> ReducedModel:
    """The model with `motions` free, by its deck without supports: its basis first, then what they add."""
    free = reduced.model.unsupported
    g = free.g_rows()
    V_a = reduced.V[g]
    new = [motion for motion in motions if not reduced.V[list(motion.rows)].any()]
    if new:
        inside = np.flatnonzero(np.isin(g, reduced.model.g_rows()))
        V_a = _extended(V_a, free, _pattern(free, new), inside, static_shift(2 * np.pi * reduced.freq))
    return project_model(free, V_a, np.asarray(free.transformation() @ V_a))


def _held_again(loose: ReducedModel, moves: FloatArray, r: int) -> ReducedModel:
    """The `loose` model, the first `r` vectors of whose basis move no support, in what of its basis makes `moves`
    (n, r_loose), amplitudes of motions, nothing."""
    if not len(moves):
        return loose
    from scipy.linalg import block_diag, null_space

    size = np.linalg.norm(moves[:, r:], axis=1)
    at_rest = moves[size > 0, r:] / size[size > 0, None]
    N = block_diag(np.eye(r), null_space(at_rest) if len(at_rest) else np.eye(loose.r - r))
    within = (replace(t, K=_within(t.K, N), M=_within(t.M, N)) for t in loose.terms)
    K, M = N.T @ loose.K_fixed @ N, N.T @ loose.M_fixed @ N
    held = replace(loose, V=loose.V @ N, V_a=loose.V_a @ N, K_fixed=K, M_fixed=M, terms=tuple(within))
    return replace(held, freq=ritz_frequencies(held))


def _amplitudes(reduced: ReducedModel, motions: Sequence[HeldMotion]) -> FloatArray:
    """How far every vector of the basis goes along each of the `motions` (n, r) that make it together.

    Rotations of a region about two axes share displacements where it is skew to them, so that a projection on one of
    them is not how far it goes.
    """
    rows = sorted({row for motion in motions for row in motion.rows})
    at = {row: i for i, row in enumerate(rows)}
    T = np.zeros((len(rows), len(motions)))
    for column, motion in zip(T.T, motions, strict=True):
        column[[at[row] for row in motion.rows]] = motion.values
    size = np.linalg.norm(T, axis=0)
    return np.asarray(np.linalg.pinv(T / size) @ reduced.V[rows] / size[:, None])


def _within(A: FloatArray | None, N: FloatArray) -> FloatArray | None:
    return None if A is None else np.asarray(N.T @ A @ N)


def _extended(V: FloatArray, free: Model, T: FloatArray, inside: NDArray[np.int64], shift: float) -> FloatArray:
    """The basis V (n_a, r) with static answers to the displacements T (n_a, n) of held DOFs, and what their inertia
    adds; DOFs `inside` answer, all others are held."""
    K, M = (A.tocsc() for A in free.matrices())
    inner = (K + shift * M)[inside][:, inside]
    static = T.copy()
    static[inside] = static_responses(inner, -np.asarray(((K + shift * M) @ T)[inside]))
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
    """A model whose motions under `place.springs` are free, with a spring to ground under each and its ln stiffness
    over the place's as one more unknown."""
    n = len(reduced.names)
    together = place.motions or tuple(motion for motion, _ in place.springs)
    moves = _amplitudes(reduced, together)
    terms, names = [], []
    for i, (motion, k) in enumerate(place.springs):
        v = moves[together.index(motion)]
        terms.append(Term(((n + i, 1.0),), k * np.outer(v, v)))
        names.append(f"spring at {place.nodes[0]} {AXES[motion.component]}")
    return replace(
        reduced,
        terms=(*reduced.terms, *terms),
        names=(*reduced.names, *names),
        prior_sd=np.append(reduced.prior_sd, np.full(len(names), SPRING_SD)),
        extra=reduced.extra + len(names),
        members=(*reduced.members, place),
    )
