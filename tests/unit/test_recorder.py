"""Simulated samples are those of a recorder: filtered before they are picked, unless recordings show otherwise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import firwin

import small_study
from femend import _core
from femend.diagnose.fitting import nonlinear
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.closed_loop import FINE, RECORDER, ClosedLoop, upsampled
from femend.diagnose.fitting.nonlinear import as_recorded, candidate_motion, simulate_candidate
from femend.diagnose.locating.joint import open_joint
from femend.estimate import FitRecord, Problem
from femend.model import Place, reduce_model
from femend.physics import FitCoordinates, physics

Array = NDArray[np.float64]
RATE, N, BAND = 512.0, 2048, (8.0, 150.0)
LAW, VALUES = "cubic_stiffness", {"k3": 2e13}


def test_samples_are_filtered_before_they_are_picked() -> None:
    """A stop excites a mode at 3/4 of the sampling rate, which samples picked as they come show at 1/4 of it."""
    factor, n = 8, 1024
    omega, zeta = 2 * np.pi * np.array([0.05, 0.76]), np.array([0.01, 0.002])
    phi, w = np.array([[1.0, 0.05]]), np.array([[1.0, 1.0]])
    laws = [[("clearance", {"k": 2.0, "gap": 3.0, "sides": 1.0})]]
    u = upsampled(np.random.default_rng(1).standard_normal((1, n)), factor)
    fine = _core.simulate(omega, zeta, phi, phi, w, laws, u, 1 / factor)[0][0]
    kept = _core.simulate(omega, zeta, phi, phi, w, laws, u, 1 / factor, stride=factor // RECORDER, decimate=RECORDER)
    taps = firwin(80 * factor + 1, 1 / factor, window=("kaiser", 9.0))
    wanted = np.convolve(fine, taps, "same")[::factor]
    inside, lines = slice(100, n - 100), slice(0, 300)  # to 0.36 of the rate

    def spectrum(y: Array) -> Array:
        return np.abs(np.fft.rfft(y[inside] * np.hanning(n - 200)))[lines]

    size = np.linalg.norm(spectrum(wanted))
    folded, left = (np.linalg.norm(spectrum(y - wanted)) / size for y in (fine[::factor], kept[0][0]))
    assert left < 5e-3
    assert folded > 20 * left
    assert kept[1].shape == kept[3].shape == (1, n)


def _fitted(tmp_path: Path, filters: bool) -> tuple[Problem, Candidate]:
    """A cubic spring at the small cantilever, recorded with or without a filter, and the right candidate for it."""
    model, out = small_study.cantilever(tmp_path)
    spectrum = np.zeros(N // 2 + 1, dtype=complex)
    rng = np.random.default_rng(3)
    spectrum[32:600] = rng.standard_normal(568) + 1j * rng.standard_normal(568)
    u = np.fft.irfft(spectrum, N)[None] * 2000 * np.sin(np.pi * np.arange(N) / N) ** 2
    ends = np.ones(1), np.ones(len(out))
    record = FitRecord("r", u, np.zeros((len(out), N)), 1 / RATE, out[-1:], out, *ends, np.ones(len(out)))
    reduced = reduce_model(model, BAND[1], out.tolist())
    row = 6 * model.index(10) + 2
    place = Place("ground", (10,), "Z", "ground", (np.array([row]),), (np.ones(1),))
    joint = open_joint(place, reduced, BAND[1], out.tolist())
    coordinates = FitCoordinates(physics(LAW), VALUES)
    problem = Problem([record], BAND, small_study.ZETA, 2)
    loop, x = ClosedLoop(problem, joint, LAW, coordinates, (8e3, 10.0)), np.append(coordinates.start(), [0.0, 0.0])
    p = problem.prior(joint.reduced)[0]
    problem.recorder.filters = filters
    y = loop.histories([(p, x)])[0][0].y
    noise = 1e-3 * y.std(axis=1)
    y = y + noise[:, None] * rng.standard_normal(y.shape)
    again = Problem([replace(record, y=y, noise=noise)], BAND, small_study.ZETA, 2)
    scale = {"k_scale": 8e3, "c_scale": 10.0}
    candidate = Candidate(
        physics(LAW), LAW, joint, VALUES, p, x, loop.n_x, 0.0, 1.0, 1.0, coordinates=coordinates, extra=scale
    )
    return again, candidate


@pytest.mark.parametrize("filters", [True, False])
def test_the_recorder_is_told_by_what_it_recorded(tmp_path: Path, filters: bool) -> None:
    problem, candidate = _fitted(tmp_path, filters)
    other = problem.thinned(50)
    assert other.recorder is problem.on(problem.records).recorder is problem.recorder
    found = as_recorded(problem, candidate, 40.0, 1.5)
    assert problem.recorder.filters is filters
    assert (found is candidate) is filters
    assert bool(other.recorder.warnings) is not filters
    # once it is known there is no second question
    assert filters or as_recorded(problem, found, 40.0, 1.5) is found


def test_an_interrupted_question_leaves_the_recorder_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At its time limit a diagnosis writes what is settled, and that samples were picked without a filter is not."""
    problem, candidate = _fitted(tmp_path, False)

    def interrupted(*given: object) -> Candidate:
        assert not problem.recorder.filters
        raise KeyboardInterrupt

    monkeypatch.setattr(nonlinear, "refit_nonlinear", interrupted)
    with pytest.raises(KeyboardInterrupt):
        as_recorded(problem, candidate, 40.0, 1.5)
    assert problem.recorder.filters
    assert not problem.recorder.warnings


def test_a_simulation_shows_displacements_and_velocities_too(tmp_path: Path) -> None:
    problem, candidate = _fitted(tmp_path, True)
    (record,) = problem.records
    history = simulate_candidate(problem, candidate, record)
    there = small_study.SENSORS.index(10)  # where the spring acts, so that it moves as its coordinate does
    for order, wanted in ((0, history.d[0]), (1, history.v[0])):
        shown = candidate_motion(problem, candidate, record, order)[there]
        # but for the compliance of modes beyond the basis, which the spring alone feels
        assert np.linalg.norm(shown - wanted) < 0.02 * np.linalg.norm(wanted)
    np.testing.assert_array_equal(candidate_motion(problem, candidate, record), history.y)


def test_what_the_core_keeps(tmp_path: Path) -> None:
    problem, candidate = _fitted(tmp_path, True)
    assert candidate.joint is not None
    loop = ClosedLoop(problem, candidate.joint, LAW, FitCoordinates(physics(LAW), VALUES), (1.0, 1.0))
    assert loop.kept == (FINE // RECORDER, RECORDER)
    problem.recorder.filters = False
    assert loop.kept == (FINE, 1)


def test_a_factor_of_none_is_refused() -> None:
    one = np.ones(1)
    with pytest.raises(ValueError, match="decimate = 0; it must be 1 or more"):
        _core.simulate(one, one, one[None], one[None], one[None], [[]], np.ones((1, 8)), 0.1, decimate=0)
