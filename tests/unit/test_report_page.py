"""The report page: valid, self-contained HTML that says the facts, for every verdict, whole or with pieces absent."""

from __future__ import annotations

import dataclasses
import html.parser
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femend.report.content import (
    Check,
    FrfOverlay,
    LawRow,
    Marker,
    MeshPicture,
    ParameterRow,
    Picture,
    Place,
    ReportContent,
    RestoringForce,
    TimeOverlay,
)
from femend.report.mesh_view import static_picture, viewer_data
from femend.report.page import render

VERDICTS = ("consistent", "parameters-only", "missing-physics", "located-not-named", "undetermined")
VOID = {"meta", "link", "input", "br", "img", "hr"}


def frame_mesh(storeys: int = 3, per_member: int = 4) -> MeshPicture:
    """A plane frame in XZ, 0.43 m wide, storeys of 0.37 m; joints 1, 2, 3 ... from the ground up, left then right."""
    ids, xyz, lines = [], [], []

    def node(number: int, x: float, z: float) -> int:
        ids.append(number)
        xyz.append((x, 0.0, z))
        return len(ids) - 1

    joints = {(s, c): node(1 + 2 * s + c, 0.4257 * c, 0.3749 * s) for s in range(storeys + 1) for c in (0, 1)}
    members = [((s, c), (s + 1, c)) for s in range(storeys) for c in (0, 1)]
    members += [((s, 0), (s, 1)) for s in range(1, storeys + 1)]
    for a, b in members:
        last = joints[a]
        for k in range(1, per_member):
            (x0, _, z0), (x1, _, z1) = xyz[joints[a]], xyz[joints[b]]
            w = k / per_member
            new = node(1000 + len(ids), x0 + w * (x1 - x0), z0 + w * (z1 - z0))
            lines.append((last, new))
            last = new
        lines.append((last, joints[b]))
    return MeshPicture(np.array(ids), np.array(xyz), np.array(lines), supports=(1, 2))


def modal_frf(freq: np.ndarray, f_n: list[float], residues: list[float], zeta: float = 0.01) -> np.ndarray:
    """Accelerance of a few modes, (m/s²)/N."""
    omega, omega_n = 2 * np.pi * freq[:, None], 2 * np.pi * np.array(f_n)
    return np.asarray(
        -(omega[:, 0] ** 2) * (np.array(residues) / (omega_n**2 - omega**2 + 2j * zeta * omega_n * omega)).sum(1)
    )


def overlays(count: int = 3, n_freq: int = 900) -> tuple[FrfOverlay, ...]:
    rng = np.random.default_rng(3)
    freq = np.linspace(2.0, 180.0, n_freq)
    f_n, found = np.array([14.2, 46.0, 88.0, 141.0]), []
    for k in range(count):
        r = list(rng.normal(size=4) + 0.4)
        noise = 0.01 * (rng.normal(size=n_freq) + 1j * rng.normal(size=n_freq))
        found.append(
            FrfOverlay(
                freq,
                modal_frf(freq, list(f_n * 1.045), r) + noise,
                nominal=modal_frf(freq, list(f_n * 0.94), r),
                parameters=modal_frf(freq, list(f_n * [1.0, 1.03, 1.04, 1.045]), r),
                final=modal_frf(freq, list(f_n * 1.044), r),
                label=f"{3 + k}:+X over 6:+X",
                recording=("low", "mid", "high")[k % 3],
                unit="(m/s^2)/N",
            )
        )
    return tuple(found)


def traces(n: int = 8192) -> tuple[TimeOverlay, ...]:
    t = np.arange(n) / 1024.0
    clean = np.sin(2 * np.pi * 14.8 * t) * (1 + 0.6 * np.sin(1.3 * t)) + 0.4 * np.sin(2 * np.pi * 47.9 * t + 1)
    before = np.sin(2 * np.pi * 14.8 * t - 0.5) * (1 + 0.4 * np.sin(1.3 * t)) + 0.3 * np.sin(2 * np.pi * 47.9 * t + 1.4)
    rng = np.random.default_rng(5)
    measured = 12 * (clean + 0.02 * rng.normal(size=n))
    unseen = TimeOverlay(t, measured, 7 * before[::-1], 12 * before, 12 * clean, "3:+X", "random", "validate", "m/s^2")
    return (unseen, dataclasses.replace(unseen, label="5:+X", recording="high", role="fit"))


def restoring(n: int = 2000) -> RestoringForce:
    t = np.linspace(0, 2.0, n)
    d = 1.1e-3 * np.sin(2 * np.pi * 14.8 * t) * (0.5 + 0.5 * np.sin(2.1 * t))
    v = np.gradient(d, t)
    f = np.where(d > 6.3e-4, 5.4e4 * (d - 6.3e-4), 0.0)
    noisy = f + np.random.default_rng(1).normal(scale=0.8, size=n)
    return RestoringForce(d, v, noisy, d, v, f, recording="high")


