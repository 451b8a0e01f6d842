"""Mistakes with channels that the model confirms: the sensor is left out, or the verdict waits for the correction."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import read_uff, write_uff
from femend.report.headline import headline
from femend.study.doubts.corrections import Corrections, corrections_of, left_out_unseen
from femend.study.doubts.plausible import doubts_found
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from femend.correlate.doubts import Doubt, suggested
from femend.estimate import pair_test
from femend.model import read_model
from femend.study import load_study
from femend.study.doubts.mended import mended, without
from femend.study.doubts.plausible import Doubted

SPRING = ("CELAS2,901,3.+3,9,3",)
E_TRUE = (6.6e10, 7.3e10)


def recorded(folder: Path, factors: dict[int, float], more: tuple[str, ...] = SPRING) -> Path:
    """A study whose channels (0 the force, 1 to 4 the sensors) show `factors` times what they should."""
    path = small_study.write_study(folder, small_study.Truth(E=E_TRUE, more=more))
    for name in small_study.LEVELS:
        functions = list(read_uff(folder / f"{name}.uff").functions)
        functions = [replace(f, y=f.y * factors.get(i, 1.0)) for i, f in enumerate(functions)]
        write_uff(folder / f"{name}.uff", functions)
    return path


def run(path: Path, out: Path | None = None) -> StudyRun:
    found = diagnose(path, out)
    assert isinstance(found, StudyRun)
    return found


@pytest.mark.parametrize(("factor", "said"), [(-1.0, "is reversed"), (1 / 9.80665, "shows 0.102 times")])
def test_a_sensor_that_is_mistaken_is_left_out_and_what_is_missing_is_found(
    tmp_path: Path, factor: float, said: str
) -> None:
    done = run(recorded(tmp_path, {2: factor}), tmp_path / "out")
    (finding,) = done.result["findings"]
    assert done.result["verdict"] == "missing-physics"
    assert (finding["physics"], finding["location"]["nodes"]) == ("support_stiffness", [9])
    assert finding["parameters"]["k"]["value"] == pytest.approx(3e3, rel=0.1)
    assert done.result["advice"].startswith(f"7:+Z was left out: the sensor 7:+Z {said}")
    (row,) = done.result["corrections"]
    assert row["channels"] == ["7:+Z"]
    assert row["left_out"]
    assert row["corrected"] < 0.1 < 1.5 < row["error"]
    # what holds the inputs alone is predicted at every sensor, what is compared at those that count
    predicted = {name: read_uff(tmp_path / f"out/predictions/final/{name}.uff").functions for name in ("held", "asked")}
    assert [len(predicted[name]) for name in ("held", "asked")] == [3, 4]


@pytest.mark.parametrize(
    ("factors", "factor"), [({0: 1 / 4.44822}, 4.44822), (dict.fromkeys(range(1, 5), 1000.0), 1000.0)]
)
def test_units_of_all_responses_or_the_force_are_corrected_before_anything_is_looked_for(
    tmp_path: Path, factors: dict[int, float], factor: float
) -> None:
    result = run(recorded(tmp_path, factors)).result
    assert (result["verdict"], result["findings"]) == ("undetermined", [])
    assert result["advice"].startswith("first correct the recordings: the responses, or the force, are off by a factor")
    (row,) = result["corrections"]
    assert row["factor"] == pytest.approx(factor)
    assert not row["left_out"]
    # errors and parameters are those of the corrected recordings
    assert all(line["parameters"] < 0.05 for line in result["fit"])
    assert headline(result).startswith("The recordings have to be corrected")


@pytest.mark.parametrize("factor", [-1.0, 1000.0])
def test_one_of_two_sensors_is_corrected_before_anything_is_looked_for(tmp_path: Path, factor: float) -> None:
    path = recorded(tmp_path, {2: factor})
    for name in small_study.LEVELS:
        functions = read_uff(tmp_path / f"{name}.uff").functions
        write_uff(tmp_path / f"{name}.uff", [f for i, f in enumerate(functions) if i in (0, 2, 4)])
    result = run(path).result
    assert (result["verdict"], result["findings"]) == ("undetermined", [])
    (row,) = result["corrections"]
    assert (row["channels"], row["factor"], row["left_out"]) == (["7:+Z"], factor, False)


def test_sound_recordings_have_no_corrections_and_a_force_reversed_is_a_finding(tmp_path: Path) -> None:
    assert "corrections" not in run(recorded(tmp_path / "a", {}, ())).result
    result = run(recorded(tmp_path / "b", {0: -1.0}, ())).result
    assert (result["verdict"], result["findings"][0]["physics"]) == ("missing-physics", "load_misplaced")
    assert "corrections" not in result


def noisy(folder: Path, level: float, share: float) -> tuple[list[Doubted], Corrections]:
    """What is doubted and corrected where the sensor at node 7 shows a `share` of its motion, and noise of `level`
    times that."""
    rng = np.random.default_rng(7)
    study = load_study(small_study.write_study(folder, small_study.Truth(E=E_TRUE, more=SPRING)))
    for name in small_study.LEVELS:
        functions = list(read_uff(folder / f"{name}.uff").functions)
        if len(functions) < 3:
            continue  # the force alone, to be predicted
        y = np.real(functions[2].y)
        functions[2] = replace(functions[2], y=share * y + level * float(y.std()) * rng.standard_normal(y.size))
        write_uff(folder / f"{name}.uff", functions)
    model, test = read_model(study.model_file, parameters=study.parameters), study.read_recordings()
    pairing = pair_test(test, model)
    found = list(doubts_found(model, test, pairing, study.damping_ratio).of_recordings)
    return found, corrections_of(model, pairing, study.damping_ratio, test, found)


def test_a_sensor_that_shows_noise_alone_is_left_out(tmp_path: Path) -> None:
    found, right = noisy(tmp_path, 1e-3, 0.0)
    assert [(one.doubt.kind, one.doubt.channel) for one in found] == [("silent", "7:+Z")]
    assert right.left_out == ("7:+Z",)
    assert right.advice.startswith("7:+Z was left out: the sensor 7:+Z shows nothing of what the forces do")
    assert all("7:+Z" not in {str(c.dof) for c in r.sensors} for r in right.test)


def test_a_noisy_sensor_stays_since_its_noise_weighs_it(tmp_path: Path) -> None:
    found, right = noisy(tmp_path, 1.0, 1.0)
    assert not [one for one in found if one.doubt.kind == "silent"]
    assert right.left_out == ()


def judged(folder: Path, change: Callable[[Doubted], Doubted], more: tuple[str, ...] = SPRING) -> object:
    """What is corrected of a sensor upside down, of which the doubt is changed on the way."""
    study = load_study(recorded(folder, {2: -1.0}, more))
    model, test = read_model(study.model_file, parameters=study.parameters), study.read_recordings()
    pairing = pair_test(test, model)
    found = doubts_found(model, test, pairing, study.damping_ratio).of_recordings
    return corrections_of(model, pairing, study.damping_ratio, test, [change(one) for one in found])


@pytest.mark.parametrize(
    ("node", "law", "size"),
    [
        # at the shaker: all responses are 0.22 and 0.001 times the model's, as lbf, and mm, for N and m would have them
        (13, "support_stiffness", 1.0e5),
        (13, "viscous_damper", 3.0e4),
        # between sensors, one of which shows 2.7 times what it would
        (6, "viscous_damper", 3.0e3),
    ],
)
def test_what_is_missing_is_no_mistake_in_units(tmp_path: Path, node: int, law: str, size: float) -> None:
    key = {"support_stiffness": "k", "viscous_damper": "c"}[law]
    study = load_study(small_study.write_study(tmp_path, small_study.Truth(E_TRUE, laws=[(node, law, {key: size})])))
    model = read_model(study.model_file, parameters=list(small_study.PARAMETERS))
    test = study.read_recordings()
    pairs = pair_test(test, model)
    doubts = doubts_found(model, test, pairs, 0.01).of_recordings
    assert doubts
    found = corrections_of(model, pairs, 0.01, test, doubts)
    assert found.advice == ""
    assert found.left_out == ()


def test_a_doubt_that_its_correction_does_not_cure_leaves_the_recordings_as_they_are(tmp_path: Path) -> None:
    def other(one: Doubted) -> Doubted:
        return replace(one, doubt=replace(one.doubt, channel="10:+Z"))

    right = judged(tmp_path, other)
    assert right.single == right.whole == ()  # type: ignore[attr-defined]
    assert all(len(r.sensors) in (0, 4) for r in right.test)  # type: ignore[attr-defined]


def test_the_shapes_alone_leave_out_as_long_as_half_of_the_sensors_stay(tmp_path: Path) -> None:
    test = load_study(small_study.write_study(tmp_path, small_study.Truth())).read_recordings()
    doubts = [Doubted(Doubt("sensor sign", f"{n}:+Z", "", -1.0), ("low", "high")) for n in small_study.SENSORS]
    assert left_out_unseen(test, doubts[:2]).left_out == ("4:+Z", "7:+Z")
    assert left_out_unseen(test, doubts[:3]).left_out == ()
    assert left_out_unseen(test, doubts[:1]).advice.startswith("4:+Z was left out: the sensor 4:+Z is reversed")


def test_mistakes_are_taken_out_of_time_records_and_channels_come_back_to_their_places(tmp_path: Path) -> None:
    test = load_study(small_study.write_study(tmp_path, small_study.Truth())).read_recordings()
    low = next(r for r in test if r.name == "low")
    moved = mended(test, [Doubted(Doubt("exchanged", "", "", order=("4:+Z", "7:+Z", "10:+Z")), ("low", "high"))])
    values = next(r for r in moved if r.name == "low").time.values
    # the first shows what belongs to the second, the last what belongs to the first
    np.testing.assert_array_equal(values, low.time.values[[0, 3, 1, 2, 4]])
    held = mended(test, [Doubted(Doubt("level", "", "", 10.0), ("low", "high"))])
    for name, factor in (("low", 10.0), ("held", 10.0)):
        own, before = (next(r for r in t if r.name == name).time.values for t in (held, test))
        np.testing.assert_allclose(own[1:] * factor, before[1:])
        np.testing.assert_array_equal(own[0], before[0])
    assert [str(c.dof) for c in next(iter(without(test, ["7:+Z"]))).sensors] == ["4:+Z", "10:+Z", "13:+Z"]


def test_the_factor_that_is_suggested_is_that_of_units_where_one_comes_near() -> None:
    assert suggested(1050.0) == 1000.0
    assert suggested(1 / 4.2) == pytest.approx(1 / 4.44822)
    assert suggested(1e8) is None
