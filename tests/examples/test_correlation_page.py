"""The examples of the page on correlation run, one after the other, and their assertions hold."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from femend import correlate
from femend.report import plots


def test_examples_of_the_page(project_root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (project_root / "python" / "docs" / "correlation.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    assert len(blocks) == 3
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "correlation.md", "exec"), names)
    assert (tmp_path / "mac.png").read_bytes().startswith(b"\x89PNG")


def test_the_page_names_every_function(project_root: Path) -> None:
    page = (project_root / "python" / "docs" / "correlation.md").read_text(encoding="utf-8")
    helpers = {
        "close_groups",
        "mac_of_modes",
        "match_dofs",
        "match_frfs",
        "mode_table",
        "figure",
        "paper_style",
        "fit_omega_law",
    }
    functions = {n for module in (correlate, plots) for n in module.__all__ if n[0].islower()}
    assert sorted(n for n in functions - helpers if f"`{n}`" not in page) == []
