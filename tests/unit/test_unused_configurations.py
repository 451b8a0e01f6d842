"""Configurations that no recording is in."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.study import load_study
from femend.study.doubts.unused_configurations import unused_configurations

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import Recorded, study_text
from small_study import deck


@pytest.mark.parametrize("forgotten", [False, True])
def test_a_configuration_without_a_recording_is_told(tmp_path: Path, forgotten: bool) -> None:
    (tmp_path / "model.bdf").write_text(deck())
    (tmp_path / "modes.uff").touch()
    text = study_text((Recorded("modes", mass=(13, 0.1)),))
    assert text.count('configuration = "') == 1
    kept = [line for line in text.splitlines() if not (forgotten and line.startswith("configuration = "))]
    (tmp_path / "study.toml").write_text("\n".join(kept))
    told = unused_configurations(load_study(tmp_path / "study.toml", recordings=False))
    assert [t[:44] for t in told] == (["no recording is in configuration 'loaded', s"] if forgotten else [])
