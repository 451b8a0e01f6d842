"""`femend demo` as a user runs it: the bundled study through the command line, down to the files of the contract."""

from __future__ import annotations

import html.parser
import json
import math
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femend.demo import STUDY, responses
from femend.report.words import verdict_name

pytestmark = pytest.mark.slow

VERDICTS = {"consistent", "parameters-only", "missing-physics", "located-not-named", "undetermined"}
STAGES = ("nominal", "parameters", "final")


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The demo's folder and what it said."""
    out = tmp_path_factory.mktemp("demo") / "out"
    command = [sys.executable, "-m", "femend", "demo", "--out", str(out), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False)
    assert done.returncode == 0, done.stderr
    return out, done.stdout


@pytest.fixture(scope="module")
def result(demo: tuple[Path, str]) -> dict[str, Any]:
    """result.json of the demo."""
    found: dict[str, Any] = json.loads((demo[0] / "result.json").read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def study() -> dict[str, Any]:
    """study.toml of the demo."""
    return tomllib.loads(STUDY.read_text(encoding="utf-8"))


def test_says_the_verdict_and_where_the_report_is(demo: tuple[Path, str], result: dict[str, Any]) -> None:
    out, said = demo
    assert str(out / "report.html") in said
    assert result["verdict"] in VERDICTS
    for finding in result["findings"]:
        assert all(str(node) in said for node in finding["location"]["nodes"])


def test_result_has_the_keys_of_the_contract(result: dict[str, Any], study: dict[str, Any]) -> None:
    assert {"format", "verdict", "findings", "parameters", "fit", "status", "advice"} <= result.keys()
    assert result["format"] == "femend-diagnosis/1"
    assert set(result["parameters"]) == {p["name"] for p in study["parameter"]}
    for parameter in result["parameters"].values():
        assert parameter["factor"] > 0
        assert parameter["sd"] >= 0
    fitted = {row["recording"] for row in result["fit"]}
    assert {r["name"] for r in study["recording"] if r["role"] == "fit"} <= fitted
    for row in result["fit"]:
        assert {"recording", "role", "noise_floor", *STAGES} <= row.keys()
    nominal, parameters, final = (np.mean([row[s] for row in result["fit"]]) for s in STAGES)
    assert parameters < nominal
    assert final <= 1.05 * parameters
    named = result["verdict"] in ("missing-physics", "located-not-named")
    assert bool(result["findings"]) == named
    for finding in result["findings"]:
        assert {"physics", "probability", "location", "parameters", "alternatives"} <= finding.keys()
        assert {"nodes", "to", "direction", "also_possible"} <= finding["location"].keys()


def test_predicts_every_recording_that_is_to_be_predicted(demo: tuple[Path, str], study: dict[str, Any]) -> None:
    for recording in (r for r in study["recording"] if r["role"] == "predict"):
        for stage in STAGES:
            found = responses(demo[0] / "predictions" / stage / recording["file"])
            assert found, f"{stage} of {recording['name']} holds no response"
            assert all(np.isfinite(y).all() and y.any() for y in found.values())


def test_the_updated_deck_can_be_read_and_is_changed(demo: tuple[Path, str], study: dict[str, Any]) -> None:
    from femend.model import read_model

    given, updated = STUDY.parent / study["model"]["file"], demo[0] / "model.updated.bdf"
    assert updated.read_bytes() != given.read_bytes()
    before, after = (read_model(path, units=study["model"]["units"]) for path in (given, updated))
    assert set(before.node_ids.tolist()) <= set(after.node_ids.tolist())
    assert not np.array_equal(before.matrices()[0].data[:20], after.matrices()[0].data[:20])


def test_run_is_recorded(demo: tuple[Path, str]) -> None:
    run = json.loads((demo[0] / "run.json").read_text(encoding="utf-8"))
    assert run["seed"] == 0
    assert run["versions"]["femend"]
    assert math.isfinite(run["seconds"])
    assert {s["name"] for s in run["steps"]} >= {"diagnose", "predict"}


class _Page(html.parser.HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.headings: list[str] = []
        self._in_heading = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [v or "" for k, v in attrs if k in ("src", "href", "srcset", "data", "action")]
        self._in_heading = tag == "h2"

    def handle_data(self, data: str) -> None:
        if self._in_heading:
            self.headings.append(data)
            self._in_heading = False


def test_report_is_whole_and_needs_nothing_from_elsewhere(demo: tuple[Path, str], result: dict[str, Any]) -> None:
    text = (demo[0] / "report.html").read_text(encoding="utf-8")
    assert len(text) < 2_000_000
    page = _Page()
    page.feed(text)
    assert all(link.startswith(("#", "data:")) for link in page.links)
    assert "url(http" not in text
    assert "@import" not in text
    assert "fetch(" not in text
    wanted = {"Before and after", "Parameters of the model", "What was asked of the data", "How it was computed"}
    assert wanted <= set(page.headings)
    assert any(h.startswith("The model") for h in page.headings)
    assert verdict_name(result["verdict"]) in text
    for name in ("Frequency response", "Time traces", *(r["recording"] for r in result["fit"])):
        assert name in text
