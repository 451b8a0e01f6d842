"""The scorer: what counts as right, located, named and covered."""

from __future__ import annotations

import json
import pathlib

import pytest
import score_blind


def test_scoring(written: tuple[pathlib.Path, dict], tmp_path: pathlib.Path) -> None:
    """A silent answer to a control is right, a finding is a false positive; the Wilson bound of 0 of 42 is 8 %."""
    folder, _ = written
    (tmp_path / "result.json").write_text(json.dumps({"verdict": "parameters-only", "findings": []}))
    assert score_blind.score(tmp_path, folder)["named"]
    found = {"physics": "added_mass", "probability": 0.9, "location": {"nodes": [3]}}
    (tmp_path / "result.json").write_text(json.dumps({"verdict": "missing-physics", "findings": [found]}))
    row = score_blind.score(tmp_path, folder)
    assert not row["named"]
    assert row["said"] == "added_mass"
    assert score_blind.nrmse(folder / "sealed/random.uff", folder / "sealed/random.uff") == 0.0
    assert score_blind.nrmse(folder / "public/random.uff", folder / "sealed/random.uff") == 1.0
    assert score_blind.wilson(0, 42)[1] == pytest.approx(0.0838, abs=1e-3)
    place = {"nodes": [3], "node_xyz": {"1": [0, 0, 0], "3": [0.1, 0, 0], "4": [0.105, 0, 0], "9": [1, 0, 0]}}
    assert score_blind.near([4], place)
    assert not score_blind.near([9], place)
    assert not score_blind.near([1, 3, 4], place)


def test_scoring_of_outside_two_and_intervals(tmp_path: pathlib.Path) -> None:
    """Located but not named is right for a law outside; two findings are matched to two effects; intervals counted."""
    xyz = {"1": [0, 0, 0], "3": [0.5, 0, 0], "9": [1, 0, 0]}
    common = {"node_xyz": xyz, "family": "plate", "visibility_beyond_update": 3.0, "noise": 0.02}
    found = {"physics": "", "probability": 0.0, "location": {"nodes": [3]}}

    def judged(truth: dict, verdict: str, *findings: dict, **more: dict) -> dict:
        (tmp_path / "c/sealed").mkdir(parents=True, exist_ok=True)
        (tmp_path / "c/sealed/truth.json").write_text(json.dumps(common | truth))
        (tmp_path / "result.json").write_text(json.dumps({"verdict": verdict, "findings": findings, **more}))
        return score_blind.score(tmp_path, tmp_path / "c")

    outside = {"effect": "outside", "law": "wedge", "families": ["hysteretic", "damping"], "nodes": [3]}
    assert judged(outside, "located-not-named", found)["class_right"]
    assert judged(outside, "missing-physics", found | {"physics": "bouc_wen"})["class_right"]
    assert judged(outside, "missing-physics", found | {"physics": "added_mass"})["wrong"]
    assert not judged(outside, "parameters-only")["class_right"]
    two = {"effect": "two", "nodes": [3, 9]}
    two["effects"] = [{"effect": "added_mass", "nodes": [9]}, {"effect": "clearance", "nodes": [3]}]
    a = found | {"physics": "clearance"}
    b = {"physics": "added_mass", "probability": 0.9, "location": {"nodes": [9]}}
    row = judged(two, "missing-physics", a, b)
    assert row["located"]
    assert row["named"]
    row = judged(two, "missing-physics", a | {"physics": "cubic_stiffness"}, b)
    assert row["located"]
    assert not row["named"]
    assert row["one_named"]
    assert row["wrong"]
    one = {"effect": "clearance", "nodes": [3], "parameters": {"k": 100.0, "gap": 1.0}, "E_factor": {"a": 1.1}}
    told = {"k": {"value": 110.0, "sd": 5.0}, "gap": {"value": 1.01, "sd": 0.02}, "sides": {"value": 1, "sd": None}}
    row = judged(one, "missing-physics", a | {"parameters": told}, parameters={"E_a": {"factor": 1.09, "sd": 0.01}})
    assert row["covered_law"] == [False, True]
    assert row["covered_model"] == [True]
