"""Fits in the measured quantity, and naming at a known place, on oscillators integrated by another program."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import femend as fe
from femend import Channel, Recording, Test, TimeData
from femend.diagnose.fitting.output_fit import Modes, OutputFit, TimeRecord, fit_output
from femend.diagnose.fitting.output_laws import modes_of, with_further_law
from femend.diagnose.naming.name_at import name_at
from femend.dof import Dof
from femend.errors import RecordingError
from femend.model import find_places
from femend.physics import physics

MASS, K, C, K3, K2 = 2.0, 5000.0, 8.0, 2e7, 1e5
DT, N, SKIP = 1 / 100, 1500, 100
ZERO = 0.5
# the force ends, and the motion decays until the record does
END = (N - 250) * DT


def duffing(seed: int, *, quadratic: float = 0.0, noise: float = 0.002, level: float = 8.0) -> TimeRecord:
    """Displacement of a Duffing oscillator under a multisine of 1 to 16 Hz, whose recorded force lacks a constant."""
    rng = np.random.default_rng(seed)
    freq = np.arange(1, int(16 * N * DT)) / (N * DT)
    amplitude = level * np.sqrt(2 / len(freq)) * (freq > 1)
    phase = rng.uniform(0, 2 * np.pi, len(freq))

    def force(t: float) -> float:
        window = np.sin(np.clip(min(t, END - t), 0.0, 1.0) * np.pi / 2) ** 2
        return float(window * (amplitude @ np.cos(2 * np.pi * freq * t + phase)))

    def rate(t: float, x: np.ndarray) -> list[float]:
        d, v = x
        return [v, (force(t) + ZERO - K * d - C * v - K3 * d**3 - quadratic * d**2) / MASS]

    t = np.arange(N) * DT
    y = solve_ivp(rate, (0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-7, atol=1e-10, max_step=DT / 2).y[0]
    u = np.array([force(x) for x in t])
    return TimeRecord(u[None], (y + noise * y.std() * rng.standard_normal(N))[None], DT)


@pytest.fixture(scope="module")
def records() -> list[TimeRecord]:
    return [duffing(1), duffing(2)]


def modes(mass: float = 0.9 * MASS, k: float = 1.05 * K, zeta: float = 0.03) -> Modes:
    row = np.array([[mass**-0.5]])
    return Modes(np.array([np.sqrt(k / mass)]), np.array([zeta]), row, row, row)


def cubic(fit_on: list[TimeRecord]) -> OutputFit:
    start = [[(physics("cubic_stiffness"), {"k3": 0.7 * K3})]]
    return fit_output(modes(), start, fit_on, zero=True, skip=SKIP)


def test_mass_stiffness_damping_law_and_zero_come_back(records: list[TimeRecord]) -> None:
    fit = cubic(records[:1])
    mass = float(fit.modes.w[0, 0] ** -2)
    stiffness = mass * float(fit.modes.omega[0] ** 2)
    damping = 2 * float(fit.modes.zeta[0] * fit.modes.omega[0]) * mass
    # 0.2 % noise on 1400 samples tells sizes to some 1e-4, and a cubic force as large as the linear one to a per mille
    assert (mass, stiffness) == pytest.approx((MASS, K), rel=2e-3)
    assert damping == pytest.approx(C, rel=0.01)
    assert fit.laws[0][0][1]["k3"] == pytest.approx(K3, rel=0.01)
    assert fit.zero == pytest.approx([ZERO], rel=0.02)
    assert fit.n_parameters == 5
    unseen = records[1]
    assert fit.rms_error(unseen, SKIP)[0] < 1.3 * 0.002 * unseen.y.std()
    linear = fit_output(modes(), [[]], records[:1], zero=True, skip=SKIP)
    assert linear.rms_error(unseen, SKIP)[0] > 20 * fit.rms_error(unseen, SKIP)[0]


def test_a_second_law_is_found_where_there_is_one_and_only_there(records: list[TimeRecord]) -> None:
    entries = [physics(name) for name in ("cubic_stiffness", "quadratic_stiffness", "clearance", "quadratic_damping")]
    assert with_further_law(cubic(records[:1]), entries, records[:1], records[1:], skip=SKIP) is None
    both = [duffing(3, quadratic=K2), duffing(4, quadratic=K2)]
    found = with_further_law(cubic(both[:1]), entries, both[:1], both[1:], skip=SKIP)
    assert found is not None
    assert [law.name for law, _ in found.laws[0]] == ["cubic_stiffness", "quadratic_stiffness"]
    assert found.laws[0][1][1]["k2"] == pytest.approx(K2, rel=0.03)


def test_a_force_that_does_not_end_at_zero_does_not_ring() -> None:
    ramp = TimeRecord(np.linspace(1.0, 4.0, 50)[None], np.zeros((1, 50)), DT)
    assert ramp.fine()[0] == pytest.approx(1.0 + 3.0 * np.arange(400) / 8 / 49)


def test_a_law_at_a_known_place_is_named_from_one_sensor(records: list[TimeRecord], tmp_path: Path) -> None:
    deck = tmp_path / "model.bdf"
    deck.write_text(
        "SOL 103\nCEND\nMETHOD = 1\nSPC = 1\nBEGIN BULK\nEIGRL,1,,,1\nGRID,1,,0.,0.,0.\nSPC1,1,23456,1\n"
        f"CONM2,1,1,,{0.95 * MASS}\nPELAS,1,{1.04 * K}\nCELAS1,2,1,1,1\nENDDATA\n",
        encoding="ascii",
    )
    at = Dof(1, 1)
    channels = (Channel(at, "force", "N"), Channel(at, "displacement", "m"))
    test = Test(
        tuple(Recording(f"r{i}", TimeData(f"r{i}", DT, np.vstack([r.u, r.y]), channels)) for i, r in enumerate(records))
    )
    model = fe.read_model(deck, parameters=["k:1", "m:1"])
    start = fe.update(model, test, fe.pair(test, model), damping=0.04)
    where = fe.locate(start)
    assert len(where) == 0  # one sensor cannot tell places apart
    said = fe.name(start, where)
    assert said.verdict == "undetermined"
    assert "record at least 2 responses" in said.diagnosis.advice
    (place,) = (p for p in find_places(model) if p.kind == "ground")
    named = name_at(start.found, place)
    assert named.best.name == "cubic_stiffness"
    assert named.accepted
    candidate = named.best.candidate
    assert candidate.physics is not None
    # what was named on accelerations is taken on to the fit in displacement, which meets the noise
    begun = modes_of(named.problem, candidate)
    fit = fit_output(begun, [[(candidate.physics, candidate.values)]], records, zero=True, skip=SKIP)
    assert float(fit.modes.w[0, 0] ** -2 * fit.modes.omega[0] ** 2) == pytest.approx(K, rel=2e-3)
    assert fit.laws[0][0][1]["k3"] == pytest.approx(K3, rel=0.01)
    assert fit.left**0.5 == pytest.approx(0.002, rel=0.1)


def test_misuse_is_refused(records: list[TimeRecord]) -> None:
    with pytest.raises(RecordingError, match="quantity 'strain' is none of"):
        fit_output(modes(), [[]], records, quantity="strain")
    with pytest.raises(RecordingError, match="one time step"):
        fit_output(modes(), [[]], [records[0], TimeRecord(records[1].u, records[1].y, 2 * DT)])
    with pytest.raises(RecordingError, match="equally long"):
        TimeRecord(np.zeros((1, 10)), np.zeros((1, 9)), DT)
