"""Supports of the deck that do not hold what it holds: released, or on springs, as another state of the structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate import pair_modes
from femend.dof import COMPONENTS, Dof
from femend.errors import PretestError
from femend.estimate.updating import affine_matrices, modal_system
from femend.model import Model
from femend.model.terms.linear_terms import diagonal
from femend.model.terms.supports import held_rows
from femend.numerals import listed
from femend.pretest.information import PlannedTest

__all__ = ["GivingSupport", "support_modes", "with_state"]

FloatArray = NDArray[np.float64]
# nodes that a name tells
NAMED = 3


@dataclass(frozen=True, slots=True)
class GivingSupport:
    """The support at `nodes` gives way in the `components` 1 to 6: released, or at each node on springs `k`, one for
    each component (force over length, or moment over angle)."""

    nodes: tuple[int, ...]
    components: tuple[int, ...]
    k: tuple[float, ...] | None = None

    @property
    def name(self) -> str:
        """What it is, whatever its stiffness."""
        how = "released" if self.k is None else "on springs"
        return (
            f"support at {listed(self.nodes, NAMED)} {how} in {', '.join(COMPONENTS[c - 1] for c in self.components)}"
        )


def support_modes(
    model: Model, support: GivingSupport, seen: Sequence[Dof], n_modes: int
) -> tuple[FloatArray, FloatArray]:
    """Frequencies (n,) in Hz and mass-normalised shapes (n_seen, n) of a deck of which the `support` gives way.

    They are those of the deck itself with other supports, not of a series about it. There are so many that the first
    `n_modes` of the deck have a successor: as many more as DOFs become free, since each lets one frequency at most fall
    below a given one (Courant and Fischer; Rayleigh's theorem on constraints). Raises PretestError for a DOF that no
    SPC set of the deck holds.
    """
    free = model.unsupported
    held = held_rows(free, model)
    row = {(int(free.fe.dof_nodes[i]), int(free.fe.dof_components[i])): int(i) for i in held}
    wanted = [(n, c) for n in support.nodes for c in support.components]
    for node, c in wanted:
        if (node, c) not in row:
            own = ", ".join(COMPONENTS[b - 1] for a, b in row if a == node)
            what = f"there it holds {own}" if own else "it holds nothing there"
            raise PretestError(
                f"no SPC set of the deck holds {COMPONENTS[c - 1]} at node {node} ({what}), so that nothing gives way; "
                "name directions that are held"
            )
    released = np.array([row[pair] for pair in wanted], dtype=np.int64)
    keep = np.setdiff1d(np.arange(free.fe.n_a), np.setdiff1d(held, released))
    K, M = (A.tocsc()[keep][:, keep] for A in free.matrices())
    stiffness = np.tile(np.zeros(len(support.components)) if support.k is None else support.k, len(support.nodes))
    springs = diagonal(len(keep), np.searchsorted(keep, released), stiffness)
    T = free.transformation().tocsr()[[free.row(d) for d in seen]][:, keep]
    signs = np.array([float(d.sign) for d in seen])
    n = min(n_modes + len(released), len(keep))
    system = modal_system(affine_matrices({"springs": springs}, M, K_fixed=K), T.multiply(signs[:, None]), n)
    state = system.solve(np.ones(1))
    return np.asarray(state.value("freq")), np.asarray(state.value("phi"))


def with_state(
    plan: PlannedTest, name: str, freq: ArrayLike, phi: ArrayLike, *, freq_sd: ArrayLike, shape_sd: ArrayLike
) -> PlannedTest:
    """The `plan` with one more unknown, `name`: 0 is the structure of the plan, 1 one with modes `freq` (n,) in Hz and
    `phi` (n_places, n).

    Between them values go along the secant, so that a change of any size is told as it is; where its size is free, it
    is linear. Each mode of the plan goes over into the one most like it at all places (`pair_modes`); as long as the
    plan's, since no test tells its scale. `freq_sd` and `shape_sd` are those that the plan was made with. Raises
    PretestError where a mode of the plan has no successor that moves at the places.
    """
    f, shapes = np.asarray(freq, dtype=np.float64), np.asarray(phi, dtype=np.float64)
    m = plan.freq.size
    sd = np.broadcast_to(np.asarray(shape_sd, dtype=np.float64), plan.motion.shape)
    own = plan.motion * sd  # the largest component is 1
    mate = {p.a: p.b for p in pair_modes(own, shapes, mac_min=0.0).pairs}
    if len(mate) < m:
        raise PretestError(
            f"{name}: of the plan's {m} modes {len(mate)} have a successor that moves at the {plan.n_places} places; "
            "allow more places"
        )
    after = [mate[r] for r in range(m)]
    there = shapes[:, after]
    sign = np.where(np.einsum("ij,ij->j", own, there) < 0, -1.0, 1.0)
    there = there * (sign * np.linalg.norm(own, axis=0) / np.linalg.norm(there, axis=0))
    moved = (f[after] - plan.freq) / (np.broadcast_to(np.asarray(freq_sd, dtype=np.float64), (m,)) * plan.freq)
    n = len(plan.names)
    prior = np.eye(n + 1)
    prior[:n, :n] = plan.prior
    return replace(
        plan,
        names=(*plan.names, name),
        prior=prior,
        size=np.append(plan.size, 1.0),
        frequencies=np.hstack([plan.frequencies, moved[:, None]]),
        shapes=np.concatenate([plan.shapes, ((there - own) / sd)[:, :, None]], axis=2),
    )
