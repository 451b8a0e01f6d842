"""The example of a law of one's own: registered, put into a structure, found and named with its parameters."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest


@pytest.mark.slow
def test_own_law(project_root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example = runpy.run_path(str(project_root / "python" / "examples" / "own_law.py"))
    what = example["main"]()
    assert "tanh_spring" in capsys.readouterr().out
    (finding,) = what.result["findings"]
    assert (what.verdict, finding["physics"], finding["location"]["nodes"]) == ("missing-physics", "tanh_spring", [3])
    for name, true in example["TRUE"].items():
        found = finding["parameters"][name]
        # within three standard deviations of what was put in, and told to better than a third
        assert abs(found["value"] - true) < 3 * found["sd"]
        assert found["sd"] < true / 3
