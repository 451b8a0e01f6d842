"""What is wrong with the recordings of a study in stages is refused or told, with channel and time."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import TimeData, functions_of, load_study, read_recording, write_uff
from femend.diagnose.staged import StagedData, contradictions, staged_data
from femend.errors import FemendError, RecordingError, RecordingTooShortError, SignalError
from femend.signal import to_quantity

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import Rig, write_rig

Change = Callable[[TimeData], TimeData]
AT = 7  # row of the sensor that goes wrong, of the run-up (row 0 is the tacho)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short rig study that can be read."""
    return write_rig(tmp_path_factory.mktemp("rig"), Rig(seconds=20.0, top_speed=18.0)).parent


@pytest.fixture
def broken(rig: Path, tmp_path: Path) -> Callable[[str, Change], Path]:
    """A copy of the study in which one recording alone is left, after a change."""

    def make(name: str, change: Change) -> Path:
        head, *recordings = (rig / "study.toml").read_text().split("[[recording]]")
        own = next(r for r in recordings if f'name = "{name}"' in r)
        (tmp_path / "study.toml").write_text(f"{head}[[recording]]{own}")
        (tmp_path / "model.bdf").write_bytes((rig / "model.bdf").read_bytes())
        write_uff(tmp_path / f"{name}.uff", functions_of(change(recorded(rig, name))))
        return tmp_path / "study.toml"

    return make


def recorded(rig: Path, name: str) -> TimeData:
    return read_recording(rig / f"{name}.uff", excitation="unknown").time


def told(study: Path) -> tuple[StagedData, str]:
    """The data of the stages, and all warnings as one text."""
    test = load_study(study).read_recordings()
    data = staged_data(test)
    return data, "\n".join([*(w for r in test for w in r.warnings), *data.warnings])


def changed(data: TimeData, row: int, values: Callable[[np.ndarray], np.ndarray]) -> TimeData:
    every = data.values.copy()
    every[row] = values(every[row])
    return replace(data, values=every)


def name_of(data: TimeData, row: int) -> str:
    return str(data.channels[row].dof)


def test_a_sound_study_has_no_warnings(rig: Path) -> None:
    assert told(rig / "study.toml")[1] == ""


def test_a_tacho_of_another_name(broken: Callable[[str, Change], Path]) -> None:
    study = broken("runup", lambda data: data)
    study.write_text(study.read_text().replace('tacho = "tacho"', 'tacho = "rpm"'))
    with pytest.raises(FemendError, match=r"(?s)runup.*'rpm'.*tacho"):
        told(study)


def test_bounces_are_thrown_out_and_told(rig: Path, broken: Callable[[str, Change], Path]) -> None:
    """A second edge three samples after twenty of the pulses: the same speed, and a warning. Where the first edge is so
    slow that the level lies above its first sample, its bounce is taken for the edge."""
    data = recorded(rig, "runup")
    low, high = data.values[0].min(), data.values[0].max()
    edges = np.flatnonzero((data.values[0, 1:] > 2.5) & (data.values[0, :-1] <= 2.5))[5:45:2]

    def bounce(x: np.ndarray) -> np.ndarray:
        x = x.copy()
        x[edges + 2], x[edges + 3] = low, high
        return x

    found, said = told(broken("runup", lambda d: changed(d, 0, bounce)))
    plain = staged_data(load_study(rig / "study.toml").read_recordings())
    assert "channel tacho" in said
    count = re.search(r"(\d+) bounces thrown out.*the first: edge thrown out as a bounce at (\S+) s", said)
    assert count is not None
    assert 15 <= int(count[1]) <= 20
    assert float(count[2]) == pytest.approx(data.t[edges[0]] + 3 / data.rate, abs=2 / data.rate)
    (run,), (clean,) = found.runs["operation"], plain.runs["operation"]
    after = int(1.0 / run.dt)  # before the first pulse the speed is not known
    assert run.rev_per_s[after:] == pytest.approx(clean.rev_per_s[after:], rel=0.01)


def test_a_tacho_that_stands_still(broken: Callable[[str, Change], Path]) -> None:
    with pytest.raises(SignalError, match="channel tacho.*stays at 1.3") as caught:
        told(broken("runup", lambda data: changed(data, 0, lambda x: np.full_like(x, 1.3))))
    assert caught.value.recording == "runup"


