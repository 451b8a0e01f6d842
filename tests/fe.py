"""Decks written by the tests, and dense eigensolutions of small models. The deck's text is the input users have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.linalg
import scipy.sparse
from numpy.typing import NDArray

from femend import _core

Array = NDArray[np.float64]


def model(path: Path, cards: list[str], **options: object) -> _core.FeModel:
    """Model of a deck with these cards (free field). `options` go to FeModel; `coupled=False` takes lumped mass."""
    coupled = 1 if options.pop("coupled", True) else -1
    control = ["SOL 103", "CEND", "SPC = 1"] if any(card.startswith("SPC") for card in cards) else []
    lines = [*control, "BEGIN BULK", f"PARAM,COUPMASS,{coupled}", *cards, "ENDDATA", ""]
    file = path / "model.bdf"
    file.write_text("\n".join(lines))
    return _core.FeModel(_core.Deck.read(file), **options)  # type: ignore[arg-type]


def matrices(fe: _core.FeModel, factors: Array | None = None) -> tuple[Array, Array]:
    """Dense K and M of the a-set."""
    indptr, indices, k, m, _, _ = fe.assemble(factors)
    shape = (fe.n_a, fe.n_a)
    K, M = (scipy.sparse.csc_matrix((v, indices, indptr), shape=shape).toarray() for v in (k, m))
    return K, M


def T(fe: _core.FeModel) -> scipy.sparse.csc_matrix:
    """T of u_g = T u_a."""
    indptr, indices, data = fe.T
    return scipy.sparse.csc_matrix((data, indices, indptr), shape=(fe.n_g, fe.n_a))


def omega(K: Array, M: Array) -> Array:
    """Angular frequencies, ascending; K may be singular, M too."""
    shift = 1e-3 * np.trace(K) / max(np.trace(M), 1e-300)
    mu = scipy.linalg.eigh(M, K + shift * M, eigvals_only=True)[::-1]
    value = 1.0 / mu[mu > 1e-14 * mu[0]] - shift
    return np.sqrt(np.abs(value))


def low_omega(K: Array, M: Array) -> Array:
    """Angular frequencies of a supported model, ascending, without loss of digits at the low end."""
    mu = scipy.linalg.eigh(M, K, eigvals_only=True)[::-1]
    return 1.0 / np.sqrt(mu[mu > 1e-14 * mu[0]])


def line(n: int, length: float, section: str = "PBAR,1,1,6.-4,5.-8,2.-8,3.-8", shear: str = "") -> list[str]:
    """A straight beam of n elements along x, plane 1 = x-y."""
    cards = ["MAT1,1,2.1+11,,0.3,7850.", section]
    if shear:
        cards += ["+", "+," + shear]
    cards += [f"GRID,{i + 1},,{length * i / n!r},0.,0." for i in range(n + 1)]
    cards += [f"CBAR,{i + 1},1,{i + 1},{i + 2},0.,1.,0." for i in range(n)]
    return cards
