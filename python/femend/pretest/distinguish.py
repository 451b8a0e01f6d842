"""Could a test tell one explanation from another? Candidates of missing physics beside the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import PretestError
from femend.estimate.updating import AffineMatrices, DeckMatrices, affine_matrices
from femend.model import Model
from femend.model.terms.linear_terms import LinearTerm
from femend.pretest.dashpots import Plan

__all__ = ["Distinction", "candidate_matrices", "distinguish"]

FloatArray = NDArray[np.float64]

# a misfit of so many deviations beyond what the other explanation can follow tells two apart
TOLD = 3.0


class Distinction(NamedTuple):
    """If `truth` were there, by how many deviations would the data contradict `rival` in its stead (`distance`), or
    a model with neither (`detected`)? `told` says whether that is enough."""

    truth: str
    rival: str
    distance: float
    detected: float
    told: bool


def candidate_matrices(model: Model, terms: Sequence[LinearTerm]) -> AffineMatrices:
    """Matrices of a deck with its parameters and `terms` it may lack, each with a factor of its own, by name.

    A term's factor 1 is its starting scale, 0 is the deck as it stands: give it an unknown with `mean` 0. The deck's
    own parameters are linearised at 1 where they are not linear, powers of several unknowns are taken at their scales,
    dashpots left out (`dashpot_test`). Raises PretestError for a term that frees DOFs the deck holds (`with_state`).
    """
    from scipy.sparse import csc_array

    own = DeckMatrices(model)
    ones = np.ones(len(own.names))
    K, M = own.at(ones)
    n = len(own.indptr) - 1
    dK, dM = own.slopes(ones) if own.names else (np.zeros((0, len(K))), np.zeros((0, len(K))))
    shape = (n, n)

    def matrix(values: FloatArray) -> csc_array:
        return csc_array((values, own.indices, own.indptr), shape=shape)

    T = model.transformation()
    k_parts = {name: matrix(v) for name, v in zip(own.names, dK, strict=True)}
    m_parts = {name: matrix(v) for name, v in zip(own.names, dM, strict=True)}
    for term in terms:
        if term.releases.size:
            raise PretestError(f"{term.name} frees DOFs that the deck holds; read the deck with the support as springs")
        for part in term.parts:
            if part.kind == "C" or not part.powers:
                continue
            scale = term.scale_of(part)
            into = k_parts if part.kind == "K" else m_parts
            into[term.name] = into.get(term.name, csc_array(shape)) + scale * csc_array(T.T @ part.matrix @ T)
    K0, M0 = matrix(K - dK.sum(axis=0)), matrix(M - dM.sum(axis=0))
    return affine_matrices(k_parts, M0, K_fixed=K0, M_parts=m_parts)


def distinguish(
    plan: Plan, rows: ArrayLike, candidates: Sequence[str], *, sizes: ArrayLike | None = None
) -> tuple[Distinction, ...]:
    """Every ordered pair of `candidates`, unknowns of `plan`, at a test with sensors at `rows`.

    If the first were there with its size (`sizes` (n_candidates,) in units of p; its span by default), the data are
    fitted with the second, whose own size is free, and with all parameters that are no candidates inside their priors;
    what remains is the distance in deviations: size x sqrt of the Schur complement of the information. 3 are enough.
    Raises PretestError for names that `plan` does not have.
    """
    missing = [c for c in candidates if c not in plan.names]
    if missing:
        raise PretestError(f"no unknown of the plan is called {missing[0]!r}; there are {', '.join(plan.names)}")
    index = [plan.names.index(c) for c in candidates]
    size = plan.size[index] if sizes is None else np.broadcast_to(np.asarray(sizes, dtype=np.float64), (len(index),))
    data = plan.information(rows, prior=False)
    nuisance = [i for i in range(len(plan.names)) if i not in index]
    F = data.copy()
    F[np.ix_(nuisance, nuisance)] += plan.prior[np.ix_(nuisance, nuisance)]
    alone = [s * np.sqrt(_rest(F, i, nuisance)) for i, s in zip(index, size, strict=True)]
    out = []
    for a, i in enumerate(index):
        for b, j in enumerate(index):
            if a != b:
                distance = float(size[a] * np.sqrt(_rest(F, i, [*nuisance, j])))
                out.append(Distinction(candidates[a], candidates[b], distance, float(alone[a]), distance >= TOLD))
    return tuple(out)


def _rest(F: FloatArray, i: int, others: list[int]) -> float:
    """Information on unknown i when `others` are free."""
    if not others:
        return float(F[i, i])
    G, g = F[np.ix_(others, others)], F[others, i]
    size = 1.0 / np.sqrt(np.maximum(np.diag(G), 1e-300))
    x = size * np.linalg.lstsq(G * np.outer(size, size), size * g, rcond=1e-12)[0]
    return float(max(F[i, i] - g @ x, 0.0))