@pytest.mark.parametrize("name", ["runup", "ambient"])
def test_a_dead_channel(rig: Path, broken: Callable[[str, Change], Path], name: str) -> None:
    dead = name_of(recorded(rig, name), AT)
    with pytest.raises(SignalError, match="is 0.3 in all") as caught:
        told(broken(name, lambda data: changed(data, AT, lambda x: np.full_like(x, 0.3))))
    assert dead in str(caught.value.channel)
    assert caught.value.time == 0.0


def test_a_channel_that_dies_on_the_way(rig: Path, broken: Callable[[str, Change], Path]) -> None:
    data = recorded(rig, "runup")
    half = data.n_samples // 2
    _, said = told(broken("runup", lambda d: changed(d, AT, lambda x: np.where(np.arange(x.size) < half, x, 0.0))))
    assert f"{name_of(data, AT)} " in said
    assert f"holds 0 m/s^2 on {data.n_samples - half} samples (from {data.t[half]:.6g}" in said


@pytest.mark.parametrize("name", ["runup", "ambient"])
def test_a_clipped_channel(rig: Path, broken: Callable[[str, Change], Path], name: str) -> None:
    data = recorded(rig, name)
    limit = float(data.values[AT].std())
    first = data.t[np.argmax(data.values[AT] > limit)]
    _, said = told(broken(name, lambda d: changed(d, AT, lambda x: np.clip(x, -limit, limit))))
    assert f"{name_of(data, AT)} " in said
    assert "it is clipped" in said
    assert f"(from {first:.6g}"[:8] in said


def test_a_weak_channel(rig: Path, broken: Callable[[str, Change], Path]) -> None:
    _, said = told(broken("ambient", lambda data: changed(data, AT, lambda x: 1e-4 * x)))
    assert name_of(recorded(rig, "ambient"), AT) in said
    assert "has an rms of" in said


def test_two_rates_in_one_recording(rig: Path, tmp_path: Path, broken: Callable[[str, Change], Path]) -> None:
    study = broken("runup", lambda data: data)
    data = recorded(rig, "runup")
    fast, slow = data.select(range(AT)), data.select(range(AT, len(data.channels)))
    slow = TimeData(slow.name, 2 * slow.dt, slow.values[:, ::2], slow.channels)
    write_uff(tmp_path / "runup.uff", [*functions_of(fast), *functions_of(slow)])
    with pytest.raises(RecordingError, match="step 0.0078125 s.*0.00390625 s.*merge") as caught:
        told(study)
    assert name_of(data, AT) in str(caught.value.channel)


def test_records_of_unequal_length(rig: Path, tmp_path: Path, broken: Callable[[str, Change], Path]) -> None:
    study, data = broken("runup", lambda data: data), recorded(rig, "runup")
    whole, rest = data.select(range(AT)), data.select(range(AT, len(data.channels)))
    write_uff(tmp_path / "runup.uff", [*functions_of(whole), *functions_of(cut(rest, data.n_samples - 50))])
    with pytest.raises(RecordingError, match=f"'runup'.*has {data.n_samples - 50} samples.*cut the records") as caught:
        told(study)
    assert name_of(data, AT) in str(caught.value.channel)


def cut(data: TimeData, n: int) -> TimeData:
    return replace(data, values=data.values[:, :n])


def test_an_ambient_recording_too_short_for_the_lowest_mode(broken: Callable[[str, Change], Path]) -> None:
    with pytest.raises(RecordingTooShortError, match="'ambient': 2 s hold .* of its lowest mode") as caught:
        told(broken("ambient", lambda data: cut(data, 512)))
    assert caught.value.recording == "ambient"
    assert caught.value.needed > caught.value.duration == pytest.approx(2.0)
    # long enough for frequencies, not for damping: used, and told how long it should have been
    data, said = told(broken("ambient", lambda data: cut(data, 2560)))
    assert data.output_only["operation"][0].modes.n_modes
    assert re.search(r"'ambient': for damping .* record at least \S+ s \(now 10 s\)", said)


