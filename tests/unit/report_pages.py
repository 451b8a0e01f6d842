"""Contents of a report page as a full run fills them in, and a reader of the page."""

from __future__ import annotations

import dataclasses
import html.parser
import re
from typing import Any

import numpy as np

from femend.report.content import (
    Check,
    FrfOverlay,
    LawRow,
    Marker,
    MeshPicture,
    ParameterRow,
    Place,
    ReportContent,
    RestoringForce,
    TimeOverlay,
)

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
