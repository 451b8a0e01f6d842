"""Friction that creeps before it slides is told as dry friction with its own slip force."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, diagnosed

SLIP, CREEP = 0.6, 0.02


def test_friction_that_creeps_has_its_slip_force(tmp_path: Path) -> None:
    laws = [(10, "sliding_friction", {"f": SLIP, "v0": CREEP})]
    run = diagnosed(tmp_path, Truth((7.3e10, 6.8e10), laws=laws))
    (finding,) = run.result["findings"]
    assert finding["physics"] == "coulomb_friction"
    assert finding["location"]["nodes"] == [10]
    assert finding["parameters"]["f"]["value"] == pytest.approx(SLIP, rel=0.1)
    assert finding["parameters"]["v0"]["value"] == pytest.approx(CREEP, rel=0.3)
    held = next(p for p in run.predictions if p.name == "held")
    # noise is one per cent
    assert held.error("final") < 0.02 < 0.3 * held.error("parameters")
