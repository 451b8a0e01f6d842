"""Which loads explain responses better: sensors that were left out, and evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import ODS
from femend.errors import LoadError
from femend.estimate.loads.identify import solve_weighted
from femend.estimate.loads.unit_responses import UnitResponses, matched
from femend.numerals import plain

__all__ = ["LoadRival", "LoadsCompared", "compare_loads", "line_evidence"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# prior deviations of the loads that are tried on every line, relative to what would explain the line by the strongest
SIZES = np.logspace(-4, 2, 25)
# standard errors by which the squares at held-out sensors must differ, and the least share of them
CLEARLY, SHARE = 2.0, 0.1


@dataclass(frozen=True, eq=False)
class LoadRival:
    """One hypothesis: `unseen` relative error at sensors that were left out, `by_sensor` (n_out,) the same for each;
    `log_evidence` over the lines, tempered by what the best rival leaves above the noise; `probability` among them."""

    name: str
    n_loads: int
    unseen: float
    by_sensor: FloatArray
    log_evidence: float
    probability: float


@dataclass(frozen=True, eq=False)
class LoadsCompared:
    """Rivals by rising error at unseen sensors; `best` is the name of the one that is clearly better on both counts,
    None where they cannot be told apart, and `reason` says why."""

    rivals: tuple[LoadRival, ...]
    best: str | None
    reason: str


def compare_loads(
    rivals: Mapping[str, UnitResponses],
    shapes: ODS,
    *,
    method: str = "tikhonov",
    choice: str = "gcv",
    model_error: float = 0.02,
) -> LoadsCompared:
    """Compares `rivals`, sets of loads by name, on the responses `shapes`; `method`, `choice`, `model_error` as in
    `identify_loads`.

    Every sensor is left out once, the loads come from the others, and its response is predicted: more loads explain
    more of what they are fitted to, but not of what they have not seen. The evidence of a line is that of loads with a
    Gaussian prior whose size is the likeliest, less half the logarithm of the number of real values for choosing it
    (MacKay, Neural Computation 4 (1992) 415-447, section 4; Schwarz, Ann. Stat. 6 (1978) 461-464). A rival is best when
    its errors at unseen sensors are smaller by two standard errors over the sensors and by a tenth, and its evidence is
    larger.

    Raises LoadError for fewer than two rivals, for rivals that see different sensors of `shapes`, and where one more
    sensor than loads is missing.
    """
    if len(rivals) < 2:
        raise LoadError(f"{len(rivals)} set(s) of loads: there is nothing to compare; give at least two")
    found = {name: matched(given, shapes) for name, given in rivals.items()}
    first, (_, rows, _) = next(iter(found.items()))
    for name, (here, own, _) in found.items():
        if own != rows:
            raise LoadError(f"loads {name!r} are seen by other sensors than {first!r}; compare them on the same ones")
        if len(own) < here.n_loads + 1:
            raise LoadError(
                f"{len(own)} sensors leave none to compare the {here.n_loads} loads of {name!r} on; use at least "
                f"{here.n_loads + 1}",
                n_responses=len(own),
                n_loads=here.n_loads,
            )
    y = np.asarray(shapes.shapes[list(rows)].T, dtype=np.complex128)
    own_sd = np.zeros(y.shape) if shapes.sigma is None else np.asarray(shapes.sigma[list(rows)].T)
    mean = np.sqrt((np.abs(y) ** 2).mean(axis=1, keepdims=True))
    variance = own_sd**2 + (max(model_error, 1e-6) * mean) ** 2
    errors = {n: _unseen(h, y, variance, method, choice) for n, (h, _, _) in found.items()}
    # where even the best rival leaves more than noise the model is wrong, and the line says the less
    left = np.min([_excess(h, y, variance, method, choice) for h, _, _ in found.values()], axis=0)
    inflation = np.maximum(left, 1.0)[:, None]
    w = 1.0 / np.sqrt(variance * inflation)
    evidence = {n: line_evidence(h.H * w[:, :, None], y * w) for n, (h, _, _) in found.items()}
    return _ranked({n: r.n_loads for n, r in rivals.items()}, errors, evidence)


def _unseen(here: UnitResponses, y: ComplexArray, variance: FloatArray, method: str, choice: str) -> FloatArray:
    """Squares (K, n_out) at every sensor, predicted from the others, relative to the line's mean square."""
    n_out = y.shape[1]
    power = np.maximum((np.abs(y) ** 2).mean(axis=1), 1e-300)
    done = np.zeros(y.shape)
    for i in range(n_out):
        others = [j for j in range(n_out) if j != i]
        # with as many sensors left as loads a truncation cannot be chosen
        how = "tikhonov" if method == "truncation" and len(others) == here.n_loads else method
        solved, _ = solve_weighted(here.sensors(others), y[:, others], variance[:, others], True, how, choice)
        done[:, i] = np.abs(y[:, i] - np.einsum("kn,kn->k", here.H[:, i], solved.x)) ** 2 / power
    return done


