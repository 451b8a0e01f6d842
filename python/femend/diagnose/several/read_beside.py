"""What a place did at which the force is free, beside a linear law at another one or a free force there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.known_force import read_off, shown_forces
from femend.diagnose.fitting.linear import closed_by
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.receptances import answers, on_lines
from femend.diagnose.locating.recovered import Recovered, to_time, without_ends
from femend.diagnose.naming.ranked import Ranked
from femend.estimate import Fit, Lines, Problem
from femend.model import Place

__all__ = ["read_off_beside", "read_off_both"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def read_off_beside(problem: Problem, ranked: Ranked, place: Place) -> Recovered:
    """What a place did at which a force is free in `problem`, beside a linear law that was fitted with it."""
    candidate, fit = ranked.candidate, ranked.located.fit
    hypothesis, x = (fit.hypothesis, np.zeros(0)) if candidate.joint is None else (closed_by(candidate), candidate.x)
    reduced, n_w, problem = hypothesis.reduced, len(hypothesis.w), problem.thinned(None)
    lines = problem.lines(reduced)
    omega, zeta, Q, own = problem.system(reduced).modal(candidate.p)
    free, law = place.w(reduced.V, reduced.V_a) @ Q, hypothesis.w @ Q
    out = Recovered(fit, fit, [], [], [], [], [], [], [], problem.records, [], [])
    fitted = problem.fitted_lines(hypothesis, candidate.p, x)
    for line, (y, D, F) in zip(lines, fitted, strict=True):
        s, g, rows = on_lines(line, reduced, omega, zeta, Q)
        H = answers(rows, g, free, s, own)
        C = answers(free, g, free, s, own)
        if n_w:
            carried = _carried(candidate, s, answers(law, g, law, s, own)) @ answers(law, g, free, s, own)
            H = H - answers(rows, g, law, s, own) @ carried
            C = C - answers(free, g, law, s, own) @ carried
        H = s[:, None, None] ** 2 * H
        D, F = D[:, n_w:], F[:, n_w:]
        shown, weight = shown_forces(line, y, H, F)
        _add(out, line, s, D + np.einsum("kvw,kw->kv", C, shown - F), shown, weight)
    return out


def read_off_both(problem: Problem, joint: Joint, fit: Fit) -> list[Recovered]:
    """What each of two places did, opened together as a `joint` of a coordinate each, at the `fit` of a free force at
    both in the records of `problem`."""
    problem = problem.thinned(None)
    omega, zeta, Q, own = problem.system(joint.reduced).modal(fit.p)
    w = joint.w @ Q
    found = [Recovered(fit, fit, [], [], [], [], [], [], [], problem.records, [], []) for _ in w]
    for one in read_off(problem, fit):
        s, g, _ = on_lines(one.line, joint.reduced, omega, zeta, Q)
        C = answers(w, g, w, s, own) + np.diag(joint.compliance)
        D = one.D + np.einsum("kvw,kw->kv", C, one.F - one.least)
        for i, out in enumerate(found):
            _add(out, one.line, s, D[:, i : i + 1], one.F[:, i : i + 1], one.weight[:, i : i + 1])
    return found


def _add(out: Recovered, line: Lines, s: ComplexArray, D: ComplexArray, F: ComplexArray, weight: FloatArray) -> None:
    """Adds to `out` motion and force on the structure (K, n_w) on the lines `s` (K,) of a record, and how well the
    force is seen, (K, n_w); of a history without its ends."""
    out.D.append(D)
    out.F.append(-F)
    out.weight.append(weight)
    out.index.append(line.index)
    out.freq.append(line.freq)
    to_time(out, line, s)
    if line.record.frf is None:
        (out.d[-1], out.D[-1]), (out.f[-1], out.F[-1]) = (
            without_ends(history[-1], line.index) for history in (out.d, out.f)
        )
        out.v[-1], out.a[-1] = (without_ends(history[-1], line.index)[0] for history in (out.v, out.a))


def _carried(candidate: Candidate, s: ComplexArray, C: ComplexArray) -> ComplexArray:
    """Forces (K, n_w, n_w) of a linear law at its coordinates to displacements that these had without it, with the
    receptance `C` (K, n_w, n_w) of the model there."""
    assert candidate.joint is not None
    assert candidate.physics is not None
    law = candidate.physics.law or candidate.physics.name
    values = candidate.physics.values_at(candidate.x)
    held = np.zeros(C.shape[1]) if candidate.joint.held is None else candidate.joint.held
    kappa = (_core.law_dynamic_stiffness(law, values, s)[0][:, None] - held)[:, :, None]
    one = np.eye(C.shape[1])
    return np.asarray(np.linalg.solve(one + kappa * (C + np.diag(candidate.joint.compliance)), kappa * one))
