"""Laws under forces that pass the band in turn, whose beginning shows nothing of what a law does to higher modes."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import chirp

from femend.diagnose.fitting.candidates import Start
from femend.diagnose.fitting.nonlinear import fit_nonlinear
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.recovered import recover
from femend.estimate import in_turn
from femend.model import find_places
from femend.physics import physics

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


def sweep(level: float, seed: int, n: int) -> NDArray[np.float64]:
    """A sine that rises through the band in four fifths of the record, from rest and back to it."""
    t, end = np.arange(n) / small_study.RATE, 0.8 * n / small_study.RATE
    low, high = small_study.BAND
    ramp = np.clip(np.minimum(t, end - t) / 0.1, 0.0, 1.0)
    return 1.4 * level * ramp * chirp(t, low, end, high, method="logarithmic", phi=-90)


def test_friction_that_sticks_at_first_is_found_under_sweeps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(small_study, "RATE", 1024.0)
    monkeypatch.setattr(small_study, "recording", partial(small_study.recording, rate=1024.0))
    monkeypatch.setattr(small_study, "BAND", (8.0, 330.0))
    monkeypatch.setattr(small_study, "SECONDS", 8.0)
    monkeypatch.setattr(small_study, "force", sweep)
    true = {"f": 3.0, "kt": 6e4}
    start = small_study.updated(tmp_path, small_study.Truth(E=(7.3e10, 7.2e10), laws=[(12, "coulomb_friction", true)]))
    assert all(in_turn(r, start.problem.band) for r in start.problem.records)
    places = find_places(start.reduced.model)
    place = next(p for p in places if p.kind == "ground" and p.nodes == (12,) and p.direction == "Z")
    joint = open_joint(place, start.reduced, start.problem.band[1], start.g_rows)
    recovered = recover(start.problem, joint, start.problem.prior(joint.reduced)[0])
    assert recovered is not None
    # what hardly moves is read off badly: stuck, and too weak with a dashpot that feeds motion
    stuck = Start(physics("coulomb_friction"), {"f": 0.8, "kt": 4e5}, 0.0, 0.0, np.nan)
    fed = Start(physics("coulomb_friction"), {"f": 1.5, "kt": 8e4}, 0.0, -20.0, 0.45)
    begun = [("coulomb_friction", stuck), ("coulomb_friction", fed)]
    (found,) = fit_nonlinear(start.problem, start.problem, joint, recovered, begun)
    assert found.sigma == 0.0
    assert found.fitted < 1.5
    assert found.values["f"] == pytest.approx(true["f"], rel=0.05)
    assert found.values["kt"] == pytest.approx(true["kt"], rel=0.1)
    np.testing.assert_allclose(np.exp(found.p[:2]), [7.3 / 7, 7.2 / 7], rtol=0.02)