def bare_result(verdict: str) -> dict[str, Any]:
    """A result.json of the contract without finding or advice."""
    return {
        "format": "femend-diagnosis/1",
        "verdict": verdict,
        "findings": [],
        "parameters": {"E_columns": {"factor": 1.03, "sd": 0.01}, "E_beams": {"factor": 0.94, "sd": 0.02}},
        "fit": [
            {
                "recording": "low",
                "role": "fit",
                "noise_floor": 0.01,
                "nominal": 0.61,
                "parameters": 0.21,
                "final": 0.03,
            },
            {
                "recording": "high",
                "role": "fit",
                "noise_floor": 0.01,
                "nominal": 0.72,
                "parameters": 0.4,
                "final": 0.04,
            },
            {
                "recording": "random",
                "role": "validate",
                "noise_floor": 0.011,
                "nominal": 0.80,
                "parameters": 0.398,
                "final": 0.041,
            },
        ],
        "status": "converged",
        "advice": "",
    }


def result(verdict: str) -> dict[str, Any]:
    """A result.json of the contract for each verdict."""
    base = bare_result(verdict)
    if verdict == "consistent":
        base["fit"] = [{**row, "nominal": 0.016, "parameters": 0.014, "final": 0.014} for row in base["fit"]]
    elif verdict == "parameters-only":
        base["fit"] = [{**row, "parameters": 0.021, "final": 0.021} for row in base["fit"]]
    finding: dict[str, Any] = {
        "physics": "clearance",
        "probability": 0.93,
        "location": {"nodes": [4], "to": "ground", "direction": "Z", "also_possible": [[5]]},
        "parameters": {
            "k": {"value": 5.4e4, "sd": 2.0e3, "unit": "N/m"},
            "gap": {"value": 6.3e-4, "sd": 2e-5, "unit": "m"},
            "sides": {"value": 1, "sd": 0, "unit": ""},
        },
        "alternatives": [{"physics": "cubic_stiffness", "probability": 0.05}],
        "configurations": ["as modelled"],
    }
    if verdict == "missing-physics":
        base["findings"] = [finding]
    elif verdict == "located-not-named":
        base["findings"] = [
            {**finding, "physics": "nonlinear elastic", "parameters": {}, "probability": 0.61, "alternatives": []}
        ]
        base["advice"] = "Record the same place at two more levels; contact and cubic stiffness differ there."
    elif verdict == "undetermined":
        base["advice"] = (
            "Record with a measured force between 10 and 60 Hz; the recordings hold no line above the noise there."
        )
        base["status"] = "not-converged"
    return base


def content(verdict: str = "missing-physics") -> ReportContent:
    """What a full run fills in."""
    nodes = (4, 3, 6, 5, 8, 7)
    places = tuple(
        Place(f"node {n} · {d} → ground", 410.0 + c, (n,), d, c < 10)
        for n, d, c in zip(
            (4, 5, 4, 6, 3, 8, 7, 6, 3), "ZZXXZXZZX", (0.0, 4.1, 36.0, 92.0, 230.0, 410.0, 1100.0, 2600.0, 8200.0)
        )
    )
    named = verdict == "missing-physics"
    laws = (
        LawRow("clearance", "node 4 · Z", 2, 1.02, 1.05, 0.93, "chosen", named),
        LawRow("cubic_stiffness", "node 4 · Z", 1, 1.31, 1.62, 0.05, "misfit on the choosing recording 54 % larger"),
        LawRow("support_stiffness", "node 4 · Z", 1, 2.91, 3.4, 0.004, "cannot make the energy on unexcited lines"),
        LawRow("none", "", 0, 8.1, 8.3, 0.0, "nothing added"),
    )
    run = {
        "seed": 0,
        "threads": 2,
        "started": "2026-01-05T10:00:00+00:00",
        "seconds": 21.4,
        "peak_memory_mb": 310.0,
        "system": "Linux x86_64",
        "versions": {"femend": "0.1.0", "python": "3.11.7", "numpy": "2.4.6"},
        "steps": [{"name": "read", "seconds": 0.21, "cpu_seconds": 0.2, "peak_memory_mb": 120.0}],
    }
    located = verdict in ("missing-physics", "located-not-named")
    return ReportContent(
        title="Frame on the bench",
        result=result(verdict),
        mesh=frame_mesh(),
        located=(4,) if located else (),
        ambiguous=(5,) if located else (),
        direction="Z" if located else "",
        sensors=tuple(Marker(f"{n}:+X", n) for n in nodes),
        shakers=(Marker("6:+X", 6, "force"),),
        overlays=overlays(6),
        traces=traces(),
        restoring=restoring() if located else None,
        places=places if located else (),
        place_threshold=8.0,
        laws=laws if located else (),
        parameters=(ParameterRow("E_columns", 1.03, 0.01, 0.1, 0.3), ParameterRow("E_beams", 0.94, 0.02, 0.1, -0.6)),
        checks=(
            Check("Is there energy on unexcited lines?", "yes, on even and odd ones", "14 times the noise"),
            Check("Did a parameter leave what was known of it?", "no", "largest 0.6 prior sd"),
        ),
        run=run,
        references=("Pintelon, Schoukens: System Identification, 2nd ed., Wiley 2012, ch. 4",),
        notes=("PARAM POST has no influence and was passed over",),
    )


