"""What every mount of a kind does is told as one law in each of them, with one size."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, deck, write_study

DASHPOT = 12.0
MOUNTS = ("CELAS2,201,2.0+4,6,3", "CELAS2,202,2.0+4,11,3")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    folder = tmp_path_factory.mktemp("mounts")
    laws = [(node, "viscous_damper", {"c": DASHPOT}) for node in (6, 11)]
    study = write_study(folder, Truth((7.3e10, 6.8e10), more=MOUNTS, laws=laws))
    (folder / "model.bdf").write_text(deck(more=MOUNTS))
    found = diagnose(study)
    assert isinstance(found, StudyRun)
    return found


def test_a_dashpot_in_every_mount_is_one_finding(run: StudyRun) -> None:
    (finding,) = run.result["findings"]
    assert finding["physics"] == "viscous_damper"
    where = finding["location"]
    assert (where["nodes"], where["elements"], where["direction"], where["to"]) == ([6, 11], [201, 202], "Z", "ground")
    assert where["each"] is True
    assert finding["parameters"]["c"]["value"] == pytest.approx(DASHPOT, rel=0.1)
    assert run.result["parameters"]["E_root"]["factor"] == pytest.approx(7.3 / 7, rel=0.02)
