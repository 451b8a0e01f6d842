"""`femend correlate` on a rotor's run: operating shapes at the peaks and the response to unbalance, or why not."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import Dof, TimeData, correlate_study, functions_of, read_recording, update_study, write_uff
from femend.bench import CorrelationRun
from femend.errors import RecordingError

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import Rig, write_rig

# the deck's structure but for its mesh and its damping: what is compared is what was simulated
RIG = Rig(bends=False, layer=None, factors=(1.0, 1.0, 1.0), mass_factor=1.0, seconds=30.0, sense=-1)


def with_recordings(study: Path, *names: str) -> Path:
    """The study with these recordings alone."""
    head, *recordings = study.read_text().split("[[recording]]")
    own = [r for r in recordings if any(f'name = "{n}"' in r for n in names)]
    study.write_text("[[recording]]".join([head, *own]))
    return study


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return with_recordings(write_rig(tmp_path_factory.mktemp("rig"), RIG), "runup")


@pytest.fixture(scope="module")
def run(rig: Path) -> CorrelationRun:
    return correlate_study(rig, rig.parent / "out")


@pytest.fixture
def changed(rig: Path, tmp_path: Path) -> Callable[..., Path]:
    """A copy of the study whose run is changed, and whose text is."""

    def make(change: Callable[[TimeData], TimeData] = lambda d: d, text: Callable[[str], str] = str) -> Path:
        (tmp_path / "model.bdf").write_bytes((rig.parent / "model.bdf").read_bytes())
        data = read_recording(rig.parent / "runup.uff", excitation="unknown").time
        write_uff(tmp_path / "runup.uff", functions_of(change(data)))
        (tmp_path / "study.toml").write_text(text(rig.read_text()))
        return tmp_path / "study.toml"

    return make


def test_peaks_are_paired_with_the_modes_they_are(run: CorrelationRun) -> None:
    found = run.run("runup")
    assert found.comparison is not None
    rows = found.comparison.table.rows
    assert found.n_pairs == found.measured.peaks.size == 5
    # mode 2 is along the shaft, where unbalance does not act
    assert [r.b for r in rows] == [0, 2, 3, 4, 5]
    assert max(abs(r.freq_difference) for r in rows) < 0.004
    # peaks 4 and 5 are close: an operating shape there mixes both modes
    assert min(r.mac for r in rows[:3]) > 0.99
    assert min(r.mac for r in rows) > 0.95


def test_the_response_to_unbalance_is_that_of_the_model(run: CorrelationRun) -> None:
    response = run.run("runup").response
    assert response is not None
    assert response.sense == RIG.sense
    assert np.abs(response.unbalance) == pytest.approx(RIG.unbalance, rel=0.05)
    off = np.angle(response.unbalance * np.exp(-1j * np.array(RIG.phase)))
    assert off == pytest.approx(0.0, abs=np.radians(3.0))
    peaks = run.run("runup").measured.peaks
    # a mixture of close modes is met where the single modes are not
    assert response.dac[peaks, peaks].min() > 0.998
    assert response.csac[peaks].min() > 0.998
    assert float(np.mean(response.csac)) > 0.95
    assert float(np.mean(response.csf)) > 0.95


def test_what_is_written(run: CorrelationRun, rig: Path) -> None:
    out = rig.parent / "out"
    result = json.loads((out / "correlation.json").read_text())
    assert result["recordings"] == []
    (one,) = result["runs"]
    assert (one["recording"], one["role"], one["axis"], one["bearings"]) == ("runup", "fit", "X", [511, 512])
    n, lines = len(one["peaks"]), len(one["freq"])
    assert np.shape(one["mac"]) == (n, len(one["model_freq"]))
    assert np.shape(one["response"]["dac_of_peaks"]) == (n, lines)
    assert len(one["response"]["csac"]) == len(one["response"]["csf"]) == len(one["noise"]) == lines
    first = one["peaks"][0]
    assert first["rpm"] == pytest.approx(60 * first["freq"], rel=1e-12)
    assert first["likest_response"]["dac"] > 0.99
    assert first["likest_response"]["freq_difference"] == pytest.approx(0.0, abs=0.02)
    with (out / "correlation.runs.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [int(r["model mode"]) for r in table] == [1, 3, 4, 5, 6]
    assert float(table[0]["MAC"]) == pytest.approx(first["mac"], abs=1e-12)
    page = (out / "correlation.html").read_text()
    assert "5 of 5 peaks of operating shapes look like a mode of the model" in page
    assert "turning against the right hand about X" in page
    assert "5 of 5 peaks of the run's operating shapes look like a mode" in repr(run)


def test_a_held_out_run_is_compared_beside_a_modal_test(tmp_path: Path) -> None:
    study = with_recordings(write_rig(tmp_path, replace(RIG, seconds=20.0)), "hammer", "runup")
    study.write_text(study.read_text().replace('file = "runup.uff"', 'file = "runup.uff"\nrole = "validate"'))
    run = correlate_study(study)
    assert run["hammer"].n_pairs == run["hammer"].n_test
    assert run.run("runup").measured.role == "validate"
    with pytest.raises(KeyError, match="no run 'hammer'; there are runup"):
        run.run("hammer")


def test_a_sensor_that_is_turned_round_is_compared_as_it_is(changed: Callable[..., Path], run: CorrelationRun) -> None:
    def turned(data: TimeData) -> TimeData:
        values, channels = data.values.copy(), list(data.channels)
        values[4] *= -1
        dof = channels[4].dof
        assert dof is not None
        channels[4] = replace(channels[4], dof=Dof(dof.node, dof.component, -1))
        return replace(data, values=values, channels=tuple(channels))

    found, plain = correlate_study(changed(turned)).run("runup"), run.run("runup")
    assert found.response is not None
    assert plain.response is not None
    np.testing.assert_allclose(found.response.csac, plain.response.csac, atol=1e-4)
    np.testing.assert_allclose(found.comparison.mac, plain.comparison.mac, atol=1e-4)


def test_a_run_whose_time_counts_milliseconds_is_told(changed: Callable[..., Path]) -> None:
    run = correlate_study(changed(lambda d: replace(d, dt=1000 * d.dt)))
    assert any("is the axis in milliseconds? A column that counts" in w for w in run.result["warnings"])
    assert not any("move no sensor" in w for w in run.result["warnings"])
    assert run.result["advice"].startswith("mend the time axis of the recordings that look mistaken first")
    assert "has no mode up to 3 times that" in run.run("runup").why


def test_a_wrong_axis_is_told_with_the_right_one(changed: Callable[..., Path], run: CorrelationRun) -> None:
    assert not any("'axis'" in text for text in run.result["warnings"])
    axis = "XYZ"[run.run("runup").measured.axis]
    wrong = "Z" if axis == "Y" else "Y"
    other = correlate_study(changed(text=lambda t: t.replace(f'axis = "{axis}"', f'axis = "{wrong}"')))
    (said,) = [text for text in other.result["warnings"] if "'axis'" in text]
    assert f"with axis {wrong}, " in said
    assert f" with axis {axis}: check" in said


def test_a_bearing_the_model_does_not_have_leaves_the_modes(changed: Callable[..., Path]) -> None:
    run = correlate_study(changed(text=lambda t: t.replace("nodes = [511, 512]", "nodes = [511, 9999]")))
    found = run.run("runup")
    assert found.response is None
    assert found.n_pairs == 5
    assert any("bearing node 9999 of [recording.rotating] is not among the" in w for w in run.result["warnings"])


@pytest.mark.parametrize(
    ("change", "text", "message"),
    [
        (lambda d: changed_row(d, 0, np.full(d.n_samples, 1.3)), str, r"'runup' is not compared: .*stays at 1\.3"),
        (lambda d: replace(d, values=d.values[:, :768]), str, r"'runup' is not compared: .* rev/s hold \d+ lines"),
        (
            lambda d: d,
            lambda t: t + "[correlation]\nband = [100.0, 200.0]\n",
            r"'runup' is not compared: its speeds go through .* of which the band 100 to 200 Hz of \[correlation\]",
        ),
        (lambda d: d.select([0]), str, r"'runup' is not compared: it holds no response with a node and a direction"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared_is_said(
    changed: Callable[..., Path],
    change: Callable[[TimeData], TimeData],
    text: Callable[[str], str],
    message: str,
) -> None:
    with pytest.raises(RecordingError, match=message):
        correlate_study(changed(change, text))


def test_a_run_that_cannot_be_compared_does_not_stop_the_others(tmp_path: Path) -> None:
    study = with_recordings(write_rig(tmp_path, replace(RIG, seconds=20.0)), "hammer", "runup")
    data = read_recording(tmp_path / "runup.uff", excitation="unknown").time
    write_uff(tmp_path / "runup.uff", functions_of(changed_row(data, 0, np.full(data.n_samples, 1.3))))
    run = correlate_study(study)
    assert run.runs == ()
    assert run["hammer"].n_pairs > 0
    assert any("'runup' is not compared" in w for w in run.result["warnings"])


def test_an_update_says_that_runs_have_no_part_in_it(rig: Path) -> None:
    with pytest.raises(
        RecordingError, match=r"'runup' is a rotor's run and has no part in an update; `femend correlate`"
    ):
        update_study(rig)


def changed_row(data: TimeData, row: int, values: np.ndarray) -> TimeData:
    every = data.values.copy()
    every[row] = values
    return replace(data, values=every)
