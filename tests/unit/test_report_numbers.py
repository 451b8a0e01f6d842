"""Numbers and sentences of the report: digits, prefixes and units, places and physics in words."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femend.cli.summary import summary
from femend.report import words
from femend.report.content import ReportContent
from femend.report.headline import headline
from femend.report.numbers import factor_as_percent, pretty_unit, quantity, ratio, significant
from femend.report.page import render
from femend.report.runinfo import RunInfo
from femend.report.svg import Axes, decimate, log_ticks, nice_ticks


@pytest.mark.parametrize(
    ("value", "unit", "sd", "text"),
    [
        (5.4e4, "N/m", 2.0e3, "54 ± 2 kN/m"),
        (6.3e-4, "m", 2e-5, "0.63 ± 0.02 mm"),
        (6.3e-4, "m", 1.4e-5, "0.630 ± 0.014 mm"),
        (0.052, "kg", 0.003, "52 ± 3 g"),
        (3.2e9, "N/m^3", 1e8, "3.20 ± 0.10 GN/m³"),
        (12.3, "N*s/m", None, "12.3 N·s/m"),
        (54.0, "N/mm", 2.0, "54 ± 2 N/mm"),
        (0.0004, "t", None, "0.400 kg"),
        (2.0, "N", 5.0, "2.0 ± 5 N"),
        (1e-6, "m", None, "1.00 µm"),
        (-1500.0, "N/m", 100.0, "−1.50 ± 0.10 kN/m"),
        (0.0, "m", None, "0 m"),
        (0.02, "1", 0.001, "0.0200 ± 0.0010"),
        (math.nan, "N", 1.0, "not finite N"),
    ],
)
def test_quantities_keep_the_digits_their_scatter_supports(
    value: float, unit: str, sd: float | None, text: str
) -> None:
    assert quantity(value, unit, sd) == text


def test_small_numbers_of_the_page() -> None:
    assert [significant(v) for v in (1234567.0, 0.5, 99.95, 1e-9)] == ["1230000", "0.500", "100", "1.00×10⁻⁹"]
    assert [ratio(v) for v in (0.0, 0.996, 12.34, math.inf)] == ["0", "1.0", "12.3", "∞"]
    assert factor_as_percent(25.0) == "+2400 %"
    assert pretty_unit("(m/s^2)/N^-1") == "(m/s²)/N⁻¹"


@pytest.mark.parametrize(
    ("location", "text"),
    [
        ({"nodes": [4], "to": "ground", "direction": "Z"}, "at node 4 in Z, to ground"),
        ({"nodes": [4, 7], "direction": "X"}, "between nodes 4 and 7 in X"),
        ({"nodes": [4], "direction": "Z"}, "at node 4 in Z"),
        ({"nodes": [4], "to": 9, "direction": "Z"}, "at node 4 in Z, to node 9"),
        ({"nodes": list(range(1, 9)), "to": "ground"}, "at nodes 1, 2, 3, 4, 5, 6, …, to ground"),
        ({"nodes": [], "direction": "X"}, "in direction X"),
        ({"nodes": [5, 6], "direction": "R"}, "between nodes 5 and 6 in rotation"),
        ({"nodes": [5], "to": "ground", "region": [1, 2, 5, 6]}, "over 4 nodes around node 5"),
        ({}, "at no single place"),
    ],
)
def test_places_in_words(location: dict[str, Any], text: str) -> None:
    assert words.place_text(location) == text


def test_every_physics_and_family_of_the_contract_has_a_plain_name() -> None:
    names = [
        "support_stiffness",
        "compliant_support",
        "joint_stiffness",
        "spring_bending",
        "added_mass",
        "tuned_absorber",
        "viscous_damper",
        "structural_damping",
        "viscoelastic",
        "quadratic_damping",
        "cubic_stiffness",
        "clearance",
        "bilinear_stiffness",
        "coulomb_friction",
        "bouc_wen",
        "gyroscopic",
        "speed_stiffness",
        "unmeasured_force",
        "base_motion",
        "load_misplaced",
        "unbalance_law",
    ]
    plain = [words.physics_name(n) for n in [*names, "nonlinear elastic", "hysteretic", "inertia"]]
    assert len(set(plain)) == len(plain)
    assert not any("_" in p for p in plain)
    assert words.physics_name("clearance", {"sides": 2}) == "two-sided contact"


def test_parameters_by_axis_have_plain_names() -> None:
    per_area, total = {"value": 7e5, "unit": "N/m^3"}, {"value": 1.4e5, "unit": "N/m"}
    assert words.parameter_text("k_x", per_area, "compliant_support") == ("stiffness X per area", "700 kN/m³")
    assert words.parameter_text("c_z_total", total, "compliant_support")[0] == "damping Z in total"
    assert words.parameter_text("k_rot_y", {"value": 11.0, "unit": "N*m/rad"}, "spring_bending")[0] == (
        "rotational stiffness Y"
    )


def test_the_headline_of_a_law_with_many_parameters_says_its_stiffnesses() -> None:
    values = {
        f"{kind}_{a}{end}": {"value": 2.0, "unit": "N/m"} for kind in "kc" for a in "xyz" for end in ("", "_total")
    }
    location = {"nodes": [15, 16], "to": "ground", "region": list(range(1, 31)), "also_possible": [[1, 6, 25, 30]]}
    finding = {"physics": "compliant_support", "parameters": values, "location": location}
    said = headline({"verdict": "missing-physics", "findings": [finding]})
    assert said == (
        "Missing: compliant support (modelled as fixed) over 30 nodes around nodes 15–16, stiffness X 2.00 N/m, "
        "stiffness Y 2.00 N/m, stiffness Z 2.00 N/m."
    )
    two = headline({"verdict": "missing-physics", "findings": [finding, {**finding, "location": {"nodes": [3]}}]})
    assert two == (
        "Missing: compliant support (modelled as fixed) over 30 nodes around nodes 15–16; and compliant support "
        "(modelled as fixed) at node 3."
    )
    assert words.span_text(location) == "nodes 1–6–25–30"
    assert words.span_text({"nodes": [3], "also_possible": [[4]]}) == ""


def test_the_same_letter_is_another_parameter_in_another_law() -> None:
    stiffness = {"value": 2.0e5, "sd": 1e4, "unit": "N/m"}
    assert words.parameter_text("k3", stiffness, "compliant_support") == ("stiffness Z", "200 ± 10 kN/m")
    assert words.parameter_text("k3", {"value": 3e9, "unit": "N/m^3"}, "cubic_stiffness")[0] == "cubic stiffness"
    assert words.parameter_text("k1", stiffness, "viscoelastic")[0] == "relaxing stiffness"
    assert words.parameter_text("direction", {"value": "+X"}, "load_misplaced") == ("direction", "+X")
    assert words.parameter_text("sides", 2) == ("sides", "two")
    assert words.parameter_text("sides", {"value": 1}) == ("sides", "one")


def test_large_values_share_one_power_of_ten_with_their_deviation() -> None:
    beta = {"value": 1.21e7, "sd": 3.1e6, "unit": "1/m^n"}
    assert words.parameter_text("beta", beta)[1] == "(1.2 ± 0.3)×10⁷ 1/mⁿ"
    assert words.parameter_text("beta", beta, with_sd=False)[1] == "1.2×10⁷ 1/mⁿ"


def test_a_model_that_leaves_more_than_noise_is_not_said_to_explain_the_recordings() -> None:
    row = {"recording": "low", "role": "fit", "noise_floor": 0.02, "nominal": 1.2, "parameters": 0.06, "final": 0.06}
    result = {"verdict": "parameters-only", "findings": [], "fit": [row], "parameters": {"E": {"factor": 0.9}}}
    assert headline(result) == (
        "Nothing at one place is missing as far as these recordings tell, but the model once updated (E −10.0 %) "
        "leaves an error of 0.060 on low where noise is 0.020: its mesh or idealisation is off, or more than one thing "
        "is missing."
    )
    little = {**result, "fit": [{**row, "parameters": 0.025, "final": 0.025}]}
    assert headline(little).startswith("Nothing is missing: the model explains the recordings once updated")
    drifts = {**result, "fit": [{**row, "outside_band": 0.9}]}
    assert headline(drifts) == (
        "Nothing is missing in the band that the force excites: the model once updated (E −10.0 %) explains the "
        "recordings there; outside it low shows more than noise."
    )
    assert headline({**result, "fit": [{**row, "outside_band": 0.5}]}) == headline(result)


@pytest.mark.parametrize("verdict", ["consistent", "parameters-only"])
def test_an_unseen_recording_does_not_hide_what_the_fitted_ones_leave(verdict: str) -> None:
    """One held out has no noise floor: the worst of the fitted ones says whether the model explains them."""
    rows = [
        {"recording": "low", "role": "fit", "noise_floor": 0.05, "nominal": 1.2, "parameters": 0.06},
        {"recording": "high", "role": "fit", "noise_floor": 0.02, "nominal": 1.2, "parameters": 0.05},
        {"recording": "val", "role": "validate", "noise_floor": None, "nominal": 1.38, "parameters": 0.09},
    ]
    said = headline({"verdict": verdict, "findings": [], "fit": rows})
    assert said.startswith("Nothing at one place is missing as far as these recordings tell, but the model")
    assert "leaves an error of 0.050 on high where noise is 0.020" in said
    assert said.endswith("; prediction error on unseen recordings 1.38 → 0.09.")
    near = [{**row, "parameters": 0.025} for row in rows]
    assert headline({"verdict": verdict, "findings": [], "fit": near}).startswith("Nothing is missing: the model")


def test_a_place_without_a_name_is_most_likely_and_its_laws_have_no_percentage() -> None:
    finding = {
        "physics": "", "probability": 0.0, "parameters": {},
        "location": {"nodes": [34, 44], "to": "44", "direction": "", "also_possible": [[12]]},
        "alternatives": [{"physics": "tuned_absorber", "probability": 0.047}],
    }  # fmt: skip
    row = {"recording": "v", "role": "validate", "nominal": 1.08, "parameters": 0.04, "final": 0.04}
    result = {"verdict": "located-not-named", "findings": [finding], "fit": [row]}
    assert headline(result) == (
        "The model lacks something, most likely between nodes 34 and 44, but no law tried explains it well enough to "
        "be named; prediction error on unseen recordings 1.08 → 0.04 by updating its parameters."
    )
    alone = {**finding, "location": {"nodes": [34, 44], "direction": ""}}
    assert "most likely between" in headline({**result, "findings": [alone]})
    known = {**alone, "class": "hardening"}
    assert "lacks a force (hardening) between" in headline({**result, "findings": [known]})
    said = summary(result)
    assert "certainty no name: none of the laws tried explains it well enough" in said
    assert "nearest laws tried: attached oscillator (tuned absorber)\n" in said
    assert "among the hypotheses" not in said


def test_a_tentative_name_is_most_likely_missing() -> None:
    finding = {"physics": "added_mass", "probability": 0.4, "location": {"nodes": [6], "direction": "Z"}}
    said = headline({"verdict": "missing-physics", "findings": [finding]})
    assert said == "Most likely missing: added mass at node 6 in Z."
    named = words.considered_text({**finding, "alternatives": [{"physics": "clearance", "probability": 0.3}]})
    assert named == "also considered: contact with a gap (30 %)"


def test_a_name_that_another_is_likelier_than_is_possibly_missing() -> None:
    finding = {
        "physics": "added_mass", "probability": 0.37, "location": {"nodes": [6], "direction": "Z"},
        "alternatives": [{"physics": "tuned_absorber", "probability": 0.58}],
    }  # fmt: skip
    result = {"verdict": "missing-physics", "findings": [finding]}
    likelier = "attached oscillator (tuned absorber) (58 %)"
    assert headline(result) == f"Possibly missing: added mass at node 6 in Z, or {likelier}."
    assert f"also considered: {likelier}" in summary(result)
    less = {**finding, "alternatives": [{"physics": "tuned_absorber", "probability": 0.3}]}
    assert headline({**result, "findings": [less]}) == "Most likely missing: added mass at node 6 in Z."


def test_a_misplaced_force_without_its_record_says_where_it_acts() -> None:
    acts = {"node": {"value": 6}, "direction": {"value": "-Z"}}
    finding = {"physics": "load_misplaced", "parameters": acts, "location": {"nodes": [6], "direction": "Z"}}
    said = headline({"verdict": "missing-physics", "findings": [finding]})
    assert said == "The recorded force acts at node 6 in -Z."
    assert words.how_much(finding) == []


def test_the_headline_of_a_law_that_explains_most_says_so() -> None:
    finding = {
        "physics": "tuned_absorber", "location": {"kind": "ground", "nodes": [13], "direction": "Z"},
        "parameters": {"m": {"value": 0.11, "unit": "kg", "sd": 0.03}},
    }  # fmt: skip
    said = headline({"verdict": "located-not-named", "findings": [finding]})
    assert said.startswith("Likeliest missing: attached oscillator (tuned absorber) at node 13 in Z")
    assert said.endswith("though it does not explain all that is left.")
    other = {**finding, "physics": "cubic_stiffness", "location": {"kind": "ground", "nodes": [7], "direction": "X"}}
    both = [{**finding, "probability": 0.6}, {**other, "probability": 0.9}]
    said = headline({"verdict": "located-not-named", "findings": both})
    # the surest first
    assert said.index("at node 7 in X; and attached oscillator") > 0
    assert said.endswith("though together they do not explain all that is left.")
    unknown = headline({"verdict": "located-not-named", "findings": [{**finding, "parameters": {}}]})
    assert unknown.endswith("but no law tried explains it well enough to be named.")


def test_headline_takes_the_fit_error_where_nothing_was_held_out() -> None:
    result = {
        "verdict": "parameters-only",
        "parameters": {"E": {"factor": 0.9}},
        "fit": [{"recording": "a", "role": "fit", "nominal": 0.3, "parameters": 0.1}],
    }
    assert headline(result) == (
        "Nothing is missing: the model explains the recordings once updated (E −10.0 %); "
        "error on the fitted recordings 0.30 → 0.10."
    )
    # two digits that are the same would say that nothing was gained
    little = {**result, "fit": [{"recording": "a", "role": "fit", "nominal": 0.024, "parameters": 0.0215}]}
    assert headline(little).endswith("0.024 → 0.021.")
    worse = {**result, "fit": [{"recording": "a", "role": "fit", "nominal": 0.17, "parameters": 0.18}]}
    assert headline(worse).endswith("0.17 → 0.18, over all frequencies no better.")


def test_a_headline_leaves_out_recordings_that_were_not_fitted() -> None:
    """Of three blows two were cut off: what the model leaves of those says nothing of it."""
    row = {"recording": "whole", "role": "fit", "noise_floor": 0.02, "nominal": 0.46, "parameters": 0.02, "final": 0.02}
    cut = {**row, "recording": "cut", "noise_floor": None, "nominal": 0.6, "parameters": 0.35, "final": 0.35}
    result = {"verdict": "parameters-only", "parameters": {"E": {"factor": 1.1, "sd": 0.01}}, "fit": [cut, row]}
    assert headline(result).endswith("error on the fitted recordings 0.46 → 0.02.")


def test_a_headline_tells_the_error_in_the_band_that_was_compared() -> None:
    """Lines that a mesh does not follow are left out of the comparison, and say nothing of what it found."""
    inside = {"band": [2.0, 180.4], "nominal": 0.5, "parameters": 0.4, "final": 0.02}
    row = {"recording": "v", "role": "validate", "nominal": 0.6, "parameters": 0.5, "final": 0.31, "in_band": inside}
    finding = {"physics": "added_mass", "location": {"nodes": [6], "direction": "Z"}}
    result = {"verdict": "missing-physics", "findings": [finding], "fit": [row]}
    told = (
        "unseen recordings 0.40 → 0.02 from 2 to 180 Hz, where models are compared (0.50 → 0.31 over all frequencies)."
    )
    assert headline(result).endswith(told)
    assert "From 2 to 180 Hz, where models are compared: 0.40 → 0.020." in render(
        ReportContent(title="t", result=result)
    )
    # like errors are told once, and so is what is noise
    like = {**row, "in_band": {**inside, "final": 0.25}}
    assert headline({**result, "fit": [like]}).endswith("unseen recordings 0.50 → 0.31.")
    noise = {"recording": "f", "role": "fit", "noise_floor": 0.3}
    assert headline({**result, "fit": [row, noise]}).endswith("unseen recordings 0.50 → 0.31.")
    # one that grew over all frequencies alone
    grew = {**row, "final": 0.52, "in_band": {**inside, "final": 0.39}}
    assert headline({**result, "fit": [grew]}).endswith(
        "0.40 → 0.39 from 2 to 180 Hz, where models are compared (0.50 → 0.52 over all frequencies)."
    )
    as_given = {"verdict": "consistent", "findings": [], "fit": [{**row, "in_band": {**inside, "nominal": 0.02}}]}
    assert "(error on unseen recordings 0.020 from 2 to 180 Hz, where models are compared; 0.60 over" in headline(
        as_given
    )


def test_certainty_does_not_claim_more_than_it_is_given() -> None:
    assert words.certainty(0.999) == "more than 99 % among the hypotheses tried"
    law = {"physics": "clearance", "probability": 0.95}
    assert words.sure_text(law, "missing-physics") == "95 % among the hypotheses tried"
    assert words.sure_text(law, "located-not-named").endswith("tried, of which none explains all that is left")
    assert words.certainty(0.6) == "60 % among the hypotheses tried, not certain"
    assert words.certainty(0.3).endswith("tentative")
    assert words.certainty(None) == "no probability given"


def test_decimation_keeps_peaks_and_invents_nothing() -> None:
    rng = np.random.default_rng(0)
    x, y = np.arange(100_000.0), rng.normal(size=100_000)
    y[54_321], y[60_000] = 50.0, -50.0
    dx, dy = decimate(x, y, 300)
    assert len(dx) <= 602
    assert np.all(np.diff(dx) > 0)
    assert dy.max() == 50.0
    assert dy.min() == -50.0
    np.testing.assert_array_equal(y[dx.astype(int)], dy)


def test_ticks() -> None:
    assert nice_ticks(-0.3, 0.3, 3) == [-0.2, 0.0, 0.2]
    assert log_ticks(0.5, 2e3) == [1.0, 10.0, 100.0, 1000.0]
    assert len(log_ticks(1e-12, 1e12)) <= 6
    assert nice_ticks(1.0, 1.0) == [1.0]


def test_a_curve_goes_through_its_points_and_breaks_at_gaps() -> None:
    axes = Axes((0, 0, 100, 50), (0.0, 10.0), (0.0, 5.0))
    axes.curve(np.array([0.0, 2.0, 8.0, 10.0]), np.array([0.0, 5.0, 2.5, np.nan]), "final", gap=3.0)
    assert axes.parts == ['<path class="curve final" d="M0 50l20 -50M80 25"/>']


def test_run_information_is_written_and_read_back(tmp_path: Path) -> None:
    info = RunInfo(seed=7, study="study.toml")
    with info.step("wait"):
        time.sleep(0.05)
    with pytest.raises(RuntimeError), info.step("fail"):
        raise RuntimeError("stops here")
    info.write(tmp_path / "run.json")
    run = json.loads((tmp_path / "run.json").read_text())
    assert run["format"] == "femend-run/1"
    assert [s["name"] for s in run["steps"]] == ["wait", "fail"]
    assert 0.05 <= run["steps"][0]["seconds"] < 5.0
    assert run["steps"][0]["seconds"] <= run["seconds"]
    assert run["seed"] == 7
    assert run["threads"] >= 1
    assert {"femend", "python", "numpy", "scipy"} <= set(run["versions"])
    rests_on = run["calibration"]
    assert rests_on["surest"] == pytest.approx((rests_on["right"] + 1) / (rests_on["told"] + 2), abs=0.005)


ALLOCATION = """
import numpy as np
from femend.report.page import render
from femend.report.runinfo import RunInfo

info = RunInfo()
with info.step("before"):
    pass
with info.step("allocate"):
    block = np.ones(40_000_000)  # 320 MB
print(*(s.peak_memory_mb for s in info.steps))
"""


def test_peak_memory_sees_an_allocation() -> None:
    """In a process of its own: a peak only grows, and earlier tests may have needed more."""
    done = subprocess.run([sys.executable, "-c", ALLOCATION], capture_output=True, text=True, check=True, timeout=120)
    before, after = map(float, done.stdout.split())
    if math.isnan(before):
        pytest.skip("this system does not tell the peak memory")
    assert after - before > 200
