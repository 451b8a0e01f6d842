"""Predictions by the exponential window equal the step-by-step simulation, without a law and with a spring."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import _core
from femend.diagnose.fitting.closed_loop import FINE, upsampled
from femend.diagnose.fitting.predict import predict_model
from femend.estimate import FitRecord, Hypothesis, Problem
from femend.model import read_model, reduce_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


@pytest.mark.parametrize("k", [0.0, 3e4])
def test_prediction_is_simulation(tmp_path: Path, k: float) -> None:
    (tmp_path / "model.bdf").write_text(small_study.deck())
    model = read_model(tmp_path / "model.bdf", parameters=small_study.PARAMETERS)
    rows = np.array([6 * model.index(node) + 2 for node in small_study.SENSORS])
    reduced = reduce_model(model, 150.0, rows.tolist())
    n, dt = 1024, 1 / small_study.RATE
    u = small_study.force(2.0, 4, n)
    zeros = np.zeros((len(rows), n))
    record = FitRecord("r", u[None], zeros, dt, rows[-1:], rows, np.ones(1), np.ones(len(rows)), np.ones(len(rows)))
    problem = Problem([record], small_study.BAND, 0.02, 2)
    p = problem.prior(reduced)[0]
    w = reduced.rows(rows[1:2])
    hypothesis = Hypothesis(reduced, w, ("support_stiffness",), np.zeros(1), np.zeros(1), np.ones(1))
    if k == 0.0:
        hypothesis = Hypothesis(reduced, w[:0])
    omega, zeta, Q, _ = problem.system(reduced).modal(p)
    fine = 64 * FINE  # steps far below the shortest period, so that no mode is left to its static part
    keep = omega * dt / fine < 2.0
    gain = (reduced.rows(rows) @ Q)[:, ~keep]
    assert np.abs(gain).max(initial=0.0) == 0.0
    for order, output in ((2, "acceleration"), (1, "velocity"), (0, "displacement")):
        simulated = _core.simulate(
            omega, zeta, reduced.rows(rows[-1:]) @ Q, reduced.rows(rows) @ Q, w @ Q,
            [[("support_stiffness", {"k": k})]], upsampled(u[None], fine), dt / fine, stride=fine, output=output,
        )[0]  # fmt: skip
        y = predict_model(problem, hypothesis, p, np.log([k]) if k else np.zeros(0), record, order)
        # the implicit step of the spring's force and the periodic image behind the window
        assert np.sqrt(((y - simulated) ** 2).sum() / (simulated**2).sum()) < 2e-3
