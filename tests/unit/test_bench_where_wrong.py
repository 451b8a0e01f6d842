"""`femend correlate` says where the deck contradicts the shapes, and which of the study's parameters could mend it."""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from femend import correlate_study, functions_of, write_uff
from femend.bench import CorrelationRun
from femend.errors import ExpansionError
from femend.io import UniversalFile

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import RECORDINGS, SENSORS, TRUE_E, measured_frf, write_study
from small_study import deck


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("wrong")


@pytest.fixture(scope="module")
def run(folder: Path) -> CorrelationRun:
    return correlate_study(write_study(folder), folder / "out")


def test_the_parameter_that_is_off_ranks_first(run: CorrelationRun) -> None:
    """E_root is 10 % too low, E_tip 6 % too high, which the shapes hardly see."""
    found = run.result["recordings"][0]["where_wrong"]
    first, second = found["parameters"]
    assert (first["parameter"], second["parameter"]) == ("E_root", "E_tip")
    assert first["change"] == pytest.approx(TRUE_E[0] / 7e10 - 1, abs=3 * first["sd"])
    assert first["change"] > 3 * first["sd"]
    assert [one["parameter"] for one in found["together"]] == ["E_root"]
    assert found["modes"] == [1, 2, 3]
    assert found["regions"]["property 1"] > 0.8
    assert sum(one["share"] for one in found["elements"]) == pytest.approx(1.0)


def test_what_is_held_out_says_nothing_of_the_deck(run: CorrelationRun) -> None:
    assert [r["role"] for r in run.result["recordings"]] == ["fit", "validate"]
    assert run.result["recordings"][1]["where_wrong"] is None
    assert run.wrong[1] is None


def test_page_tables_and_terminal_have_it(run: CorrelationRun, folder: Path) -> None:
    page = (folder / "out" / "correlation.html").read_text()
    assert "tip: where the deck is wrong" in page
    assert "energy of what the equations of motion lack, on the mesh" in page
    with (folder / "out" / "correlation.parameters.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(r["recording"], r["parameter"]) for r in rows] == [("tip", "E_root"), ("tip", "E_tip")]
    with (folder / "out" / "correlation.elements.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 12
    said = run.result["recordings"][0]["where_wrong"]["said"]
    assert said in repr(run)
    assert "E_root +" in said
    assert "% of the misfit (a linear step" in said


def test_a_deck_that_is_right_is_told_so(tmp_path: Path) -> None:
    path = write_study(tmp_path, RECORDINGS[:1])
    (tmp_path / "model.bdf").write_text(deck(TRUE_E))
    found = correlate_study(path).result["recordings"][0]["where_wrong"]
    assert found["why_not"] == "the deck meets the shapes within their deviations"
    assert "elements" not in found


def test_shapes_that_cannot_be_expanded_leave_the_rest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise ExpansionError("no way")

    monkeypatch.setattr("femend.bench.correlation.where_wrong.expand_residual", refuse)
    found = correlate_study(write_study(tmp_path, RECORDINGS[:1]), tmp_path / "out")
    assert found.result["recordings"][0]["where_wrong"]["why_not"] == "no way"
    assert "Where the deck is wrong is not told: no way." in (tmp_path / "out" / "correlation.html").read_text()
    assert found.result["recordings"][0]["summary"]["paired"] == 3


def test_a_mistaken_sensor_says_nothing_of_the_deck(run: CorrelationRun, tmp_path: Path) -> None:
    """One that shows g among m/s^2 is left out, and told once."""
    path = write_study(tmp_path, RECORDINGS[:1])
    frf = measured_frf(tmp_path, RECORDINGS[0])
    H = frf.H.copy()
    H[:, SENSORS.index(9)] /= 9.80665
    spoilt = replace(frf, H=H)
    write_uff(tmp_path / "tip.uff", UniversalFile("tip", functions=tuple(functions_of(spoilt))))
    told = correlate_study(path)
    found = told.result["recordings"][0]["where_wrong"]
    assert found["sensors_left_out"] == ["9:+Z"]
    assert "The shapes without 9:+Z speak of" in found["said"]
    first = found["parameters"][0]
    assert first["parameter"] == "E_root"
    assert first["change"] == pytest.approx(TRUE_E[0] / 7e10 - 1, abs=3 * first["sd"])
    assert sum("9:+Z shows 0.102 times" in text for text in told.result["warnings"]) == 1
