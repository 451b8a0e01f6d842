"""Eight sensors on a real-size frame: the proposed ones leave less variance than random sets do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest


def test_the_example_shows_its_figures(
    script: Callable[[str], ModuleType], shared: Callable[[str], Path], tmp_path: Path
) -> None:
    example = script("pretest_frame")
    model, places = example.frame(shared("cases/c04/public/model.bdf"))
    assert len(places) == 120
    plan = example.plan_of(model, places)
    rows = example.proposals(model, places, plan)
    found = {name: plan.variance_left(r) for name, r in rows.items()}
    assert found["parameter variance"] == pytest.approx(0.00768, abs=1e-5)
    assert found["effective independence"] == pytest.approx(0.00838, abs=1e-5)
    random = example.random_sets(plan, 300)
    assert found["parameter variance"] < random.min()
    assert found["parameter variance"] < 0.9 * np.median(random)
    rehearsed = example.rehearsal(model, places, rows["parameter variance"])
    assert rehearsed.missed == ()
    assert all(inside for _, _, inside in rehearsed.parameters())
    example.picture(tmp_path / "sets.png", random, found)
    assert (tmp_path / "sets.png").stat().st_size > 5000
