"""The beam with a moving roller: the support its model lacks is located and named from free decays."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest


def test_roller_beam(project_root: Path, shared: Callable[[str], Path]) -> None:
    folder = shared("data/roller_beam")
    example = runpy.run_path(str(project_root / "python" / "examples" / "roller_beam.py"))
    out = example["run"](folder)
    assert [len(stops) for stops in out.stops.values()] == [10, 10, 10]
    # the first mode is seen at every stop, and the same in all three tests to 0.3 %
    f1 = np.array([[stop.freq[0] for stop in stops] for stops in out.stops.values()])
    assert np.ptp(f1, axis=0).max() < 0.003 * f1.min()
    # a moving support is the rival that predicts modes 2 and 3 of the test it is chosen on, and of the one reported
    (best_error, reported, best), (same_error, _, same), (third_error, _, third), *_ = out.ranked
    assert best.rival.name == "pinned support that moves"
    assert same.rival.name == "elastic support that moves"
    assert same_error == pytest.approx(best_error, abs=2e-4)
    assert best_error < 0.02
    assert third_error > 1.7 * best_error
    assert reported < 0.025
    assert min(error for _, error, fit in out.ranked[2:]) > 1.4 * reported
    assert third.cost > best.cost + 50
    # the mass that nobody states, and E / rho within what metals have; without that mass the name would not come out
    assert best.shared["sensor"] == pytest.approx(0.10, abs=0.02)
    assert best.shared["at"] == pytest.approx(0.335, abs=0.01)
    assert best.shared["E"] == pytest.approx(1.0, abs=0.04)
    assert out.bare[0] > 0.9 * third_error
    assert out.bare[1] > 1.4 * reported
    # places follow the recorded position: the goal is R^2 = 0.99
    for tests in ((0,), (1,), (2,), (1, 2)):
        fitted = example["line"](out.volts(*tests), out.places(*tests))
        assert fitted.R2 > 0.995, tests
        assert fitted.slope == pytest.approx(54.5, abs=1.5), tests
    assert all(out.monotonic(test) for test in (0, 1, 2))
    # the miss: with a stiffness of its own at every stop the places follow less well
    use = out.several(1, 2)
    assert example["line"](out.volts(1, 2)[use], out.places(1, 2, elastic=True)[use]).R2 < 0.99


def test_the_drawn_cantilever_has_its_frequencies(project_root: Path) -> None:
    example = runpy.run_path(str(project_root / "python" / "examples" / "roller_beam.py"))
    beam = example["Beam"]()
    c = np.sqrt(example["E"] / example["RHO"] / 12) * example["THICKNESS"] / example["LENGTH"] ** 2 / (2 * np.pi)
    # Euler's beam; consistent masses of 40 elements, and their rotation (0.05 % in the third mode)
    assert beam.drawn[:3] == pytest.approx(np.array([1.875104, 4.694091, 7.854757]) ** 2 * c, rel=1e-3)
    # a support on the clamp changes nothing, a rigid one at the tip makes a propped cantilever
    assert beam.frequencies({"E": 1.0, "x": 1e-4, "k": 1e9})[0] == pytest.approx(beam.drawn[0], rel=1e-3)
    assert beam.frequencies({"E": 1.0, "x": example["LENGTH"], "k": 1e9})[:2] == pytest.approx(
        np.array([3.926602, 7.068583]) ** 2 * c, rel=2e-3
    )
    # a clamp that takes up a fifth of the beam leaves one of four fifths
    short = beam.frequencies({"E": 1.0, "free": 0.2 * example["LENGTH"]})
    assert short == pytest.approx(beam.drawn[:3] / 0.8**2, rel=1e-3)