def _excess(here: UnitResponses, y: ComplexArray, variance: FloatArray, method: str, choice: str) -> FloatArray:
    """Squares left per free value on every line (K,)."""
    solved, _ = solve_weighted(here, y, variance, True, method, choice)
    return np.asarray(solved.squares / np.maximum(solved.freedom, 1.0))


def line_evidence(H: ComplexArray, y: ComplexArray) -> float:
    """ln p(y) over all lines, up to a constant common to all H: loads free on every line, of the likeliest size there.

    `H` (K, m, n) and `y` (K, m) are scaled to unit deviation. Half the logarithm of the number of real values is taken
    off every line for choosing the size.
    """
    U, s, _ = np.linalg.svd(H, full_matrices=False)
    b = np.abs(np.einsum("kmi,km->ki", U.conj(), y)) ** 2
    whole = (np.abs(y) ** 2).sum(axis=1)
    # power of loads that would make the whole response through the strongest direction
    typical = whole / np.maximum(s[:, 0] ** 2, 1e-300)
    prior = 1.0 + SIZES[None, :, None] ** 2 * typical[:, None, None] * s[:, None, :] ** 2
    line = -np.log(prior).sum(axis=2) + (b[:, None, :] * (1 - 1 / prior)).sum(axis=2) - whole[:, None]
    return float((line.max(axis=1) - 0.5 * np.log(2.0 * y.shape[1])).sum())


def _ranked(sizes: dict[str, int], errors: dict[str, FloatArray], evidence: dict[str, float]) -> LoadsCompared:
    level = max(evidence.values())
    weight = {n: float(np.exp(max(e - level, -700.0))) for n, e in evidence.items()}
    total = sum(weight.values())
    rows = [
        LoadRival(
            n, sizes[n], float(np.sqrt(e.mean())), np.sqrt(e.mean(axis=0)), evidence[n], weight[n] / total
        )
        for n, e in errors.items()
    ]  # fmt: skip
    rows.sort(key=lambda r: r.unseen)
    lead, *rest = rows
    unclear = [r for r in rest if not _clear(errors[lead.name], errors[r.name])]
    likeliest = max(evidence, key=lambda n: evidence[n])
    if unclear:
        reason = f"{lead.name} and {unclear[0].name} predict unseen sensors alike"
    elif likeliest != lead.name:
        reason = f"{lead.name} predicts unseen sensors best, the evidence is for {likeliest}"
    else:
        reason = f"unseen sensors: {plain(lead.unseen, 3)} against {plain(rest[0].unseen, 3)} of {rest[0].name}"
        return LoadsCompared(tuple(rows), lead.name, reason)
    return LoadsCompared(tuple(rows), None, reason)


def _clear(better: FloatArray, other: FloatArray) -> bool:
    """Are the squares (K, n_out) smaller beyond their scatter over the sensors?"""
    apart = (other - better).mean(axis=0)
    error = float(apart.std(ddof=1) / np.sqrt(len(apart))) if len(apart) > 1 else np.inf
    return bool(apart.mean() > CLEARLY * error and better.mean() < (1 - SHARE) * other.mean())
