"""`femend pretest`: a plan from a study without recordings, what it would tell, and what cannot be planned."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Dof, pretest_study
from femend.bench import PretestRun
from femend.bench.planning.pretest_result import _misled
from femend.cli import main
from femend.correlate import automac
from femend.errors import PretestError, StudyError
from femend.pretest import effective_independence

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

PLAN = """[pretest]
band = [5.0, 600.0]
sensors = 5
directions = ["Z"]
placed = ["13:-Z"]
leave_out = [2]
sensor_mass = 0.005
"""


def study(folder: Path, tables: str = PLAN, parameters: bool = True) -> Path:
    """A study of the cantilever without any recording."""
    return small_study.write_unrecorded(folder, tables, small_study.PARAMETERS if parameters else ())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pretest")


@pytest.fixture(scope="module")
def run(folder: Path) -> PretestRun:
    return pretest_study(study(folder), folder / "out")


def test_the_plan_is_that_of_the_functions(run: PretestRun) -> None:
    plan = run.plan
    assert len(plan.targets.at) == 4
    np.testing.assert_allclose(plan.targets.freq, [16.78, 96.70, 257.8, 552.8], rtol=1e-3)
    # all nodes along Z but the clamp and node 2, the placed one first
    assert plan.places == (Dof(13, 3, -1), *(Dof(n, 3) for n in range(3, 13)))
    phi = plan.targets.shapes(plan.places)
    again = effective_independence(phi, 5, placed=[0])
    assert plan.sensors == again.dofs(plan.places)
    assert Dof(13, 3, -1) in plan.sensors
    off = automac(phi[plan.placement.rows]) - np.eye(4)
    assert run.result["largest_off_diagonal"] == pytest.approx(float(off.max()))
    assert plan.exciters == (Dof(13, 3),)  # the tip moves most in every mode of a cantilever


def test_what_the_test_would_tell_is_right_in_the_rehearsal(run: PretestRun) -> None:
    forecast = {p["name"]: p for p in run.result["forecast"]["parameters"]}
    assert all(p["determined"] for p in forecast.values())
    v = run.result["virtual_test"]
    assert (v["found"], v["missed"]) == (4, [])
    for p in v["parameters"]:
        assert p["within_three_sd"]
        # the rehearsal identifies frequencies better than the 0.2 % that were planned with
        assert abs(p["found"] - p["truth"]) < forecast[p["name"]]["expected_sd"]


def test_sensors_that_weigh_are_told(run: PretestRun) -> None:
    shift = run.result["mass_loading"]["shift"]
    assert all(-0.06 < x < -0.01 for x in shift)
    assert "the sensors' mass moves mode 1, 2, 3, 4" in run.result["advice"]


def test_what_is_written(run: PretestRun, folder: Path) -> None:
    out = folder / "out"
    result = json.loads((out / "pretest.json").read_text())
    assert result["format"] == "femend-pretest/1"
    assert result["targets"][0]["effective_mass"][2] == pytest.approx(0.644, abs=0.002)
    assert set(result["methods"]) == {"effective independence", "parameters", "QR", "MAC"}
    with (out / "pretest.sensors.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert (rows[0]["node"], rows[0]["direction"], rows[0]["state"]) == ("13", "-Z", "placed")
    assert float(rows[0]["x"]) == pytest.approx(0.72)
    assert "the virtual test finds 4 of 4" in (out / "pretest.html").read_text()
    assert {p.name for p in out.iterdir()} == {
        "pretest.json", "pretest.html", "pretest.run.json", "pretest.sensors.csv", "pretest.exciters.csv",
        "pretest.modes.csv",
    }  # fmt: skip


def test_directions_of_turned_nodes_are_given_in_basic_axes(tmp_path: Path) -> None:
    """Node 13 has displacement axes turned by 30 degrees about Y: who mounts its sensor has to know where +Z points."""
    path = study(tmp_path, PLAN + "virtual_test = false\n", parameters=False)
    deck = (tmp_path / "model.bdf").read_text()
    turned = "CORD2R,9,,0.,0.,0.,0.5,0.,0.8660254\n,0.8660254,0.,-0.5\n"
    (tmp_path / "model.bdf").write_text(deck.replace("GRID,13,,0.720,0.,0.", f"{turned}GRID,13,,0.720,0.,0.,9"))
    result = pretest_study(path, tmp_path / "out").result
    by_dof = {s["dof"]: s["basic"] for s in result["sensors"]}
    np.testing.assert_allclose(by_dof.pop("13:-Z"), [-0.5, 0, -np.sqrt(0.75)], atol=1e-6)
    assert all(basic == [0, 0, 1] for basic in by_dof.values())
    (told,) = [w for w in result["warnings"] if "displacement system 9 (CD)" in w]
    assert "in basic axes 13:-Z is (-0.5, 0, -0.866)" in told
    with (tmp_path / "out" / "pretest.sensors.csv").open() as file:
        assert float(next(csv.DictReader(file))["basic X"]) == pytest.approx(-0.5, abs=1e-6)


def test_nothing_is_told_of_basic_axes(run: PretestRun) -> None:
    assert not any("displacement" in w for w in run.result["warnings"])


def test_the_command_says_it(folder: Path, run: PretestRun, tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["pretest", str(folder), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert "sensors   13:-Z*" in done.output
    assert "virtual test: 4 of 4 modes found" in done.output
    assert "rehearse the test:" in done.stderr


@pytest.mark.parametrize("method", ["parameters", "QR", "MAC", "Guyan", "effective independence"])
def test_every_method_keeps_what_is_placed(tmp_path: Path, method: str) -> None:
    run = pretest_study(study(tmp_path, PLAN + f'method = "{method}"\nvirtual_test = false\n'))
    assert len(run.plan.sensors) == 5
    assert Dof(13, 3, -1) in run.plan.sensors
    assert run.virtual is None
    assert run.result["virtual_test"] == {"note": "not asked for"}


def test_without_parameters_and_without_a_table(tmp_path: Path) -> None:
    run = pretest_study(study(tmp_path, "", parameters=False))
    assert [t["mode"] for t in run.result["targets"]] == [1, 2, 3, 4, 5, 6, 7, 8]
    assert len(run.plan.sensors) == 8
    assert "forecast" not in run.result
    assert run.result["virtual_test"]["note"] == "there is no [[parameter]] that could be found again"


def test_a_free_structure_is_numbered_from_its_first_elastic_mode(tmp_path: Path) -> None:
    path = study(tmp_path, "[pretest]\nmodes = [1, 2]\nsensors = 4\n")
    (tmp_path / "model.bdf").write_text(small_study.deck().replace("SPC1,1,123456,1", "SPC1,1,246,1"))
    run = pretest_study(path)
    assert run.plan.targets.rigid == 3
    assert [t["mode"] for t in run.result["targets"]] == [1, 2]
    assert run.plan.targets.freq[0] > 50.0
    assert len(run.result["suspension"]) == 4


def test_many_places_are_thinned_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from femend.bench.planning import places

    monkeypatch.setattr(places, "MOST", 10)
    monkeypatch.setattr(places, "KEPT", 8)
    run = pretest_study(study(tmp_path, PLAN + "virtual_test = false\n"))
    assert len(run.plan.places) == 8
    assert run.plan.places[0] == Dof(13, 3, -1)
    assert run.result["warnings"][0].startswith("11 places are thinned out to 8, spread over the structure")


def test_sensors_keep_their_distance(tmp_path: Path) -> None:
    run = pretest_study(study(tmp_path, PLAN.replace("sensors = 5", "sensors = 4") + "spacing = 0.12\n"))
    nodes = [d.node for d in run.plan.places]
    # from the placed tip to the root, then half way and half way again: 0.06 m a node, two nodes at least
    assert sorted(nodes) == [3, 5, 8, 10, 13]
    assert "11 places are thinned out to 5, 0.12 apart" in run.result["warnings"]
    assert len(run.plan.drives) == 11
    near = pretest_study(study(tmp_path, PLAN + "spacing = 0.01\nvirtual_test = false\n"))
    assert not any("thinned out" in w for w in near.result["warnings"])


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            "band = [20.0, 50.0]",
            r"\[pretest\] band: the model has no mode from 20 to 50 Hz; the first elastic one is at 16",
        ),
        ("modes = [1, 400]", r"\[pretest\] modes: mode 400 is wanted, the model has \d+ elastic modes"),
        ("nodes = [3, 77]", r"\[pretest\] nodes: the model has no node 77 \(nearest ids 7, 13\); give"),
        ('placed = ["77:+Z"]', r"\[pretest\] placed: the model has no node 77"),
        ('placed = ["1:+Z"]', r"\[pretest\] placed: 1:\+Z stands still in all target modes"),
        ("nodes = [1]", r"\[pretest\] nodes: none of the 3 allowed places moves in the target modes"),
        ("nodes = [4]", r"\[pretest\] sensors = 8 are wanted, and there are \d places for them: take fewer"),
        (
            "spacing = 50.0",
            r"there are \d places for them \(\d+ places are thinned out to \d, 50 apart\): .* less spacing",
        ),
        ('method = "effective independence"\nsensors = 2', r"2 sensors cannot tell 8 target modes apart"),
        ("exciter_nodes = [99]", r"\[pretest\] exciter_nodes: the model has no node 99"),
    ],
)
def test_what_cannot_be_planned(tmp_path: Path, table: str, message: str) -> None:
    with pytest.raises(PretestError, match=message):
        pretest_study(study(tmp_path, f"[pretest]\n{table}\n"), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_few_sensors_are_placed_by_qr_which_is_told(tmp_path: Path) -> None:
    run = pretest_study(study(tmp_path, "[pretest]\nmodes = [1, 2, 3]\nsensors = 2\nvirtual_test = false\n"))
    assert run.result["method"] == "QR"
    (told,) = (w for w in run.result["warnings"] if "QR" in w)
    assert told.startswith("[pretest] sensors = 2 are fewer than the 3 target modes")
    assert "take 3 sensors or more, or fewer target modes" in told
    asked = study(tmp_path, '[pretest]\nmodes = [1, 2, 3]\nsensors = 2\nmethod = "QR"\nvirtual_test = false\n')
    assert not any("QR" in w for w in pretest_study(asked).result["warnings"])


def test_parameters_are_needed_to_plan_for_them(tmp_path: Path) -> None:
    path = study(tmp_path, '[pretest]\nmethod = "parameters"\n', parameters=False)
    with pytest.raises(PretestError, match=r'method = "parameters", but the study has no \[\[parameter\]\]'):
        pretest_study(path)


def test_other_commands_still_want_recordings(tmp_path: Path) -> None:
    from femend import correlate_study

    with pytest.raises(StudyError, match="there is no \\[\\[recording\\]\\]"):
        correlate_study(study(tmp_path))


def test_a_target_mode_that_no_place_sees_is_named(tmp_path: Path) -> None:
    wide = PLAN.replace("600.0", "2500.0")  # holds the first mode along the bar, which nothing in Z shows
    said = r"no sensor can see target mode \d+ at \d+ Hz: .* allowed places \(directions Z\).*modes = \[1, 2, 3"
    with pytest.raises(PretestError, match=said):
        pretest_study(study(tmp_path, wide))


def test_a_rehearsal_that_ends_at_wrong_values_is_told() -> None:
    parameter = {"name": "m_lump", "truth": 0.5869, "found": 1.0354, "sd": 0.0017, "within_three_sd": False}
    found = {"largest_off_diagonal": 0.99, "virtual_test": {"parameters": [parameter]}}
    (said,) = _misled(found)
    assert said.startswith("an update from this test would come out wrong and not show it (m_lump 1.035 ± 0.0017 where")
    assert "modes that look alike" in said
    assert "starts too far off" in _misled({**found, "largest_off_diagonal": 0.1})[0]
    assert _misled({**found, "virtual_test": {"parameters": [{**parameter, "within_three_sd": True}]}}) == []
    assert _misled({**found, "virtual_test": {"note": "no mode was found"}}) == []
