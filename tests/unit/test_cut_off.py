"""Records that end in full motion: what the laws still hold there belongs to their transforms."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import _core
from femend.diagnose.joint import open_joint
from femend.estimate import FitRecord, Problem
from femend.model import Place, read_model, reduce_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

DT, N, FINE = 1 / 1024, 2048, 8
BAND = (8.0, 150.0)
LAWS = {
    "added_mass": {"m": 0.3},
    "viscous_damper": {"c": 15.0},
    "tuned_absorber": {"m": 0.3, "k": 0.3 * (2 * np.pi * 30) ** 2, "c": 2.0},
    "viscoelastic": {"k0": 1e3, "k1": 8e3, "tau": 4e-3},
}


@pytest.mark.parametrize("law", LAWS)
def test_a_law_explains_a_record_that_does_not_end_at_rest(tmp_path: Path, law: str) -> None:
    """The simulation steps in time and knows nothing of transforms. Only the 1 % allowance for the model weighs, so a
    misfit of 0.3 is an error of half a per cent (steps of the simulation); without the law's part at the end it is
    0.43 (relaxing branch), 5 (dashpot), 115 (mass) and 420 (absorber)."""
    path = tmp_path / "model.bdf"
    path.write_text(small_study.deck())
    model = read_model(path, units="SI")
    row = 6 * model.index(10) + 2
    out = np.array([6 * model.index(node) + 2 for node in small_study.SENSORS])
    rng = np.random.default_rng(7)
    spectrum = np.zeros(N // 2 + 1, dtype=complex)
    inside = slice(16, 300)
    spectrum[inside] = rng.standard_normal(284) + 1j * rng.standard_normal(284)
    # begins at rest, does not end there
    ramp = np.sin(0.5 * np.pi * np.clip(np.arange(N * FINE) / (N * FINE // 8), 0, 1)) ** 2
    fine = (np.fft.irfft(spectrum, N * FINE) * 100 * FINE * ramp)[None]
    u = np.ascontiguousarray(fine[:, ::FINE])
    omega, phi = small_study.dense_modes(model)
    done = _core.simulate_batch(
        omega[None],
        np.full((1, len(omega)), small_study.ZETA),
        phi[out[-1:]][None],
        phi[out][None],
        phi[[row]][None],
        [[[(law, LAWS[law])]]],
        [fine],
        DT / FINE,
        stride=FINE,
    )
    y = done[0][0][0]
    assert np.abs(y[:, -40:]).max() > 0.2 * np.abs(y).max()
    ends = np.ones(1), np.ones(len(out))
    record = FitRecord("r", u, y, DT, out[-1:], out, *ends, noise=1e-6 * y.std(axis=1))
    reduced = reduce_model(model, BAND[1], [*out.tolist()])
    tuned = 7  # with the modes above the band, whose decays the steps of the simulation leave visible
    problem = Problem([record], BAND, small_study.ZETA, tuned)
    place = Place("ground", (10,), "Z", "ground", (np.array([row]),), (np.ones(1),))
    joint = open_joint(place, reduced, BAND[1], out.tolist())
    x = np.log(list(LAWS[law].values()))
    (fit,) = problem.fit([joint.hypothesis((law,), x, np.ones(len(x)))], iterations=0)
    assert fit is not None
    assert fit.score < 0.4