def test_a_run_too_short_for_modes(broken: Callable[[str, Change], Path]) -> None:
    """Four seconds go from 2.8 to 5.1 rev/s: the loads may still be told, modes cannot."""
    data, said = told(broken("runup", lambda data: cut(data, 1024)))
    assert "operation" not in data.output_only
    assert re.search(r"'runup': 4.047 s from \S+ to 5\.\d+ rev/s hold 4 lines .* too few for the modes", said)


def test_a_tacho_that_pauses(rig: Path, broken: Callable[[str, Change], Path]) -> None:
    """Its pulses are lost for 2.7 s: put in where the speed goes on, counted, with the time of the first."""
    data = recorded(rig, "runup")

    def pause(x: np.ndarray) -> np.ndarray:
        return np.where((np.arange(x.size) >= 1500) & (np.arange(x.size) < 2200), x.min(), x)

    _, said = told(broken("runup", lambda d: changed(d, 0, pause)))
    count = re.search(r"channel tacho.*: (\d+) lost pulses put in.* at (\S+) s", said)
    assert count is not None
    assert int(count[1]) > 15
    assert data.t[1400] < float(count[2]) < data.t[1550]


def test_a_gap_in_all_channels(rig: Path, broken: Callable[[str, Change], Path]) -> None:
    data = recorded(rig, "ambient")

    def gap(d: TimeData) -> TimeData:
        values = d.values.copy()
        values[:, 1500:1600] = 0.0
        return replace(d, values=values)

    _, said = told(broken("ambient", gap))
    for row in range(len(data.channels)):
        assert re.search(
            f"{re.escape(name_of(data, row))} .*holds 0 m/s\\^2 on 100 samples \\(from {data.t[1500]:.6g}", said
        )


def test_an_frf_of_nothing(rig: Path, tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_bytes((rig / "model.bdf").read_bytes())
    head, *recordings = (rig / "study.toml").read_text().split("[[recording]]")
    (tmp_path / "study.toml").write_text(f"{head}[[recording]]{recordings[0]}")
    frf = read_recording(rig / "hammer.uff").frf
    H = frf.H.copy()
    H[:, 0, 4] = 0.0
    write_uff(tmp_path / "hammer.uff", functions_of(replace(frf, H=H)))
    with pytest.raises(RecordingError, match=f"{re.escape(str(frf.inputs[4].dof))} is 0 on all"):
        told(tmp_path / "study.toml")


def test_a_run_of_velocities_is_the_run_of_accelerations(rig: Path, broken: Callable[[str, Change], Path]) -> None:
    """Integrals lose what is slower than 0.5 Hz; the run itself begins at 2.5 Hz."""
    found, _ = told(broken("runup", lambda data: to_quantity(data, "velocity", high_pass=0.5)))
    (run,) = found.runs["operation"]
    (plain,) = staged_data(load_study(rig / "study.toml").read_recordings()).runs["operation"]
    inside = slice(int(3 / run.dt), -int(3 / run.dt))
    assert np.linalg.norm((run.y - plain.y)[:, inside]) < 0.02 * np.linalg.norm(plain.y[:, inside])


def test_a_run_of_strains_is_refused(broken: Callable[[str, Change], Path]) -> None:
    def strained(data: TimeData) -> TimeData:
        channels = list(data.channels)
        channels[AT] = replace(channels[AT], quantity="strain", unit="1")
        return replace(data, channels=tuple(channels))

    study = broken("runup", lambda data: data)
    test = load_study(study).read_recordings()
    (run,) = test
    with pytest.raises(RecordingError, match="measures strain"):
        staged_data(replace(test, recordings=(replace(run, data=strained(run.time)),)))


def test_reversed_and_exchanged_rows_are_named() -> None:
    rng = np.random.default_rng(3)
    y = rng.standard_normal((8, 40)) + 1j * rng.standard_normal((8, 40))
    names = [f"s{i}" for i in range(8)]
    assert contradictions(y, y, names) == ()
    wrong = y.copy()
    wrong[2] *= -1
    wrong[[4, 6]] = wrong[[6, 4]]
    assert [(name, other) for name, _, other, _ in contradictions(wrong, y, names)] == [("s2", ""), ("s4", "s6")]
    # a model that is wrong altogether accuses no sensor
    assert contradictions(y, rng.standard_normal((8, 40)) + 0j, names) == ()
