"""Derivatives of the frequencies of a free body."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from femend.estimate.updating import deck_system
from femend.model import read_model

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import PARAMETERS, deck


def test_modes_of_0_hz_have_no_slope(tmp_path: Path) -> None:
    (tmp_path / "free.bdf").write_text(deck(held="246"))
    system = deck_system(read_model(tmp_path / "free.bdf", parameters=PARAMETERS), ["7:+Z", "13:+Z"], 5)
    at = np.array([1.0, 1.1])
    state = system.solve(at)
    still = state.value("freq") == 0
    assert still.any()
    slopes = state.slopes["freq"]
    assert not slopes[:, still].any()
    assert np.abs(slopes).max() < 1e6
    step = 1e-4 * np.eye(2)
    differences = [(system.solve(at + h).value("freq") - system.solve(at - h).value("freq")) / 2e-4 for h in step]
    np.testing.assert_allclose(slopes[:, 3:], np.array(differences)[:, 3:], rtol=1e-6)
