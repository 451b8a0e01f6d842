"""The report page where pieces are absent, not finite, hostile or too large to draw."""

from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest

from femend.report.content import (
    Check,
    FrfOverlay,
    LawRow,
    Marker,
    MeshPicture,
    ParameterRow,
    Place,
    ReportContent,
    TimeOverlay,
)
from femend.report.page import render

from .report_pages import Page, content, modal_frf, overlays, result, traces


def test_bare_content_gives_a_page_without_empty_sections() -> None:
    page = Page(render(ReportContent("bare", {"verdict": "undetermined", "advice": "Measure the force."})))
    assert page.wrong == []
    assert "Measure the force." in page.text
    for heading in ("The model", "Before and after", "Why there", "Why this", "Parameters of the model", "How it was"):
        assert heading not in page.text
    assert Page(render(ReportContent("empty", {}))).text.count("No verdict was reached.") == 1


def test_missing_curves_and_values_that_are_not_finite_are_left_out() -> None:
    freq = np.linspace(1, 50, 200)
    holes = modal_frf(freq, [14.0], [1.0])
    holes[40:60] = np.nan
    frf = FrfOverlay(freq, holes, final=None, parameters=np.full(200, np.nan + 0j), label="holes")
    trace = TimeOverlay(np.arange(500) / 500, None, parameters=np.sin(np.arange(500) / 5), label="to be predicted")
    nothing = FrfOverlay(freq, np.zeros(200, complex), label="dead")
    odd = {
        **result("missing-physics"),
        "fit": [{"recording": "r", "role": "fit", "nominal": float("nan"), "final": None}],
    }
    laws = (LawRow("clearance", "node 4", 2, float("nan"), float("inf"), None),)
    text = render(dataclasses.replace(content(), result=odd, overlays=(frf, nothing), traces=(trace,), laws=laws))
    page = Page(text)
    assert not re.search(r'[\s"LMl]nan|inf[ "]', "".join(re.findall(r"<svg.*?</svg>", text, re.S)))
    assert sum(s.startswith("Frequency response") for s in page.svgs) == 1
    assert sum(s.startswith("Time trace") for s in page.svgs) == 1


def test_names_from_files_are_escaped_everywhere() -> None:
    evil = "<script>alert('x')</script>&\"</svg>"
    full = content()
    named = dataclasses.replace(
        full,
        title=evil,
        result={**result("missing-physics"), "advice": evil, "parameters": {evil: {"factor": 1.1, "sd": 0.1}}},
        sensors=(Marker("4:+X", 4, evil),),
        overlays=(dataclasses.replace(full.overlays[0], label=evil, recording=evil, unit=evil),),
        traces=(dataclasses.replace(full.traces[0], label=evil, recording=evil, role=evil, unit=evil),),
        places=(Place(evil, 1.0), Place("b", 2.0)),
        laws=(LawRow(evil, evil, 1, 1.0, 1.0, 0.5, evil),),
        checks=(Check(evil, evil, evil),),
        parameters=(ParameterRow(evil, 1.1, 0.1),),
        run={"versions": {evil: evil}, "steps": [{"name": evil, "seconds": 1.0}]},
        references=(evil,),
        notes=(evil,),
    )
    text = render(named)
    page = Page(text)
    assert "<script>alert" not in text
    assert page.wrong == []
    assert page.open == []
    assert text.count("<script") == 2
    data = json.loads(re.search(r'id="mesh-data">(.*?)</script>', text, re.S).group(1))  # type: ignore[union-attr]
    assert evil in data["sensors"][0]["label"]


def test_long_recordings_many_sensors_and_a_large_mesh_stay_below_two_megabytes() -> None:
    n = 100
    grid = np.arange(n * n * 2).reshape(2 * n, n)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1).reshape(-1, 4)
    x, y = np.divmod(np.arange(n * n * 2), n)
    plate = MeshPicture(np.arange(n * n * 2) + 1, np.column_stack([x, y, 0 * x]).astype(float), faces=quads)
    located = (777,)
    many = dataclasses.replace(
        content(), mesh=plate, located=located, overlays=overlays(60, 20000), traces=traces(200_000) * 20
    )
    text = render(many)
    assert len(text.encode()) < 2_000_000
    assert "further curves are not drawn" in text
    labels = Page(text).svgs
    assert sum(s.startswith("Time trace") for s in labels) >= 8
    assert sum(s.startswith("Frequency response") for s in labels) >= 8
    data = json.loads(re.search(r'id="mesh-data">(.*?)</script>', text, re.S).group(1))  # type: ignore[union-attr]
    assert len(data["ids"]) <= 5000
    assert data["ids"][data["located"][0]] == 777
    at = np.array(data["xyz"]).reshape(-1, 3)[data["located"][0]]
    np.testing.assert_array_equal(at, plate.xyz[776])


def test_a_mesh_with_wrong_indices_is_refused() -> None:
    with pytest.raises(ValueError, match=r"indices into 2 nodes run from 0 to 1"):
        MeshPicture(np.array([1, 2]), np.zeros((2, 3)), np.array([[0, 2]]))
    with pytest.raises(ValueError, match=r"shape \(3, 3\); 2 node ids need \(2, 3\)"):
        MeshPicture(np.array([1, 2]), np.zeros((3, 3)))
