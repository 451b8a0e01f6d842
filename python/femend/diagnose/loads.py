"""What may be wrong with the load instead of the model: it acts elsewhere, or the ground moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.candidates import Candidate
from femend.diagnose.name import effective_values, null_candidate, score
from femend.diagnose.settings import Settings
from femend.diagnose.split import Split
from femend.dof import Dof
from femend.estimate import Fit, FitRecord, Hypothesis, Problem
from femend.model import ReducedModel, reduce_model

__all__ = ["LoadFinding", "try_loads", "with_force"]

# the load is looked for elsewhere only where the updated model leaves more than this
WORTH = 2.0
LINES, KEPT = 120, 3


@dataclass(frozen=True, eq=False)
class LoadFinding:
    """What is wrong with the load: nodes and direction, `values` of the contract's parameters with their units, fit,
    score and misfits. `force` is a row of the g-set with the force (n,) that acts there unrecorded, where every
    recording has the same, and `forces` that of each recording by its name, where it is known as a few values."""

    physics: str
    nodes: tuple[int, ...]
    direction: str
    values: Mapping[str, tuple[float | str | None, str]]
    candidate: Candidate
    fit: Fit
    problem: Problem
    score: float
    force: tuple[int, NDArray[np.float64]] | None = None
    forces: Mapping[str, tuple[int, NDArray[np.float64]]] = field(default_factory=dict)

    def record(self, record: FitRecord) -> FitRecord:
        """A record with the load as it was found to be."""
        force = self.forces.get(record.name, self.force)
        if force is not None:
            return with_force(record, *force)
        if self.physics != "load_misplaced":
            return record
        other = self.problem.records[0]
        return replace(record, in_rows=other.in_rows, in_signs=other.in_signs)


def try_loads(
    problem: Problem,
    split: Split,
    reduced: ReducedModel,
    null: Fit,
    baseline: Candidate,
    settings: Settings,
    turned: bool = False,
) -> LoadFinding | None:
    """Moves the measured force to every other translation of the model, in either sense, turns it round where it is
    (that alone if `turned`), and refits; None where nothing gains.

    Costs no extra unknown, so that the fits compare directly.
    """
    if null.score < WORTH or any(len(r.in_rows) != 1 for r in problem.records):
        return None
    model = reduced.model
    own = {(int(r.in_rows[0]), float(r.in_signs[0])) for r in problem.records}
    moving = np.linalg.norm(reduced.V, axis=1) > 0
    rows = [6 * i + c for i in range(len(model.node_ids)) for c in range(3) if moving[6 * i + c]]
    rows = [row for row in rows if not turned or row in {at for at, _ in own}]
    few = problem.thinned(LINES).untuned()
    tried: list[tuple[float, int, float]] = []
    for row, sign in product(rows, (1.0, -1.0)):
        if (row, sign) in own:
            continue
        moved = few.on([_moved(r, row, sign) for r in few.records])
        start = (few.prior(reduced)[0], null.x)
        for factor in (30.0, 8.0):
            (fit,) = moved.fit([null.hypothesis], [start], iterations=8, sigma=factor * problem.scale())
            start = start if fit is None else (fit.p, fit.x)
        if fit is not None:
            tried.append((fit.cost, row, sign))
    tried.sort()
    best: LoadFinding | None = None
    for _, row, sign in tried[:KEPT]:
        finding = _follow(problem, split, reduced, row, sign, settings)
        if finding is not None and (best is None or finding.score < best.score):
            best = finding
    if best is None:
        return None
    gain = np.log(baseline.chosen / max(best.candidate.chosen, 1e-12))
    total = score(baseline, split.choosing, settings, effective_values(split.choosing, reduced)) - best.score
    return best if total > settings.gain_cost and gain > 0.5 else None


def _moved(record: FitRecord, row: int, sign: float) -> FitRecord:
    return replace(record, in_rows=np.array([row]), in_signs=np.array([sign]))


def _follow(
    problem: Problem, split: Split, reduced: ReducedModel, row: int, sign: float, settings: Settings
) -> LoadFinding | None:
    g_rows = sorted({row, *(int(g) for r in problem.records for g in r.out_rows)})
    own = reduce_model(reduced.model, problem.band[1], g_rows)
    own = own if reduced.form is None else reduced.form.on(own)

    def moved(p: Problem) -> Problem:
        return p.on([_moved(r, row, sign) for r in p.records])

    at = Split(moved(split.whole), moved(split.fitting), moved(split.choosing))
    fit = at.whole.continuation(Hypothesis(own, np.zeros((0, own.r))))
    if fit is None:
        return None
    candidate = null_candidate(at, fit, "load_misplaced")
    value = score(candidate, at.choosing, settings, effective_values(at.choosing, own))
    node = int(reduced.model.node_ids[row // 6])
    direction = Dof(node, row % 6 + 1, int(sign)).direction
    values: dict[str, tuple[float | str | None, str]] = {"node": (node, ""), "direction": (direction, "")}
    return LoadFinding("load_misplaced", (node,), direction, values, candidate, fit, moved(problem), value)


def with_force(record: FitRecord, row: int, force: NDArray[np.float64]) -> FitRecord:
    """A record with a further input: a known force (n,) at a row of the g-set, silent beyond its end."""
    n = record.n
    extra = np.zeros((1, n))
    extra[0, : min(n, len(force))] = force[:n]
    return replace(
        record,
        u=np.vstack([record.u, extra]),
        in_rows=np.append(record.in_rows, row),
        in_signs=np.append(record.in_signs, 1.0),
    )
