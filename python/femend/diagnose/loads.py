"""What may be wrong with the load instead of the model: it acts elsewhere, or the ground moves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femend.diagnose.candidates import Candidate
from femend.diagnose.name import Split, effective_values, null_candidate, score
from femend.diagnose.settings import Settings
from femend.dof import Dof
from femend.estimate import Fit, FitRecord, Hypothesis, Problem
from femend.model import ReducedModel, reduce_model

__all__ = ["LoadFinding", "try_loads"]

# the load is looked for elsewhere only where the updated model leaves more than this
WORTH = 2.0
LINES, KEPT = 120, 3


@dataclass(frozen=True, eq=False)
class LoadFinding:
    """A load that explains the records better from another place: the DOF, its fit, its score and misfits."""

    physics: str
    node: int
    direction: str
    candidate: Candidate
    fit: Fit
    problem: Problem
    score: float


def try_loads(
    problem: Problem, split: Split, reduced: ReducedModel, null: Fit, baseline: Candidate, settings: Settings
) -> LoadFinding | None:
    """Moves the measured force to every other translation of the model and refits; None where nothing gains.

    Costs no extra unknown, so that the fits compare directly.
    """
    if null.score < WORTH or any(len(r.in_rows) != 1 for r in problem.records):
        return None
    model = reduced.model
    own = {int(r.in_rows[0]) for r in problem.records}
    moving = np.linalg.norm(reduced.V, axis=1) > 0
    rows = [
        6 * i + c for i in range(len(model.node_ids)) for c in range(3) if moving[6 * i + c] and 6 * i + c not in own
    ]
    few = problem.thinned(LINES)
    tried: list[tuple[float, int, float]] = []
    for row in rows:
        moved = few.on([_moved(r, row, 1.0) for r in few.records])
        start = (few.prior(reduced)[0], null.x)
        for factor in (30.0, 8.0):
            (fit,) = moved.fit([null.hypothesis], [start], iterations=8, sigma=factor * problem.scale())
            start = start if fit is None else (fit.p, fit.x)
        if fit is not None:
            tried.append((fit.cost, row, 1.0))
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

    def moved(p: Problem) -> Problem:
        return p.on([_moved(r, row, sign) for r in p.records])

    at = Split(moved(split.whole), moved(split.fitting), moved(split.choosing))
    fit = at.whole.continuation(Hypothesis(own, np.zeros((0, own.r))))
    if fit is None:
        return None
    candidate = null_candidate(at, fit, "load_misplaced")
    value = score(candidate, at.choosing, settings, effective_values(at.choosing, own))
    node = int(reduced.model.node_ids[row // 6])
    dof = Dof(node, row % 6 + 1, int(sign))
    return LoadFinding("load_misplaced", node, dof.direction, candidate, fit, moved(problem), value)


def moved_record(record: FitRecord, finding: LoadFinding) -> FitRecord:
    """A record with its force at the place of a finding."""
    other = finding.problem.records[0]
    return replace(record, in_rows=other.in_rows, in_signs=other.in_signs)
