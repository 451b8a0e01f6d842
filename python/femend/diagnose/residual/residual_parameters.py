"""From the residual to what could remove it: parameters and candidate terms, ranked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csc_array

from femend.errors import ModelError
from femend.estimate.updating.matrices import Matrices
from femend.expansion import expand_residual, residual_forms

__all__ = ["ParameterRank", "ResidualRanking", "rank_parameters"]

FloatArray = NDArray[np.float64]

# a parameter has to lower the cost by so much, three deviations, to be taken
GAIN = 9.0


class ParameterRank(NamedTuple):
    """One parameter alone: `removes` this share of the cost by changing its factor by `change` with deviation `sd`;
    `z` is the change in prior deviations, `gain` the fall of the cost in squared deviations; `alike` names parameters
    whose effect on the data has nearly the same pattern."""

    name: str
    removes: float
    change: float
    sd: float
    z: float
    gain: float
    alike: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class ResidualRanking:
    """`rows`, best first, each parameter by itself; `chosen` (name, change, share of the cost left) one after the other
    until the next adds less than `GAIN`, their changes those of all of them together, which leave the last share;
    `cosine` (n, n) between the parameters' effects; `cost` before."""

    rows: tuple[ParameterRank, ...]
    chosen: tuple[tuple[str, float, float], ...]
    names: tuple[str, ...]
    cosine: FloatArray
    cost: float

    def __repr__(self) -> str:
        lines = [f"{'parameter':24} {'removes':>9} {'change':>9} {'sd':>8} {'prior sd':>9}  alike"]
        for r in self.rows[:12]:
            lines.append(
                f"{r.name:24} {100 * r.removes:8.1f}% {r.change:+9.3f} {r.sd:8.3f} {r.z:9.1f}  {', '.join(r.alike)}"
            )
        for name, _, left in self.chosen:
            lines.append(f"with {name} too: {100 * left:.1f} % left")
        if self.chosen:
            lines.append(f"together {', '.join(f'{name} {change:+.3f}' for name, change, _ in self.chosen)}")
        return "\n".join(lines)


def rank_parameters(
    matrices: Matrices,
    rows: ArrayLike,
    phi: ArrayLike,
    freq: ArrayLike,
    sd: ArrayLike,
    *,
    prior_sd: ArrayLike = 0.1,
    factors: ArrayLike | None = None,
    model_error: float | None = None,
    alike: float = 0.95,
    most: int = 6,
) -> ResidualRanking:
    """Parameters of `matrices` ranked by how much of the dynamic residual of measured shapes they remove.

    `rows`, `phi` (n_a, n_modes), `freq` (n_modes,) in Hz, `sd` and `model_error` as of `expand_residual`, whose cost
    J = d^T K d / a + misfit^2 is what is to fall. A factor x adds the force x g, g = (dK - omega^2 dM) phi, to the
    residual K d = Z u + x g; the shape u is free again. To second order J falls by b^2 / (c + 1 / s^2) with
    b = sum g^T d / a and c = sum g^T d_g / a, d_g the residual of g alone where the sensors read zero, s of `prior_sd`
    (a number or (n_parameters,)): what a parameter does that the sensors do not see, or that the model error covers,
    does not count. `chosen` takes parameters greedily, refitting all, while each lowers J by at least 9 (three
    deviations), `most` of them. Parameters with a |cosine| above `alike` cannot be told apart here. The change is one
    linear step; updating finds the value. Terms that the deck lacks are ranked beside its parameters with
    `femend.pretest.candidate_matrices` (terms at a factor of 0: give `factors` (n_parameters,)). Raises ModelError for
    factors that do not fit, and ExpansionError as `expand_residual`.
    """
    names = matrices.names
    at = np.ones(len(names)) if factors is None else np.asarray(factors, dtype=np.float64)
    if at.shape != (len(names),):
        raise ModelError(f"{at.size} factors for {len(names)} parameters; one each")
    K, M = (_matrix(matrices, v) for v in matrices.at(at))
    dK, dM = ([_matrix(matrices, v) for v in part] for part in matrices.slopes(at))
    found = expand_residual(K, M, rows, phi, freq, sd, model_error=model_error)
    lam = (2 * np.pi * np.asarray(freq, dtype=np.float64).ravel()) ** 2
    b, C = np.zeros(len(names)), np.zeros((len(names), len(names)))
    for r, form in enumerate(residual_forms(K, M, rows, freq, sd, found)):
        u = found.phi[:, r]
        G = np.array([k @ u - lam[r] * (m @ u) for k, m in zip(dK, dM, strict=True)]).T
        d, _ = form.minimum(g=G)
        b += G.T @ found.residual[:, r] / form.a
        C += G.T @ d / form.a
    C = 0.5 * (C + C.T)
    s = np.broadcast_to(np.asarray(prior_sd, dtype=np.float64), b.shape)
    size = np.sqrt(np.maximum(np.diag(C), 1e-300))
    cosine = C / np.outer(size, size)
    whole = float(found.cost.sum())
    full = np.diag(C) + 1 / s**2
    order = np.argsort(-(b**2) / full, kind="stable")
    table = []
    for i in (int(i) for i in order):
        near = tuple(names[j] for j in range(len(names)) if j != i and abs(cosine[i, j]) > alike)
        change, gain = -b[i] / full[i], b[i] ** 2 / full[i]
        table.append(
            ParameterRank(
                names[i], float(gain / whole), float(change), float(full[i] ** -0.5), float(change / s[i]), float(gain),
                near,
            )
        )  # fmt: skip
    chosen = _greedy(names, b, C + np.diag(1 / s**2), whole, most)
    return ResidualRanking(tuple(table), chosen, names, cosine, whole)


def _greedy(
    names: Sequence[str], b: FloatArray, C: FloatArray, whole: float, most: int
) -> tuple[tuple[str, float, float], ...]:
    """Parameters in the order in which they lower the cost most, each with its change when all of them change together,
    and the share of the cost left with those up to it."""
    chosen: list[int] = []
    left: list[float] = []
    gained = 0.0
    together: FloatArray = np.zeros(0)
    while len(chosen) < min(most, len(names)):
        options = []
        for i in (i for i in range(len(names)) if i not in chosen):
            own = [*chosen, i]
            x = np.asarray(np.linalg.solve(C[np.ix_(own, own)], -b[own]), dtype=np.float64)
            options.append((float(-x @ b[own]), i, x))
        gain, i, x = max(options, key=lambda option: option[:2])
        if gain - gained < GAIN:
            break
        gained, together = gain, x
        chosen.append(i)
        left.append(max(1.0 - gain / whole, 0.0))
    return tuple((names[i], float(change), share) for i, change, share in zip(chosen, together, left, strict=True))


def _matrix(matrices: Matrices, values: FloatArray) -> Any:
    n = len(matrices.indptr) - 1
    return csc_array((values, matrices.indices, matrices.indptr), shape=(n, n))
