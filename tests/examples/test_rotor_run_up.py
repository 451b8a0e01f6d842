"""The example of a rotor whose unbalance nobody measured: the figures of the page on updating."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest


def test_what_the_page_says(
    project_root: Path, script: Callable[[str], ModuleType], capsys: pytest.CaptureFixture[str]
) -> None:
    script("rotor_run_up").main()
    said = capsys.readouterr().out
    page = (project_root / "python" / "docs" / "updating.md").read_text(encoding="utf-8")
    rows = [row for row in said.splitlines() if "left" in row]
    assert len(rows) == 4
    for row, label in zip(
        rows, ("run-up, unbalance free", "unbalance taken", "order track", "operating shapes"), strict=True
    ):
        (told,) = [line for line in page.splitlines() if line.startswith(f"| {label}")]
        figures = [float(x) for x in re.findall(r"\d+\.\d+", row)]
        on_page = [float(x) for x in re.findall(r"\d+\.\d+", told)]
        assert on_page == pytest.approx(figures, rel=0.02, abs=2e-4), label
    found = [float(x) for x in re.findall(r"at \d: (\d+\.\d+)", said)]
    assert found == pytest.approx([20.0, 50.0], rel=0.01)
