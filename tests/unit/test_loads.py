"""A force that acts elsewhere than the recordings say, or the other way round, is told as such and as nothing else."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend import TimeData
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

SAID = small_study.SHAKER


@pytest.mark.parametrize(("node", "sign"), [(SAID, -1.0), (7, 1.0), (7, -1.0)])
def test_a_load_elsewhere_or_the_other_way_round(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, node: int, sign: float
) -> None:
    """The recordings say `SAID` +Z; the force acts at `node`, against that direction where `sign` is negative."""
    record = small_study.recording

    def misnamed(name: str, u: small_study.Array, y: small_study.Array | None) -> TimeData:
        monkeypatch.setattr(small_study, "SHAKER", SAID)
        made = record(name, sign * u, y)
        monkeypatch.setattr(small_study, "SHAKER", node)
        return made

    monkeypatch.setattr(small_study, "SHAKER", node)
    monkeypatch.setattr(small_study, "recording", misnamed)
    path = small_study.write_study(tmp_path, small_study.Truth(E=(7.4e10, 6.8e10)))
    result = diagnose(path, out=tmp_path / "out").result
    (finding,) = result["findings"]
    assert result["verdict"] == "missing-physics"
    assert finding["physics"] == "load_misplaced"
    assert finding["location"]["nodes"] == [node]
    assert finding["location"]["direction"] == "Z"
    assert finding["parameters"]["direction"]["value"] == ("+Z" if sign > 0 else "-Z")