class Page(html.parser.HTMLParser):
    """Collects text and addresses, and counts tags that do not close in the order they were opened."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.wrong: list[str] = []
        self.addresses: list[str] = []
        self.ids: list[str] = []
        self.words: list[str] = []
        self.svgs: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        for key, value in attrs:
            if key in ("src", "href", "data", "action", "xlink:href"):
                self.addresses.append(value or "")
            if key == "id":
                self.ids.append(value or "")
            if key == "aria-label" and tag == "svg":
                self.svgs.append(value or "")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Empty elements inside SVG need no end tag."""

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("script", "style"):
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))


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
        ("located-not-named", "The model lacks a nonlinear elastic force at node 4 in Z, to ground, but no law tried"),
        ("undetermined", "The recordings cannot tell whether something is missing"),
    ],
)
def test_every_verdict_has_its_sentence(verdict: str, words: str) -> None:
    page = Page(render(content(verdict)))
    assert words in page.text
    advice = result(verdict)["advice"]
    assert advice in page.text


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


# Errors and refused resources are noted where --dump-dom shows them.
WATCH = """<script>
const noted = (words) => { document.documentElement.dataset.errors = words; };
addEventListener("error", (e) => noted(e.message || "load"), true);
addEventListener("securitypolicyviolation", (e) => noted(e.blockedURI));
</script>"""
# A drag over the mesh, a pointer in the middle of it, and a pointer at a known place of the first figure.
TOUCH = """<script>setTimeout(() => {
  const seen = document.documentElement.dataset, canvas = document.getElementById("mesh-canvas");
  const box = canvas.getBoundingClientRect(), before = canvas.toDataURL();
  const fire = (type, x, y, buttons) => canvas.dispatchEvent(new PointerEvent(type,
    { clientX: box.left + x, clientY: box.top + y, pointerId: 1, buttons, bubbles: true }));
  canvas.setPointerCapture = () => {};
  fire("pointerdown", 100, 100, 1); fire("pointermove", 180, 130, 1); fire("pointerup", 180, 130, 0);
  setTimeout(() => {
    seen.turned = canvas.toDataURL() !== before;
    const tip = document.getElementById("mesh-tip");
    for (let x = 0; x < box.width && tip.hidden; x += 6)
      for (let y = 0; y < box.height && tip.hidden; y += 6) fire("pointermove", x, y, 0);
    seen.tip = tip.textContent;
    const plot = document.querySelector("svg[data-axes]"), at = plot.getBoundingClientRect(), scale = at.width / 520;
    plot.dispatchEvent(new PointerEvent("pointermove",
      { clientX: at.left + scale * (58 + 450 / 2), clientY: at.top + scale * 60, bubbles: true }));
    seen.read = plot.lastChild.textContent;
  }, 300);
}, 300);</script></body>"""


def browse(text: str, folder: Path) -> tuple[str, str]:
    """The document and the log after a headless browser has opened the page."""
    browser = next((b for b in ("chromium", "chromium-browser", "google-chrome") if shutil.which(b)), None)
    if browser is None:
        pytest.skip("no Chromium or Chrome on this machine")
    page = folder / "report.html"
    page.write_text(text.replace("<style>", WATCH + "<style>", 1), encoding="utf-8")
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=3000"]
    command += ["--enable-logging=stderr", f"--user-data-dir={folder / 'profile'}", "--dump-dom", page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert "</html>" in done.stdout, done.stderr[-2000:]
    return done.stdout, done.stderr


@pytest.mark.parametrize("verdict", ["missing-physics", "consistent"])
def test_a_browser_opens_the_page_without_errors_or_requests(verdict: str, tmp_path: Path) -> None:
    document, log = browse(render(content(verdict)), tmp_path)
    assert "data-errors" not in document[:400]
    assert [line for line in log.splitlines() if ":CONSOLE" in line] == []
    assert re.search(r'id="mesh-box" class="live"', document), "the viewer did not start"


def test_the_mesh_turns_and_values_are_read_under_the_pointer(tmp_path: Path) -> None:
    document, log = browse(render(content()).replace("</body>", TOUCH), tmp_path)
    assert [line for line in log.splitlines() if ":CONSOLE" in line] == []
    seen = dict(re.findall(r'data-(\w+)="([^"]*)"', document[:600]))
    assert seen["turned"] == "true"
    assert re.match(r"node \d+\n\(", seen["tip"])
    assert seen["read"].startswith("91 Hz,")  # the middle of 2 ... 180 Hz
