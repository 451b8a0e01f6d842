"""The sensor that would split a set of places: a spring on one arm of a T whose sensors are all on its stem."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Channel, Dof, TimeData, _core, functions_of, write_uff
from femend.cli.summary import summary
from femend.diagnose.locating.next_sensor import next_sensor
from femend.model import read_model
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import LEVELS, NOISE, RATE, UPSAMPLING, ZETA, dense_modes, force, study_text

STEM, LEFT, RIGHT, SHAKER, SECONDS = (3, 5, 6, 7), 20, 21, 5, 2.0


def deck(more: str = "") -> str:
    """A T of bars: stem along X, clamped at its foot, and an arm to each side at its end."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1", "MAT1,1,7.+10,,0.33,2700."]
    lines += ["PBAR,1,1,3.3-4,3.3275-9,2.475-8,1.0-8"]
    lines += [f"GRID,{n},,{0.1 * (n - 1):.3f},0.,0." for n in range(1, 8)]
    lines += [f"GRID,{LEFT},,0.6,0.15,0.", f"GRID,{RIGHT},,0.6,-0.15,0."]
    lines += [f"CBAR,{n},1,{n},{n + 1},0.,0.,1." for n in range(1, 7)]
    lines += [f"CBAR,{n},1,7,{n},0.,0.,1." for n in (LEFT, RIGHT)]
    lines += ["SPC1,1,123456,1", *([more] if more else []), "ENDDATA", ""]
    return "\n".join(lines)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    folder = tmp_path_factory.mktemp("t")
    (folder / "truth.bdf").write_text(deck(f"CELAS2,900,6.+4,{LEFT},3"))
    truth = read_model(folder / "truth.bdf")
    omega, phi = dense_modes(truth)
    keep = omega < 2 * np.pi * 2000
    rows = [6 * truth.index(node) + 2 for node in STEM]
    n, rng = int(RATE * SECONDS), np.random.default_rng(4)
    for seed, (name, (role, level)) in enumerate(LEVELS.items()):
        u = force(level, seed + 7, n)
        fine = np.fft.irfft(np.fft.rfft(u, 2 * n), 2 * n * UPSAMPLING)[: n * UPSAMPLING] * UPSAMPLING
        y = _core.simulate(
            omega[keep], np.full(int(keep.sum()), ZETA), phi[[6 * truth.index(SHAKER) + 2]][:, keep],
            phi[rows][:, keep], np.zeros((0, int(keep.sum()))), [], fine[None], 1 / RATE / UPSAMPLING,
            stride=UPSAMPLING,
        )[0]  # fmt: skip
        y = y + NOISE * y.std(axis=1)[:, None] * rng.standard_normal(y.shape)
        channels = [Channel(Dof(SHAKER, 3), "force", "N")]
        values = [u]
        if role != "predict":
            channels += [Channel(Dof(node, 3), "acceleration", "m/s^2") for node in STEM]
            values += list(y)
        write_uff(folder / f"{name}.uff", functions_of(TimeData(name, 1 / RATE, np.array(values), tuple(channels))))
    (folder / "model.bdf").write_text(deck())
    (folder / "study.toml").write_text(study_text({name: role for name, (role, _) in LEVELS.items()}, ()))
    found = diagnose(folder / "study.toml")
    assert isinstance(found, StudyRun)
    return found


def test_a_sensor_on_an_arm_is_what_is_missing(run: StudyRun) -> None:
    (finding,) = run.result["findings"]
    where = finding["location"]
    assert finding["physics"] == "support_stiffness"
    possible = {n for place in [where["nodes"], *where["also_possible"]] for n in place}
    assert {LEFT, RIGHT} <= possible
    sensor = where["next_sensor"]
    assert sensor["node"] in (LEFT, RIGHT)
    assert sensor["direction"] == "Z"
    assert 1 <= sensor["tells_apart"] <= sensor["of"]
    assert f"a sensor at node {sensor['node']} in Z would tell" in summary(run.result)


def test_no_sensor_is_asked_for_where_nothing_is_open(run: StudyRun) -> None:
    d = run.diagnosis
    assert d.place is not None
    assert next_sensor(d.problem, d.reduced, d.place, [], d.settings.margin) is None
