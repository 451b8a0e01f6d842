"""Time records of velocities beside accelerations go through a modal test as records of accelerations."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from femend import Channel, Dof, functions_of, load_study, write_uff
from femend.bench.reading.measured import measured_modes
from femend.data import TimeData
from femend.progress import SilentProgress

from .signal_models import respond

DT = 1 / 512


def test_velocities_beside_accelerations_are_made_one(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    force = rng.standard_normal((1, 64 * 512))
    a = respond(force, DT)
    v = np.cumsum(a[0]) * DT
    at = [Dof(3, 3), Dof(5, 3)]
    channels = (
        Channel(at[0], "force", "N"),
        Channel(at[0], "velocity", "m/s"),
        Channel(at[1], "acceleration", "m/s^2"),
    )
    mixed = TimeData("run", DT, np.vstack([force, v - v.mean(), a[1]]), channels)
    plain = TimeData("run", DT, np.vstack([force, a]), (channels[0], replace(channels[2], dof=at[0]), channels[2]))
    (tmp_path / "model.bdf").write_text(small_study.deck())
    text = small_study.study_text({}) + '[[recording]]\nname = "run"\nfile = "run.uff"\n'
    (tmp_path / "study.toml").write_text(text + "[correlation]\nband = [5.0, 60.0]\n")
    found = []
    for data in (mixed, plain):
        write_uff(tmp_path / "run.uff", functions_of(data))
        [one], _ = measured_modes(load_study(tmp_path / "study.toml"), SilentProgress())
        assert one.frf is not None
        assert one.frf.kind == "accelerance"
        found.append(one.modes)
    np.testing.assert_allclose(found[0].freq, found[1].freq, rtol=1e-3)
    np.testing.assert_allclose(found[0].freq, [12.0, 31.0], rtol=5e-3)
    shape = [m.to_mode_set().phi[0] / m.to_mode_set().phi[1] for m in found]
    np.testing.assert_allclose(shape[0], shape[1], rtol=0.05)
