"""Nonlinear laws at a joint: many starts sorted out on the beginnings of the records, the best followed on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.candidates import Candidate, Start
from femend.diagnose.closed_loop import COARSE, ClosedLoop, History, loop_of
from femend.diagnose.descent import Descent, Reached
from femend.diagnose.joint import Joint, Recovered
from femend.estimate import FitRecord, Problem

__all__ = ["fit_nonlinear", "judge_nonlinear", "refit_nonlinear", "simulate_candidate"]

FloatArray = NDArray[np.float64]

# steps of every start, starts that are followed, their further steps, and steps with all unknowns
FEW, FOLLOWED, FIRST, JOINT = 6, 4, 5, 10
# decays of the windows, in units of `Problem.scale`, before the whole records
WINDOWS = (10.0, 3.0, 1.0)


def fit_nonlinear(
    problem: Problem, choosing: Problem, joint: Joint, recovered: Recovered, begun: Sequence[tuple[str, Start]]
) -> list[Candidate]:
    """The best fits of several laws and starts at a joint, judged on `choosing`.

    All starts go a few steps on the beginnings of the records (an exponential window), where paths of motion that later
    part are still together; those that get on best are followed to the whole records. One candidate a law is kept.
    """
    early = [factor * problem.scale() for factor in WINDOWS]
    runs: list[tuple[float, str, Start, Descent, FloatArray]] = []
    for name, start in begun:
        loop, x = loop_of(problem, joint, start, recovered)
        loop = replace(loop, sigma=early[0], substeps=COARSE)
        descent = Descent.around(loop, x, False)
        reached = descent.run(np.concatenate([recovered.fit.p, x]), FEW)
        if reached is not None:
            runs.append((reached.cost, name, start, descent, reached.z))
    runs.sort(key=lambda r: r[0])
    best: dict[str, Candidate] = {}
    for _, name, start, descent, z in runs[:FOLLOWED]:
        end = _follow(descent, z, early[1:])
        if end is None:
            continue
        candidate = judge_nonlinear(choosing, _candidate(end[0].loop, start, name, end[1], None))
        if np.isfinite(candidate.fitted) and (name not in best or candidate.fitted < best[name].fitted):
            best[name] = candidate
    return list(best.values())


def _follow(descent: Descent, z: FloatArray, windows: Sequence[float]) -> tuple[Descent, Reached] | None:
    """From a window to the next wider one and at last the whole records, everything free."""
    reached: Reached | None = None
    for sigma in (*windows, 0.0):
        descent = descent.on(descent.loop.at(sigma), everything=True)
        reached = descent.run(z, FIRST)
        if reached is None:
            return None
        z = reached.z
    return None if reached is None else (descent, reached)


def _candidate(loop: ClosedLoop, start: Start, name: str, reached: Reached, covariance: FloatArray | None) -> Candidate:
    n_p = len(loop.problem.prior(loop.joint.reduced)[0])
    p, x = reached.z[:n_p], reached.z[n_p:]
    values, k, c = loop.values(x)
    return Candidate(
        start.physics,
        name,
        loop.joint,
        values,
        p,
        x,
        loop.n_x,
        loop.problem.prior_cost(loop.joint.reduced, p),
        float(reached.e @ reached.e) / loop.size(),
        np.nan,
        k,
        c,
        np.inf,
        covariance,
        loop.coordinates,
        {"k_scale": loop.scale[0], "c_scale": loop.scale[1]},
    )


def _loop_again(problem: Problem, candidate: Candidate) -> ClosedLoop:
    assert candidate.joint is not None
    assert candidate.physics is not None
    assert candidate.coordinates is not None
    return ClosedLoop(
        problem,
        candidate.joint,
        candidate.physics.law or candidate.physics.name,
        candidate.coordinates,
        (candidate.extra["k_scale"], candidate.extra["c_scale"]),
    )


def judge_nonlinear(choosing: Problem, candidate: Candidate) -> Candidate:
    """The candidate with the misfit it leaves on records it has not seen."""
    loop = _loop_again(choosing, candidate)
    (e,), _ = loop.residuals([(candidate.p, candidate.x)])
    value = float(e @ e) / loop.size()
    return replace(candidate, chosen=value if np.isfinite(value) else np.inf)


def refit_nonlinear(problem: Problem, candidate: Candidate, iterations: int = JOINT) -> Candidate:
    """The candidate fitted to all records of the problem, all unknowns together."""
    loop = _loop_again(problem, candidate)
    reached = Descent.around(loop, candidate.x, True).run(np.concatenate([candidate.p, candidate.x]), iterations)
    if reached is None or reached.H is None or candidate.physics is None:
        return candidate
    n_p = len(candidate.p)
    start = Start(candidate.physics, candidate.values, candidate.k, candidate.c, 0.0)
    covariance = np.asarray(np.linalg.pinv(reached.H)[n_p:, n_p:], dtype=np.float64)
    return replace(
        _candidate(loop, start, candidate.name, reached, covariance),
        chosen=candidate.chosen,
        reference=candidate.reference,
    )


def simulate_candidate(problem: Problem, candidate: Candidate, record: FitRecord) -> History:
    """Histories of a nonlinear candidate for one record's forces (its responses are not looked at)."""
    return _loop_again(problem.on([record]), candidate).histories([(candidate.p, candidate.x)])[0][0]
