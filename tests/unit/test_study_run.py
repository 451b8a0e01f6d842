"""A small study from end to end: what is found, what is written, and that held-out recordings have no say."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femend import functions_of, load_study, read_recording, write_uff
from femend.diagnose.naming.calibration import CALIBRATION
from femend.model import read_model
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose
from femend.study.shown.tables import laws

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

E = (7.3e10, 6.8e10)
STIFFNESS = 3e4
SPRING = small_study.Truth(E, (f"CELAS2,900,{STIFFNESS},7,3",))
VERDICTS = {"consistent", "parameters-only", "missing-physics", "located-not-named", "undetermined"}


@dataclass
class Done:
    run: StudyRun
    folder: Path
    out: Path
    seconds: float

    @property
    def result(self) -> dict[str, Any]:
        return json.loads((self.out / "result.json").read_text(encoding="utf-8"))


def finished(folder: Path, truth: small_study.Truth) -> Done:
    study = small_study.write_study(folder, truth)
    start = time.perf_counter()
    run = diagnose(study, folder / "out")
    return Done(run, folder, folder / "out", time.perf_counter() - start)


@pytest.fixture(scope="module")
def control(tmp_path_factory: pytest.TempPathFactory) -> Done:
    return finished(tmp_path_factory.mktemp("control"), small_study.Truth(E))


@pytest.fixture(scope="module")
def spring(tmp_path_factory: pytest.TempPathFactory) -> Done:
    return finished(tmp_path_factory.mktemp("spring"), SPRING)


def test_a_control_is_silent(control: Done) -> None:
    assert control.result["verdict"] == "parameters-only"
    assert control.result["findings"] == []
    for name, true in zip(("E_root", "E_tip"), E, strict=True):
        found = control.result["parameters"][name]
        assert abs(found["factor"] - true / 7e10) < 4 * found["sd"] + 0.005
    assert control.seconds < 20


def test_a_spring_to_ground_is_found_and_named(spring: Done) -> None:
    assert spring.result["verdict"] == "missing-physics"
    (finding,) = spring.result["findings"]
    assert finding["physics"] == "support_stiffness"
    assert finding["location"]["nodes"] == [7]
    assert (finding["location"]["to"], finding["location"]["direction"]) == ("ground", "Z")
    k = finding["parameters"]["k"]
    assert k["unit"] == "N/m"
    assert abs(k["value"] - STIFFNESS) < 4 * k["sd"]
    # never surer than what the rest of a model is off by
    assert 0.05 * STIFFNESS < k["sd"] < 0.1 * STIFFNESS
    assert spring.seconds < 20


def test_the_result_follows_the_contract(control: Done, spring: Done) -> None:
    for done in (control, spring):
        result = done.result
        keys = ["format", "verdict", "findings", "parameters", "fit", "status", "advice", "warnings"]
        assert list(result) == keys
        (untold,) = result["warnings"]  # two levels of random force
        assert untold.startswith("no recording repeats itself")
        assert result["format"] == "femend-diagnosis/1"
        assert result["verdict"] in VERDICTS
        assert set(result["parameters"]) == {"E_root", "E_tip"}
        assert all(set(p) == {"factor", "sd"} for p in result["parameters"].values())
        assert [(r["recording"], r["role"]) for r in result["fit"]] == [
            ("low", "fit"),
            ("high", "fit"),
            ("held", "validate"),
        ]
        wanted = {"recording", "role", "noise_floor", "nominal", "parameters", "final"}
        assert all(set(r) == wanted for r in result["fit"])
        for finding in result["findings"]:
            assert set(finding) == {
                *("physics", "probability", "location", "parameters", "alternatives", "configurations"),
            }
            assert set(finding["location"]) == {"nodes", "to", "direction", "also_possible"}
            assert 0 < finding["probability"] + sum(a["probability"] for a in finding["alternatives"]) <= 1.002


def test_the_final_model_predicts_what_it_has_not_seen(spring: Done) -> None:
    held = next(r for r in spring.result["fit"] if r["recording"] == "held")
    # the noise is one per cent of every channel; a hundredth above it is the most the fit may lose
    assert held["final"] < 0.02 < held["parameters"] < held["nominal"]
    asked = small_study.respond(
        spring.folder, SPRING, small_study.force(4.0, 13, int(small_study.RATE * small_study.SECONDS))
    )
    predicted = read_recording(spring.out / "predictions" / "final" / "asked.uff", excitation="unknown").data
    assert [str(c.dof) for c in predicted.channels] == ["4:+Z", "7:+Z", "10:+Z", "13:+Z"]
    assert np.sqrt(((predicted.values - asked) ** 2).sum() / (asked**2).sum()) < 0.02


def test_every_stage_of_the_held_out_recordings_is_written(spring: Done) -> None:
    written = sorted(str(p.relative_to(spring.out)) for p in (spring.out / "predictions").rglob("*.uff"))
    stages = ("final", "nominal", "parameters")
    assert written == [f"predictions/{stage}/{name}.uff" for stage in stages for name in ("asked", "held")]
    assert all((spring.out / name).is_file() for name in ("report.html", "run.json", "model.updated.bdf"))


def test_the_deck_changes_in_the_patched_fields_alone(spring: Done) -> None:
    before = (spring.folder / "model.bdf").read_text().splitlines()
    after = (spring.out / "model.updated.bdf").read_text().splitlines()
    added = [line for line in after if line not in before and not line.startswith("MAT1")]
    assert any(line.startswith("CELAS2") for line in added)
    assert all(line.startswith(("$ femend:", "CELAS2")) for line in added)
    kept = [line for line in after if line not in added]
    assert len(kept) == len(before)
    changed = [(a, b) for a, b in zip(before, kept, strict=True) if a != b]
    assert [a.split(",")[:2] for a, _ in changed] == [["MAT1", "1"], ["MAT1", "2"]]
    for a, b in changed:
        old, new = a.split(","), b.split(",")
        assert old[:2] + old[3:] == new[:2] + new[3:]
        factor = spring.result["parameters"]["E_root" if old[1] == "1" else "E_tip"]["factor"]
        mantissa, exponent = new[2].split("+")  # a Nastran real without its E
        assert float(mantissa) * 10 ** int(exponent) == pytest.approx(7e10 * factor, rel=1e-3)


def test_the_updated_deck_is_the_updated_model(spring: Done, tmp_path: Path) -> None:
    deck = tmp_path / "truth.bdf"
    deck.write_text(small_study.deck(SPRING.E, SPRING.more))
    truth = small_study.dense_modes(read_model(deck))[0]
    updated = small_study.dense_modes(read_model(spring.out / "model.updated.bdf"))[0]
    assert np.abs(updated[:4] / truth[:4] - 1).max() < 0.01


def test_held_out_responses_have_no_influence(spring: Done, tmp_path: Path) -> None:
    """Other responses in the validate recording change its own score and nothing else."""
    for name in ("model.bdf", "low.uff", "high.uff", "asked.uff", "study.toml"):
        (tmp_path / name).write_bytes((spring.folder / name).read_bytes())
    data = read_recording(spring.folder / "held.uff").data
    values = data.values.copy()
    values[1:] = np.random.default_rng(0).standard_normal(values[1:].shape)
    changed = type(data)(data.name, data.dt, values, data.channels)
    write_uff(tmp_path / "held.uff", functions_of(changed))
    diagnose(tmp_path / "study.toml", tmp_path / "out")
    after = json.loads((tmp_path / "out" / "result.json").read_text())
    before = spring.result
    scores = [result.pop("fit") for result in (before, after)]
    assert after == before
    assert scores[0][:2] == scores[1][:2]
    assert scores[1][2]["final"] > 10 * scores[0][2]["final"]


def test_the_same_study_gives_the_same_result(control: Done, tmp_path: Path) -> None:
    run = diagnose(control.folder / "study.toml")
    assert json.loads(json.dumps(run.result)) == control.result
    assert load_study(control.folder / "study.toml").title == "cantilever"


def test_the_table_of_laws_adds_up_to_what_is_told(spring: Done) -> None:
    told = spring.result["findings"][0]["probability"]
    rows = laws(spring.run.diagnosis)
    (chosen,) = [row for row in rows if row.chosen]
    # laws that come out as the same, and the same law at other places (a bedding is a spring too)
    like = [r for r in rows if not r.chosen and ("for which it counts" in r.remark or r.physics == chosen.physics)]
    assert chosen.probability is not None
    total = chosen.probability + sum(row.probability or 0.0 for row in like)
    assert total == pytest.approx(told, abs=0.02)
    assert (f"{100 * told:.0f} % with the laws that come out as the same" in chosen.remark) == bool(like)
    # what the calibration leaves is for what was not tried, not for the one row that lost most
    *_, none, untried = rows
    assert none.physics == "none"
    assert none.probability is not None
    assert none.probability < 0.01
    assert untried.probability == pytest.approx(1 - CALIBRATION.surest)
    assert sum(row.probability or 0.0 for row in rows) <= 1 + 1e-9
    assert untried.misfit_choose is None
    page = (spring.out / "report.html").read_text(encoding="utf-8")
    at = page.index("something that was not tried")
    assert "nan" not in page[at : at + 200]
    assert "names told on generated cases" in page[at : at + 400]
