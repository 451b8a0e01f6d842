"""Weights that fade from some nodes to others along the elements between them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from femend.errors import ModelError
from femend.model.model import Model

__all__ = ["harmonic_weights"]

FloatArray = NDArray[np.float64]

_SURFACES = ("CQUAD4", "CTRIA3")


def harmonic_weights(model: Model, name: str, nodes: Sequence[int], held: Sequence[int]) -> FloatArray:
    """Weights (n_grids,), ids ascending, that are 1 at `nodes`, 0 at `held`, and between them minimise
    sum (w_i - w_j)^2 / length_ij over the edges of the elements of `model`; 0 where no element leads to `nodes`.

    Raises ModelError, in the name of the morph `name`, where nothing is held in a part that has one of `nodes`.
    """
    from scipy.sparse import coo_array, csr_array, diags_array
    from scipy.sparse.csgraph import connected_components
    from scipy.sparse.linalg import spsolve

    ids, xyz = model.deck.node_ids, model.deck.xyz
    pairs = _edges(model)
    at = np.searchsorted(ids, pairs)
    length = np.linalg.norm(xyz[at[:, 0]] - xyz[at[:, 1]], axis=1)
    stiff = 1.0 / np.maximum(length, 1e-6 * max(float(length.max(initial=0.0)), 1e-300))
    n = ids.size
    A = csr_array(coo_array((np.tile(stiff, 2), (at.T.ravel(), at[:, ::-1].T.ravel())), shape=(n, n)))
    _, part = connected_components(A, directed=False)
    one, zero = np.isin(ids, nodes), np.isin(ids, held)
    loose = np.setdiff1d(part[one], part[zero])
    if loose.size:
        node = ids[one & (part == loose[0])][0]
        raise ModelError(
            f"morph {name!r}: nothing holds the part of node {node}, which would move as a whole; name nodes of it in "
            "held"
        )
    weight = one.astype(np.float64)
    free = ~one & ~zero & np.isin(part, part[one])
    if free.any():
        L = csr_array(diags_array(A.sum(axis=1)) - A)
        weight[free] = spsolve(L[free][:, free].tocsc(), np.asarray(A[free][:, one].sum(axis=1)).ravel())
    return weight


def _edges(model: Model) -> NDArray[np.int64]:
    """Pairs of nodes (m, 2), each once, that are neighbours in an element or tied by a rigid one."""
    scalar = set(model.deck.scalar_points.tolist())
    pairs: set[tuple[int, int]] = set()
    for _, card, _, nodes in model.deck.elements():
        own = [n for n in dict.fromkeys(nodes) if n not in scalar]
        if card.startswith("RB"):
            around = [(own[0], n) for n in own[1:]]
        elif card in _SURFACES:
            around = list(zip(own, own[1:] + own[:1], strict=True))
        else:
            around = list(combinations(own, 2))
        pairs.update((min(p), max(p)) for p in around)
    return np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)
