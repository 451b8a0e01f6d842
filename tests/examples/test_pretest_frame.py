"""Eight sensors on a real-size frame: the proposed ones leave less variance than random sets do."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest


def test_the_example_shows_its_figures(project_root: Path, shared: Callable[[str], Path], tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("pretest_frame", project_root / "python/examples/pretest_frame.py")
    assert spec is not None
    assert spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
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
