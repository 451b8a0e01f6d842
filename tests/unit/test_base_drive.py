"""Responses to a motion of the base that nobody recorded: an earthquake, a floor that shakes."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Channel, Dof, TimeData, functions_of, write_uff
from femend.diagnose.driven.unrecorded import with_force_read_off
from femend.model import read_model
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import NOISE, RATE, SECONDS, ZETA, deck, dense_modes, force, study_text

Array = NDArray[np.float64]
E = (7.3e10, 6.8e10)
SENSORS = (3, 5, 8, 11, 13)
ROLES = {"quake1": "fit", "quake2": "fit"}
MASS = 0.05


def shaken(folder: Path, a: Array, more: tuple[str, ...], against: bool = False) -> Array:
    """Absolute accelerations (n_out, n) in Z at the sensors of a cantilever whose clamp moves by a(t) (n,), m/s², or
    those `against` the clamp."""
    path = folder / "truth.bdf"
    path.write_text(deck(E, more))
    model = read_model(path)
    omega, phi = dense_modes(model)
    # M of the free motion times a unit shift of everything that moves in Z: what a moved frame's inertia does
    shift = np.zeros(model.fe.n_g)
    shift[[6 * model.index(n) + 2 for n in range(2, 14)]] = 1.0
    M = model.matrices()[1].toarray()
    at = model.g_rows()
    taken = (phi[at].T @ M) @ shift[at]
    rows = [6 * model.index(node) + 2 for node in SENSORS]
    n = 4 * len(a)
    s = 2j * np.pi * np.fft.rfftfreq(n, 1 / RATE)
    modal = s**2 / (s**2 + 2 * ZETA * omega[:, None] * s + omega[:, None] ** 2)
    H = float(not against) - phi[rows] @ (taken[:, None] * modal)
    return np.asarray(np.fft.irfft(H * np.fft.rfft(a, n), n)[:, : len(a)])


def diagnosed(folder: Path, more: tuple[str, ...] = (), against: bool = False) -> StudyRun:
    """The run of a study of unrecorded motions of the base."""
    for i, name in enumerate(ROLES):
        y = shaken(folder, force(1.0 + i, 10 + i, int(RATE * SECONDS)), more, against)
        y = y + np.random.default_rng(50 + i).standard_normal(y.shape) * NOISE * y.std(axis=1, keepdims=True)
        channels = tuple(Channel(Dof(node, 3), "acceleration", "m/s^2") for node in SENSORS)
        write_uff(folder / f"{name}.uff", functions_of(TimeData(name, 1 / RATE, y, channels)))
    (folder / "model.bdf").write_text(deck())
    text = study_text(ROLES).replace('role = "', 'excitation = "unknown"\nrole = "')
    (folder / "study.toml").write_text(text)
    run = diagnose(folder / "study.toml")
    assert isinstance(run, StudyRun)
    return run


def test_a_motion_of_the_base_that_nobody_recorded_is_what_drives(tmp_path: Path) -> None:
    run = diagnosed(tmp_path)
    assert run.result["verdict"] in ("consistent", "parameters-only")
    driven = run.diagnosis.driven
    assert driven is not None
    assert (driven.place.kind, driven.place.direction) == ("base", "Z")
    (told,) = (text for text in run.result["warnings"] if "no force was recorded" in text)
    assert "a motion of the base along Z" in told
    assert "unless the base's acceleration is recorded" in told
    for name, value in zip(("E_root", "E_tip"), E, strict=True):
        found = run.result["parameters"][name]
        assert abs(found["factor"] - value / 7e10) < 3 * found["sd"]
    assert all(r["final"] < 2 * NOISE for r in run.result["fit"])
    # it is no force at a DOF under which laws could be simulated
    assert with_force_read_off(driven, driven.located[0]) is None


def test_responses_against_the_base_are_those_to_its_inertia_forces(tmp_path: Path) -> None:
    run = diagnosed(tmp_path, against=True)
    assert run.result["verdict"] in ("consistent", "parameters-only")
    driven = run.diagnosis.driven
    assert driven is not None
    assert (driven.place.kind, driven.place.to) == ("base", "inertia")
    assert all(r["final"] < 2 * NOISE for r in run.result["fit"])


def test_what_is_missing_beside_a_motion_of_the_base_is_named(tmp_path: Path) -> None:
    run = diagnosed(tmp_path, (f"CONM2,900,7,,{MASS}",))
    driven = run.diagnosis.driven
    assert driven is not None
    assert driven.place.kind == "base"
    (finding,) = run.result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("added_mass", [7])
    assert finding["parameters"]["m"]["value"] == pytest.approx(MASS, rel=0.1)
