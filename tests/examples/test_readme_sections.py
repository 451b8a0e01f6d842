"""The sections of the README on modes, orders and correlation run as they stand, on the recordings of a rig."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import Rig, write_rig


def test_the_sections_run(
    project_root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    readme = (project_root / "README.md").read_text(encoding="utf-8")
    section = readme.split("## Without a study")[1].split("\n## ")[0]
    blocks = re.findall(r"```python\n(.*?)```", section, flags=re.DOTALL)
    assert len(blocks) == 4
    write_rig(tmp_path, Rig(seconds=30.0))
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, "README.md", "exec"), names)
    test, found, ambient = names["test"], names["found"], names["ambient"]
    assert test.status == "ok"
    assert test.modes.n_modes == 5
    # all five have a partner; the deck's fourth, yaw, which this test cannot see, has none
    assert [(row.a, row.b) for row in found.table.rows] == [(0, 0), (1, 1), (2, 2), (3, 4), (4, 5)]
    assert ambient.modes.n_modes >= 5
    assert names["track"].values.shape[:2] == (2, len(names["shapes"].channels))
    assert names["shapes"].shapes.shape[0] == len(names["shapes"].channels)
    assert np.abs(names["speed"].rev_per_s.max() - 26.0) < 0.3
    assert "resynthesis error" in capsys.readouterr().out
