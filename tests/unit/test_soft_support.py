"""A support of a plate that is far softer than the elements around it, told from end to end."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.model import Model, read_model
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_plate import CORNERS, plate, supports, write_study

SOFT, K, E_FACTOR = 13, 2e4, 0.85


def truth(folder: Path) -> Model:
    """The plate with one corner on a spring and its modulus 15 % lower."""
    plate(folder, tuple(n for n in CORNERS if n != SOFT), f"CELAS2,900,{K},{SOFT},3")
    path = folder / "truth.bdf"
    path.write_text((folder / "plate.bdf").read_text().replace("7.+10", f"{E_FACTOR * 7:.3f}+10"))
    return read_model(path)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    folder = tmp_path_factory.mktemp("plate")
    done = diagnose(write_study(folder, truth(folder)))
    assert isinstance(done, StudyRun)
    return done


def test_a_corner_far_softer_than_its_elements_is_told_with_its_spring(run: StudyRun, tmp_path: Path) -> None:
    (of_corner,) = (p for p in supports(plate(tmp_path, CORNERS)) if p.nodes == (SOFT,))
    assert of_corner.support > 50 * K
    assert run.result["verdict"] == "missing-physics"
    (finding,) = run.result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("compliant_support", [SOFT])
    told = finding["parameters"]["k3"]
    assert told["unit"] == "N/m"
    assert told["value"] == pytest.approx(K, rel=0.05)
    assert abs(told["value"] - K) < 3 * told["sd"]
    held = next(r for r in run.result["fit"] if r["recording"] == "held")
    assert held["final"] < 0.02 < held["parameters"]
    assert run.result["parameters"]["E"]["factor"] == pytest.approx(E_FACTOR, rel=0.02)
