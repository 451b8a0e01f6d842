"""Where an update starts from, and what of several starts goes on."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.updating.update import DRAWN, drawn_starts
from femend.estimate import Hypothesis, Problem
from femend.estimate.fit import CONTINUATION
from femend.model import read_model, reduce_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

BAND, ZETA, N_TUNED = (5.0, 150.0), 0.01, 3


def test_an_update_starts_from_the_deck_and_from_draws_of_the_priors(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(small_study.deck(), encoding="utf-8")
    model = read_model(path, parameters=small_study.PARAMETERS)
    reduced = reduce_model(model, BAND[1], [6 * model.index(node) + 2 for node in small_study.SENSORS])
    problem = Problem([], BAND, ZETA, N_TUNED)
    mean, sd = problem.prior(reduced)
    n = len(model.parameters)
    starts = np.array([p for p, _ in drawn_starts(problem, reduced)])
    assert starts.shape == (1 + DRAWN, len(mean))
    np.testing.assert_array_equal(starts[0], mean)
    np.testing.assert_array_equal(starts[:, n:], np.broadcast_to(mean[n:], (1 + DRAWN, len(mean) - n)))
    drawn = (starts[1:, :n] - mean[:n]) / sd[:n]
    # one in every seventh of each prior
    assert (np.sort(drawn, axis=0)[[0, -1]] * [[-1], [1]] > 1.0).all()
    np.testing.assert_array_equal(starts, np.array([p for p, _ in drawn_starts(problem, reduced)]))


def test_the_first_start_and_the_best_go_on(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Every stage ends where a start rounds to; the deck's own is followed though others
    cost less, and two that meet are one."""
    path = tmp_path / "model.bdf"
    path.write_text(small_study.deck(), encoding="utf-8")
    model = read_model(path, parameters=small_study.PARAMETERS)
    reduced = reduce_model(model, BAND[1], [6 * model.index(small_study.SENSORS[0]) + 2])
    hypothesis = Hypothesis(reduced, np.zeros((0, reduced.r)))
    asked: list[list[float]] = []

    class End:
        def __init__(self, p: np.ndarray, cost: float) -> None:
            self.p, self.x, self.cost = p, np.zeros(0), cost

    def fit(self: Problem, batch: list[Hypothesis], starts: list, **how: float) -> list[End]:
        assert len(batch) == len(starts)
        asked.append([float(p[0]) for p, _ in starts])
        last = how["sigma"] == 0.0
        # the deck's minimum, 0, costs most on damped lines and least on the recorded ones
        cost = {0.0: 0.5 if last else 9.0, 1.0: 1.0, 2.0: 2.0, 3.0: 3.0, 4.0: 4.0}
        return [End(np.round(p), cost[float(np.round(p[0]))]) for p, _ in starts]

    monkeypatch.setattr(Problem, "fit", fit)
    monkeypatch.setattr(Problem, "scale", lambda self: 1.0)
    starts = [(np.array([v]), np.zeros(0)) for v in (0.1, 1.1, 0.9, 2.2, 3.1, 4.4)]
    found = Problem([], BAND, ZETA, N_TUNED).continuation(hypothesis, starts, most=2)
    assert found is not None
    assert found.p[0] == 0.0
    assert len(asked) == len(CONTINUATION)
    assert asked[1:] == [[0.0, 1.0, 2.0]] * (len(CONTINUATION) - 1)
