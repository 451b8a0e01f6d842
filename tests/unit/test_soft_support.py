"""A support of a plate that is far softer than the elements around it, told from end to end."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Channel, Dof, TimeData, functions_of, write_uff
from femend.model import Model, read_model
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_plate import CORNERS, plate, supports
from small_study import NOISE, RATE, SECONDS, STUDY, ZETA, dense_modes, force

Array = NDArray[np.float64]
SHAKER, SENSORS = 46, (17, 31, 46, 59, 64, 74, 87, 92)
SOFT, K, E_FACTOR = 13, 2e4, 0.85
LEVELS = {"low": ("fit", 2.0), "high": ("fit", 5.0), "held": ("validate", 4.0)}


def truth(folder: Path) -> Model:
    """The plate with one corner on a spring and its modulus 15 % lower."""
    plate(folder, tuple(n for n in CORNERS if n != SOFT), f"CELAS2,900,{K},{SOFT},3")
    path = folder / "truth.bdf"
    path.write_text((folder / "plate.bdf").read_text().replace("7.+10", f"{E_FACTOR * 7:.3f}+10"))
    return read_model(path)


def respond(model: Model, u: Array) -> Array:
    """Accelerations (n_out, n) in Z at the sensors under a force (n,) at the shaker, from rest."""
    omega, phi = dense_modes(model)
    keep = omega < 2 * np.pi * 5 * RATE
    omega, phi = omega[keep], phi[:, keep]
    rows = [6 * model.index(node) + 2 for node in SENSORS]
    n = 4 * len(u)
    s = 2j * np.pi * np.fft.rfftfreq(n, 1 / RATE)
    modal = s**2 / (s**2 + 2 * ZETA * omega[:, None] * s + omega[:, None] ** 2)
    H = phi[rows] @ (phi[6 * model.index(SHAKER) + 2][:, None] * modal)
    return np.asarray(np.fft.irfft(H * np.fft.rfft(u, n), n)[:, : len(u)])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    folder = tmp_path_factory.mktemp("plate")
    real = truth(folder)
    plate(folder, CORNERS)
    study = STUDY.replace("model.bdf", "plate.bdf") + '[[parameter]]\nname = "E"\nproperty = "E"\nmaterial = 1\n'
    dofs = [Dof(node, 3) for node in SENSORS]
    channels = (Channel(Dof(SHAKER, 3), "force", "N"), *(Channel(dof, "acceleration", "m/s^2") for dof in dofs))
    for i, (name, (role, level)) in enumerate(LEVELS.items()):
        u = force(level, 10 + i, int(RATE * SECONDS))
        y = respond(real, u)
        y = y + np.random.default_rng(50 + i).standard_normal(y.shape) * NOISE * y.std(axis=1, keepdims=True)
        write_uff(folder / f"{name}.uff", functions_of(TimeData(name, 1 / RATE, np.vstack([u, y]), channels)))
        study += f'[[recording]]\nname = "{name}"\nfile = "{name}.uff"\nrole = "{role}"\n'
    (folder / "study.toml").write_text(study)
    done = diagnose(folder / "study.toml")
    assert isinstance(done, StudyRun)
    return done


def test_a_corner_far_softer_than_its_elements_is_told_with_its_spring(run: StudyRun, tmp_path: Path) -> None:
    (of_corner,) = (p for p in supports(plate(tmp_path, CORNERS)) if p.nodes == (SOFT,))
    assert of_corner.support > 50 * K
    assert run.result["verdict"] == "missing-physics"
    (finding,) = run.result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("compliant_support", [SOFT])
    told = finding["parameters"]["k3"]
    assert told["unit"] == "N/m"
    assert told["value"] == pytest.approx(K, rel=0.05)
    assert abs(told["value"] - K) < 3 * told["sd"]
    held = next(r for r in run.result["fit"] if r["recording"] == "held")
    assert held["final"] < 0.02 < held["parameters"]
    assert run.result["parameters"]["E"]["factor"] == pytest.approx(E_FACTOR, rel=0.02)
