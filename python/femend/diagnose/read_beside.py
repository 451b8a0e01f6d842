"""What a place did beside a linear law at another one, the force being free where the place is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.candidates import Candidate
from femend.diagnose.known_force import shown_forces
from femend.diagnose.linear import closed_by
from femend.diagnose.ranked import Ranked
from femend.diagnose.receptances import answers, on_lines
from femend.diagnose.recovered import Recovered, to_time, without_ends
from femend.estimate import Problem
from femend.model import Place

__all__ = ["read_off_beside"]

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
        out.D.append(D + np.einsum("kvw,kw->kv", C, shown - F))
        out.F.append(-shown)
        out.weight.append(weight)
        out.index.append(line.index)
        out.freq.append(line.freq)
        to_time(out, line, s)
        if line.record.frf is None:
            (out.d[-1], out.D[-1]), (out.f[-1], out.F[-1]) = (
                without_ends(history[-1], line.index) for history in (out.d, out.f)
            )
            out.v[-1], out.a[-1] = (without_ends(history[-1], line.index)[0] for history in (out.v, out.a))
    return out


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
