"""What may be wrong with the load instead of the model: it acts elsewhere, or the ground moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.evidence import fall
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.locating.joint import with_loads
from femend.diagnose.locating.receptances import on_lines
from femend.diagnose.naming.judge import Given, ToBeat, null_candidate
from femend.diagnose.naming.ranked import effective_values, score
from femend.dof import Dof
from femend.estimate import Fit, FitRecord, Hypothesis, Problem
from femend.model import ReducedModel
from femend.threads import at_once

__all__ = ["LoadFinding", "try_loads", "with_force"]

# the load is looked for elsewhere only where the updated model leaves more than this
WORTH = 2.0
LINES, KEPT = 120, 3
# how many rows and senses are fitted with all unknowns, chosen by a few steps of the bare model, and at what decays (in
# units of `Problem.scale`)
GLANCED, GLANCE_STEPS, DECAYS = 20, 4, (30.0, 8.0)
# rows of the g-set from which the force is not tried at each but at the likeliest alone, how many these are, on how
# many lines they are found, and at what decay (in units of `Problem.scale`)
MANY_ROWS, LIKELIEST, FEW_LINES, DECAY = 1500, 30, 16, 8.0


@dataclass(frozen=True, eq=False)
class LoadFinding:
    """What is wrong with the load: nodes and direction, `values` of the contract's parameters with their units, fit,
    score and misfits. `force` is a row of the g-set with the force (n,) that acts there unrecorded, where every
    recording has the same, and `forces` that of each recording by its name, where they differ."""

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


def try_loads(problem: Problem, given: Given, null: Fit, alone: ToBeat, *, turned: bool = False) -> LoadFinding | None:
    """Moves the measured force to every other translation of the model, in either sense, turns it round where it is
    (that alone if `turned`), and refits; None where nothing gains against the updated model, `null` and `alone`.

    Costs no extra unknown, so that the fits compare directly.
    """
    if null.score < WORTH or any(len(r.in_rows) != 1 for r in problem.records):
        return None
    reduced, settings = given.reduced, given.settings
    model = reduced.model
    own = {(int(r.in_rows[0]), float(r.in_signs[0])) for r in problem.records}
    moving = np.linalg.norm(np.asarray(reduced.V), axis=1) > 0
    rows = [6 * i + c for i in range(len(model.as_drawn.node_ids)) for c in range(3) if moving[6 * i + c]]
    rows = [row for row in rows if not turned or row in {at for at, _ in own}]
    few = problem.sparing(LINES).untuned().pressed()
    every = _likeliest(few, reduced, null, rows) if len(rows) > MANY_ROWS else product(rows, (1.0, -1.0))
    pairs = [pair for pair in every if pair not in own]
    bare = reduced if reduced.form is None else reduced.bare()
    glanced = _sorted_out(few, Hypothesis(bare, np.zeros((0, bare.r))), pairs, GLANCE_STEPS, DECAYS[:1])
    tried = _sorted_out(few, null.hypothesis, glanced[:GLANCED], 8, DECAYS)
    best: LoadFinding | None = None
    for finding in at_once(lambda at: _follow(problem, given, *at), tried[:KEPT]):
        if finding is not None and (best is None or finding.score < best.score):
            best = finding
    if best is None:
        return None
    gain = fall(alone.candidate.chosen, best.candidate.chosen)
    return best if alone.score - best.score > settings.gain_cost and gain > 0.5 else None


def _sorted_out(
    problem: Problem,
    hypothesis: Hypothesis,
    pairs: Sequence[tuple[int, float]],
    iterations: int,
    decays: Sequence[float],
) -> list[tuple[int, float]]:
    """Rows and senses of the force in rising order of what the model leaves with the force there, fitted from the
    deck's values in `iterations` steps at one decay after another."""

    def left(at: tuple[int, float]) -> float:
        moved = problem.on([_moved(r, *at) for r in problem.records])
        start, fit = (problem.prior(hypothesis.reduced)[0], np.zeros(0)), None
        for decay in decays:
            (fit,) = moved.fit([hypothesis], [start], iterations=iterations, sigma=decay * problem.scale())
            start = start if fit is None else (fit.p, fit.x)
        return np.inf if fit is None else fit.cost

    costs = zip(at_once(left, pairs), pairs, strict=True)
    return [at for cost, at in sorted(costs) if np.isfinite(cost)]


def _likeliest(problem: Problem, reduced: ReducedModel, null: Fit, rows: Sequence[int]) -> list[tuple[int, float]]:
    """The rows and senses of the force that leave least of the records with the model held, at the deck's values or at
    the updated ones."""
    few = problem.thinned(FEW_LINES)
    best = np.full((2, len(rows)), np.inf)
    for p in (few.prior(reduced)[0], few.tuned_like(null.p, reduced)):
        omega, zeta, Q = few.modes(reduced, p)
        W = reduced.rows(rows) @ Q
        left = np.zeros((2, len(rows)))
        for line in few.lines(reduced, DECAY * problem.scale()):
            s, g, out = on_lines(line, reduced, omega, zeta, Q)
            for k in range(len(s)):
                h = W @ (s[k] ** 2 * line.U[k, 0] * g[k][:, None] * out.T * line.weight[k])
                made, size = np.real(h @ (line.Y[k] * line.weight[k]).conj()), (np.abs(h) ** 2).sum(axis=1)
                left += line.share * np.array([size - 2 * made, size + 2 * made])
        best = np.minimum(best, left)
    order = np.argsort(best, axis=None)[:LIKELIEST]
    return [(rows[i % len(rows)], (1.0, -1.0)[i // len(rows)]) for i in order.tolist()]


def _moved(record: FitRecord, row: int, sign: float) -> FitRecord:
    return replace(record, in_rows=np.array([row]), in_signs=np.array([sign]))


def _follow(problem: Problem, given: Given, row: int, sign: float) -> LoadFinding | None:
    """The finding of the force at a row of the g-set; None where the model breaks down with it."""
    reduced = given.reduced
    g_rows = sorted({row, *(int(g) for r in problem.records for g in r.out_rows)})
    pattern = reduced.model.transformation()[[row]].T.toarray()
    own = with_loads(reduced, pattern, problem.band[1], g_rows)

    def moved(p: Problem) -> Problem:
        return p.on([_moved(r, row, sign) for r in p.records])

    at = given.split.changed(lambda r: _moved(r, row, sign))
    fit = at.whole.continuation(Hypothesis(own, np.zeros((0, own.r))))
    if fit is None:
        return None
    candidate = null_candidate(at, fit, "load_misplaced")
    value = score(candidate, given.settings, effective_values(at.choosing, own))
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
