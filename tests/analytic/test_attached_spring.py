"""A spring closed around a coordinate in the core's loop is the same as the spring's card in the deck."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import _core
from femend.estimate import Problem
from femend.model import read_model, reduce_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

ZETA = 1e-8  # modes with and without the spring are damped alike only where there is no damping


@pytest.mark.parametrize("k", [1e3, 3e4, 1e6])
def test_the_closed_loop_is_the_deck_with_a_spring(tmp_path: Path, k: float) -> None:
    responses = []
    for more in ((), (f"CELAS2,900,{k},7,3",)):
        path = tmp_path / "model.bdf"
        path.write_text(small_study.deck(more=more))
        model = read_model(path)
        rows = [6 * model.index(node) + 2 for node in small_study.SENSORS]
        # all modes: the basis is complete, so that nothing but the loop can differ
        reduced = reduce_model(model, 1e6, rows)
        assert reduced.r == model.fe.n_a
        system = Problem([], small_study.BAND, ZETA, 1).system(reduced)
        s = 4.0 + 2j * np.pi * np.linspace(10.0, 150.0, 40)
        rng = np.random.default_rng(0)
        u = rng.standard_normal((len(s), 1)) + 1j * rng.standard_normal((len(s), 1))
        n_out = len(rows)
        lines = _core.RecordLines(
            s, u, np.zeros((len(s), n_out), dtype=complex), np.full((len(s), n_out), 1e-9),
            reduced.rows(rows), reduced.rows(rows[-1:]), 1 / 512, 4.0, 1024, 1.0, 0.1,
        )  # fmt: skip
        p = np.array([0.0, np.log(ZETA), np.log(ZETA)])
        attached = _core.Hypothesis(reduced.rows(rows[1:2]), ["support_stiffness"], [0.0], [np.log(k)], [1.0])
        hypothesis, x = (_core.Hypothesis(), np.zeros(0)) if more else (attached, np.log([k]))
        responses.append(_core.fitted_lines(system, hypothesis, [lines], p, x)[0])
    (closed, d, force), (with_card, _, _) = responses
    np.testing.assert_allclose(closed, with_card, rtol=0, atol=1e-6 * np.abs(with_card).max())
    np.testing.assert_allclose(force, -k * d, rtol=1e-12)
    s2 = (4.0 + 2j * np.pi * np.linspace(10.0, 150.0, 40)) ** 2
    np.testing.assert_allclose(s2 * d[:, 0], closed[:, 1], rtol=0, atol=1e-6 * np.abs(closed).max())
