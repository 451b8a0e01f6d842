"""The report page: valid, self-contained HTML that says the facts, for every verdict."""

from __future__ import annotations

import dataclasses
import re

import pytest

from femend.report.content import ParameterRow, Picture
from femend.report.mesh_view import static_picture, viewer_data
from femend.report.page import render
from femend.study.result.findings import alternatives, law_words

from .report_pages import Page, content, result

VERDICTS = ("consistent", "parameters-only", "missing-physics", "located-not-named", "undetermined")


@pytest.mark.parametrize("verdict", VERDICTS)
def test_page_is_well_formed_and_self_contained(verdict: str) -> None:
    text = render(content(verdict))
    page = Page(text)
    assert text.lstrip().startswith("<!DOCTYPE html>")
    assert page.wrong == []
    assert page.open == []
    assert [a for a in page.addresses if not a.startswith("data:")] == []
    assert len(page.ids) == len(set(page.ids))
    assert not re.search(r"url\(|@import|https?://", text)
    assert len(text.encode()) < 2_000_000


def test_a_fit_that_stalled_is_explained() -> None:
    made = content()
    for status, told in (("stalled", True), ("converged", False)):
        page = Page(render(dataclasses.replace(made, result={**made.result, "status": status})))
        assert page.wrong == []
        assert ("Stalled. The last fit ended before it came to its minimum" in page.text) is told


def test_missing_physics_says_what_where_how_much_and_how_sure() -> None:
    page = Page(render(content()))
    assert (
        "Missing: one-sided contact at node 4 in Z, to ground, gap 0.63 mm, stiffness 54 kN/m; "
        "prediction error on unseen recordings 0.40 → 0.04." in page.text
    )
    for fact in ("0.63 ± 0.02 mm", "54 ± 2 kN/m", "93 %", "cubic stiffness (5 %)", "node 5", "E_columns", "+3.0 %"):
        assert fact in page.text, fact
    assert {"Ranking of candidate places", "Recovered force over displacement", "Recovered force over velocity"} <= set(
        page.svgs
    )
    assert sum(s.startswith("Frequency response") for s in page.svgs) == 6
    assert sum(s.startswith("Time trace") for s in page.svgs) == 2


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        (
            "consistent",
            "the model as given explains the recordings (error on unseen recordings 0.016, noise 0.011)",
        ),
        ("parameters-only", "once updated (E_beams −6.0 %, E_columns +3.0 %)"),
        (
            "located-not-named",
            "The model lacks a nonlinear elastic force, most likely at node 4 in Z, to ground, but no law tried",
        ),
        ("undetermined", "The recordings cannot tell whether something is missing"),
    ],
)
def test_every_verdict_has_its_sentence(verdict: str, words: str) -> None:
    page = Page(render(content(verdict)))
    assert words in page.text
    advice = result(verdict)["advice"]
    assert advice in page.text


def test_a_place_without_a_name_has_no_certainty_and_names_the_nearest_laws() -> None:
    said = result("located-not-named")
    nearest = {"physics": "joint_stiffness", "probability": 0.048}
    said["findings"] = [{**said["findings"][0], "physics": "", "probability": 0.0, "alternatives": [nearest]}]
    page = Page(render(dataclasses.replace(content("located-not-named"), result=said)))
    assert "No name: none of the laws tried explains it well enough." in page.text
    assert "Nearest laws tried: flexible joint or weakened member." in page.text
    assert "0 % among" not in page.text


def test_a_law_that_the_contract_tells_by_another_name_has_its_own_on_the_page() -> None:
    said = result("missing-physics")
    values = {"k": {"value": 5.4e4, "sd": 2.0e3, "unit": "N/m"}, "preload": {"value": 3.0, "sd": 0.1, "unit": "N"}}
    asked = {
        **law_words("preloaded_contact"),
        "parameters": values,
        "alternatives": alternatives({"hertz_contact": 0.2}),
    }
    said["findings"] = [{**said["findings"][0], **asked}]
    assert (said["findings"][0]["physics"], said["findings"][0]["law"]) == ("bilinear_stiffness", "preloaded_contact")
    assert asked["alternatives"] == [{"physics": "clearance", "law": "hertz_contact", "probability": 0.2}]
    page = Page(render(dataclasses.replace(content("missing-physics"), result=said)))
    assert "preloaded contact" in page.text
    assert "bilinear stiffness" not in page.text
    assert "Also considered: hertz contact (20 %)" in page.text


def test_a_force_recorded_elsewhere_says_both_places_once() -> None:
    said = result("missing-physics")
    finding = {
        "physics": "load_misplaced", "probability": 0.95, "location": {"nodes": [6], "direction": "Z"},
        "parameters": {"node": {"value": 6}, "direction": {"value": "+Z"}},
        "recorded": [{"node": 8, "direction": "+X"}],
    }  # fmt: skip
    page = Page(render(dataclasses.replace(content(), result={**said, "findings": [finding]})))
    assert "The force recorded at node 8 in +X acts at node 6 in +Z; prediction error" in page.text
    assert "direction +Z" not in page.text


def test_the_parameters_that_moved_most_stand_in_front() -> None:
    rows = tuple(ParameterRow(f"p{i}", 1.0 + 0.01 * i, 0.01, 0.1, z) for i, z in enumerate([0.1, None, -4.0, 2.0, 0.3]))
    page = render(dataclasses.replace(content("parameters-only"), parameters=rows))
    tiles = page[page.index("Noise floor") : page.index("The model")]
    assert tiles.index("<h3>p2</h3>") < tiles.index("<h3>p3</h3>")
    assert "<h3>p0</h3>" not in tiles


def test_warnings_stand_above_the_picture() -> None:
    said = {**result("consistent"), "warnings": ["recording <a> clips"]}
    page = Page(render(dataclasses.replace(content("consistent"), result=said)))
    assert page.wrong == []
    assert page.text.index("Recording <a> clips") < page.text.index("The model")
    assert "Warnings about the deck" not in Page(render(content("consistent"))).text


def test_a_study_in_stages_tells_how_its_rivals_were_judged() -> None:
    said = {**result("missing-physics"), "stages": [{"stage": "FRFs"}]}
    page = Page(render(dataclasses.replace(content("missing-physics"), result=said)))
    assert "The evidence decides" in page.text
    assert "misfit, choosing" not in page.text
    assert "misfit, choosing" in Page(render(content("missing-physics"))).text


def test_pictures_are_in_the_page_itself() -> None:
    shown = Picture("MAC of the modes", b"\x89PNG")
    page = Page(render(dataclasses.replace(content("consistent"), pictures=(shown,))))
    assert page.wrong == []
    assert "data:image/png;base64,iVBORw==" in page.addresses
    assert "MAC of the modes." in page.text


def test_every_finding_has_its_place_in_the_picture() -> None:
    one = content("missing-physics")
    two = dataclasses.replace(one, further=(((2,), "X"),))
    data = viewer_data(two)
    assert data is not None
    assert [[data["ids"][k] for k in place["nodes"]] for place in data["further"]] == [[2]]
    assert data["further"][0]["direction"]["vector"] == [1.0, 0.0, 0.0]
    assert static_picture(data).count('<circle class="located"') == 2
    assert "node 2" in static_picture(data)
    assert "located places" in render(two)
    assert "located places" not in render(one)
