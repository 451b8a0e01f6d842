"""The example runs to its end, with the assertions it makes itself."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest


@pytest.mark.slow
def test_demo_case(project_root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example = runpy.run_path(str(project_root / "python" / "examples" / "demo_case.py"))
    report = tmp_path / "report.html"
    example["main"](str(report))
    said = capsys.readouterr().out
    assert "updated parameters" in said
    assert "node 3 to ground, Z" in said
    assert report.read_text(encoding="utf-8").lstrip().lower().startswith("<!doctype html")


def test_examples_are_short(project_root: Path) -> None:
    examples = sorted((project_root / "python" / "examples").glob("*.py"))
    assert examples
    lines = {e.name: len(e.read_text(encoding="utf-8").splitlines()) for e in examples}
    assert lines["demo_case.py"] <= 80
    # studies of real recordings read their own formats and print their tables; three of them hold a search of their own
    searches = {"beam_point_masses.py", "clamped_beam_sweeps.py", "roller_beam.py"}
    assert {name: n for name, n in lines.items() if n > (510 if name in searches else 220)} == {}
