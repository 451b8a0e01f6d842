"""Test against model over reduced mass matrices (TAM), method by method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate import cross_orthogonality, orthogonality
from femend.errors import ExpansionError
from femend.expansion import Reduction, craig_bampton, dynamic, guyan, hybrid, irs, serep

__all__ = ["TamRow", "TamTable", "tam_table"]

FloatArray = NDArray[np.float64]
METHODS = ("Guyan", "IRS", "dynamic", "SEREP", "hybrid", "Craig-Bampton")


@dataclass(frozen=True, eq=False)
class TamRow:
    """One reduction: `test` (n_modes, n_modes) orthogonality of the test shapes over the reduced mass, `model` that of
    the model's own shapes at the sensors (how good the reduction is), `cross` test with model.

    `off_test`, `off_model` are the largest entries off the diagonal, `least_pair` and `off_cross` the least on and the
    largest off the diagonal of `cross`; `status` is "" or why there is no result.
    """

    method: str
    test: FloatArray
    model: FloatArray
    cross: FloatArray
    status: str = ""

    @property
    def off_test(self) -> float:
        """Largest coupling of test modes."""
        return _off(self.test)

    @property
    def off_model(self) -> float:
        """Largest coupling of model modes, which is the reduction's own error."""
        return _off(self.model)

    @property
    def off_cross(self) -> float:
        """Largest coupling of modes that are no pair."""
        return _off(self.cross)

    @property
    def least_pair(self) -> float:
        """Least coupling of a pair."""
        return float(np.abs(np.diag(self.cross)).min()) if self.cross.size else float("nan")


@dataclass(frozen=True, eq=False, repr=False)
class TamTable:
    """`rows`, one per reduction."""

    rows: tuple[TamRow, ...]

    def __getitem__(self, method: str) -> TamRow:
        for row in self.rows:
            if row.method == method:
                return row
        raise KeyError(f"no reduction {method!r}; there are {', '.join(r.method for r in self.rows)}")

    def __repr__(self) -> str:
        lines = [f"{'reduction':16} {'model off':>10} {'test off':>9} {'least pair':>10} {'cross off':>9}"]
        for r in self.rows:
            if r.status:
                lines.append(f"{r.method:16} {r.status}")
                continue
            lines.append(f"{r.method:16} {r.off_model:10.3f} {r.off_test:9.3f} {r.least_pair:10.3f} {r.off_cross:9.3f}")
        return "\n".join([*lines, "asked by NASA-STD-5002: pairs of at least 0.9, everything else at most 0.1"])


def tam_table(
    K: Any,
    M: Any,
    rows: ArrayLike,
    phi_test: ArrayLike,
    phi: ArrayLike,
    freq: ArrayLike,
    *,
    methods: Sequence[str] = METHODS,
    n_fixed: int | None = None,
) -> TamTable:
    """Orthogonality and cross-orthogonality of test shapes over the mass reduced to the sensors by each of `methods`.

    `K`, `M` (n, n) and the model's shapes `phi` (n, n_modes) at `freq` (n_modes,) Hz; `phi_test` (n_a, n_modes) at DOFs
    `rows` (n_a,), column by column the mate of `phi` (`pair_modes`). "dynamic" reduces at the middle of the
    frequencies, "hybrid" is Kammer's on Guyan, "Craig-Bampton" its TAM with `n_fixed` fixed-interface modes (as many as
    modes). A reduction that these sensors do not allow has a `status`. Raises ExpansionError for sizes that do not fit.
    """
    test, x = np.asarray(phi_test), np.asarray(phi, dtype=np.float64)
    at, f = np.asarray(rows, dtype=np.int64).ravel(), np.asarray(freq, dtype=np.float64)
    if test.shape != (at.size, x.shape[1]) or f.shape != (x.shape[1],):
        raise ExpansionError(
            f"test shapes {test.shape} at {at.size} DOFs, model shapes {x.shape}, {f.size} frequencies; give paired "
            "columns (pair_modes)"
        )
    unknown = [m for m in methods if m not in METHODS]
    if unknown:
        raise ExpansionError(f"no reduction is called {unknown[0]!r}; there are {', '.join(METHODS)}")
    out = []
    for method in methods:
        try:
            mass = _reduced(method, K, M, at, x, f, n_fixed or x.shape[1]).of(M)
        except ExpansionError as error:
            nothing = np.zeros((0, 0))
            out.append(TamRow(method, nothing, nothing, nothing, str(error)))
            continue
        own = x[at]
        out.append(
            TamRow(method, orthogonality(test, mass), orthogonality(own, mass), cross_orthogonality(test, own, mass))
        )
    return TamTable(tuple(out))


def _reduced(
    method: str, K: Any, M: Any, at: NDArray[np.int64], phi: FloatArray, freq: FloatArray, n_fixed: int
) -> Reduction:
    if method == "Guyan":
        return guyan(K, at)
    if method == "IRS":
        return irs(K, M, at)
    if method == "dynamic":
        return dynamic(K, M, at, float(0.5 * (freq.min() + freq.max())))
    if method == "SEREP":
        return serep(phi, at)
    if method == "hybrid":
        return hybrid(guyan(K, at), phi, M)
    return hybrid(craig_bampton(K, M, at, n_fixed), phi, M)


def _off(X: FloatArray) -> float:
    if X.shape[0] < 2:
        return 0.0 if X.size else float("nan")
    return float(np.abs(X - np.diag(np.diag(X))).max())
