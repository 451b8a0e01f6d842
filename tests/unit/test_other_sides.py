"""A stop that was followed to whole records on the wrong sides, and what is made of it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate, Start
from femend.diagnose.fitting.closed_loop import ClosedLoop
from femend.diagnose.fitting.nonlinear import refit_nonlinear
from femend.diagnose.fitting.other_sides import on_other_sides
from femend.diagnose.locating.joint import Joint, open_joint
from femend.estimate import FitRecord, Problem
from femend.model import Place, reduce_model
from femend.physics import FitCoordinates, physics

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

Array = NDArray[np.float64]
DT, N, SCALE = 1 / 1024, 1024, (8e3, 10.0)
STOP = {"k": 6e3, "gap": 6e-5}


def closed(problem: Problem, joint: Joint, sides: float) -> tuple[ClosedLoop, Array]:
    """A stop without a companion on `sides`, and its fit coordinates."""
    coordinates = FitCoordinates(physics("clearance"), {**STOP, "sides": sides})
    loop = ClosedLoop(problem, joint, "clearance", coordinates, SCALE)
    return loop, np.concatenate([coordinates.start(), np.zeros(2)])


def recorded(folder: Path, sides: float) -> tuple[Problem, Joint]:
    """A record of the small cantilever with the stop at node 10, with noise of 1 %, and its opened joint."""
    model, out = small_study.cantilever(folder)
    rng = np.random.default_rng(3)
    spectrum = np.zeros(N // 2 + 1, dtype=complex)
    spectrum[8:150] = rng.standard_normal(142) + 1j * rng.standard_normal(142)
    ramp = np.sin(0.5 * np.pi * np.clip(np.arange(N) / 100, 0, 1)) ** 2  # from rest
    u = np.fft.irfft(spectrum, N)[None] * 100 * ramp
    blank = np.zeros((len(out), N))
    record = FitRecord("r", u, blank, DT, out[-1:], out, np.ones(1), np.ones(len(out)), np.ones(len(out)))
    reduced = reduce_model(model, 150.0, out.tolist())
    row = 6 * model.index(10) + 2
    place = Place("ground", (10,), "Z", "ground", (np.array([row]),), (np.ones(1),))
    joint = open_joint(place, reduced, 150.0, out.tolist())
    loop, x = closed(Problem([record], (8.0, 150.0), small_study.ZETA, 2), joint, sides)
    ((history,),) = loop.histories([(loop.problem.prior(joint.reduced)[0], x)])
    # the stop is met, and what it does is far above the noise
    assert np.abs(history.f).max() > 0.1 * np.abs(u).max()
    noise = 0.01 * history.y.std(axis=1)
    y = history.y + noise[:, None] * rng.standard_normal(history.y.shape)
    return Problem([replace(record, y=y, noise=noise)], (8.0, 150.0), small_study.ZETA, 2), joint


def begun(problem: Problem, joint: Joint, sides: float) -> Candidate:
    loop, x = closed(problem, joint, sides)
    p = problem.prior(joint.reduced)[0]
    own = {"k_scale": SCALE[0], "c_scale": SCALE[1]}
    start = Start(physics("clearance"), dict(loop.coordinates.values), 0.0, 0.0, 0.0)
    return Candidate(
        start.physics, "clearance", joint, start.values, p, x, len(x), 0.0, np.inf, np.nan, 0.0, 0.0, np.inf, None,
        loop.coordinates, own, 0.0,
    )  # fmt: skip


@pytest.mark.parametrize(("true", "tried"), [(1.0, 2.0), (2.0, -1.0)])
def test_a_stop_is_told_on_its_own_sides(tmp_path: Path, true: float, tried: float) -> None:
    problem, joint = recorded(tmp_path, true)
    candidate = refit_nonlinear(problem, begun(problem, joint, tried))
    assert candidate.fitted > 1.2
    rest = cast(Any, SimpleNamespace(fit=SimpleNamespace(p=problem.prior(joint.reduced)[0])))
    found = on_other_sides(problem, candidate, rest, 1.2)
    assert found.values["sides"] == true
    assert found.fitted < 1.2
    # what leaves no more than noise stays as it is, and so does another law
    assert on_other_sides(problem, found, rest, 1.2) is found
    other = replace(candidate, values={"k3": 1.0})
    assert on_other_sides(problem, other, rest, 1.2) is other
