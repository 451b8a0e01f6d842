"""The morphs of a deck together: positions at any amplitudes, and how far is far for each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.errors import ModelError
from femend.model.geometry.morph import Morph

__all__ = ["NodeFields", "node_fields"]

FloatArray = NDArray[np.float64]

# share of an element's size that central differences move nodes by: truncation is of the order of its square (4e-10),
# rounding of 1e-16 over it (5e-12, more where coordinates are large beside elements)
STEP = 2e-5
# irregular share of an element's size at which no term of K vanishes by coincidence
PROBE = 0.0137


@dataclass(frozen=True, eq=False)
class NodeFields:
    """All nodes that any morph moves, `nodes` (m,), where they stand, `xyz` (m, 3), and the `fields` (n_morphs, m, 3).

    `size` (n_morphs,) is the amplitude that strains the most strained edge of an element by its own length.
    """

    nodes: NDArray[np.int64]
    xyz: FloatArray
    fields: FloatArray
    size: FloatArray

    def positions(self, amplitudes: FloatArray) -> FloatArray:
        """Positions (m, 3) at `amplitudes` (n_morphs,), basic coordinates."""
        return np.ascontiguousarray(self.xyz + np.tensordot(amplitudes, self.fields, 1))

    @property
    def step(self) -> FloatArray:
        """Amplitudes (n_morphs,) for central differences."""
        return STEP * self.size

    @property
    def far(self) -> FloatArray:
        """Amplitudes (n_morphs,) at which no term of K and M vanishes by coincidence."""
        share = 1.0 + 0.37 * ((np.arange(len(self.size)) * 0.618034 + 0.3) % 1.0)
        return PROBE * share * self.size

    @property
    def probe(self) -> FloatArray:
        """Positions (m, 3) at the amplitudes `far`."""
        return self.positions(self.far)


def node_fields(deck: _core.Deck, morphs: Sequence[Morph]) -> NodeFields:
    """The `morphs` on the nodes of `deck`.

    Raises ModelError for a node that is no GRID of the deck and names that stand twice.
    """
    names = [m.name for m in morphs]
    twice = [n for n in names if names.count(n) > 1]
    if twice:
        raise ModelError(f"two morphs are called {twice[0]!r}; give them different names")
    known = deck.node_ids
    for morph in morphs:
        missing = morph.nodes[~np.isin(morph.nodes, known)]
        if missing.size:
            kind = "is a scalar point, which has no place" if missing[0] in deck.scalar_points else "is not in the deck"
            raise ModelError(f"morph {morph.name!r}: node {missing[0]} {kind}; give GRIDs of the deck")
    all_xyz = deck.xyz
    full = np.zeros((len(morphs), known.size, 3))
    for i, morph in enumerate(morphs):
        full[i, np.searchsorted(known, morph.nodes)] = morph.field
    moving = np.any(full, axis=(0, 2))
    size = _sizes(deck, morphs, known, all_xyz, full)
    return NodeFields(known[moving], np.ascontiguousarray(all_xyz[moving]), full[:, moving], size)


def _sizes(
    deck: _core.Deck, morphs: Sequence[Morph], known: NDArray[np.int64], xyz: FloatArray, full: FloatArray
) -> FloatArray:
    """Amplitude of each morph at which the most strained edge is strained by its own length."""
    edges: set[tuple[int, int]] = set()
    moved = set(np.concatenate([m.nodes for m in morphs]).tolist())
    scalar = set(deck.scalar_points.tolist())
    for _, _, _, nodes in deck.elements():
        if moved.isdisjoint(nodes):
            continue
        own = [n for n in dict.fromkeys(nodes) if n not in scalar]
        edges.update(zip(own, own[1:] + own[:1], strict=True))
        edges.update((own[0], n) for n in own[1:])
    pairs = np.array([(a, b) for a, b in edges if a != b], dtype=np.int64).reshape(-1, 2)
    at = np.searchsorted(known, pairs)
    length = np.linalg.norm(xyz[at[:, 0]] - xyz[at[:, 1]], axis=1)
    diagonal = max(float(np.linalg.norm(np.ptp(xyz, axis=0))), 1e-300)
    out = np.empty(len(morphs))
    for i in range(len(morphs)):
        relative = np.linalg.norm(full[i, at[:, 0]] - full[i, at[:, 1]], axis=1)
        strained = (relative > 1e-9 * np.abs(full[i]).max()) & (length > 1e-12 * diagonal)
        # a body that moves as a whole strains nothing; its own size is as good a measure as any
        sizes = length[strained] / relative[strained]
        out[i] = sizes.min() if sizes.size else diagonal / np.abs(full[i]).max()
    return out
