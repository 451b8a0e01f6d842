"""The laws that a study run tries: the default ones, others by name, and those of one's own."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import femend as fe
from femend.cli import main
from femend.errors import LawParameterError, StudyError
from femend.physics import CATALOGUE, catalogue, register, selected
from femend.study import run as study_run
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

SPRING = small_study.Truth((7.3e10, 6.8e10), ("CELAS2,900,3e4,7,3",))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_study.write_study(tmp_path_factory.mktemp("study"), SPRING)


def tried(run: object) -> set[str]:
    assert isinstance(run, StudyRun)
    return {r.candidate.physics.name for r in run.diagnosis.ranked if r.candidate.physics is not None}


def test_words_stand_for_many_laws() -> None:
    default, every = catalogue(extended=False), catalogue(extended=True)
    with selected("default, hertz_contact") as chosen:
        assert chosen == (*default, CATALOGUE["hertz_contact"])
    with selected(["all"]) as chosen:
        assert set(chosen) == set(every)
    with selected("default,cubic_stiffness") as chosen:
        assert chosen == default  # each once
    with pytest.raises(LawParameterError, match="nearest is 'hertz_contact'"), selected("default,hertz"):
        pass
    with pytest.raises(LawParameterError, match="unmeasured_force is no local law"), selected("unmeasured_force"):
        pass


def test_a_study_tries_the_laws_asked_for(study: Path, tmp_path: Path) -> None:
    plain = fe.diagnose_study(study)
    run = fe.diagnose_study(study, tmp_path / "out", laws=["support_stiffness", "fractional"])
    assert "fractional" not in tried(plain)
    assert tried(run) <= {"support_stiffness", "fractional", "added_mass"}
    assert "fractional" in tried(run)
    assert run.result["findings"][0]["physics"] == "support_stiffness"
    settings = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))["settings"]
    assert settings == {"laws": ["support_stiffness", "fractional"]}
    assert "fractional" not in {entry.name for entry in catalogue()}  # nothing of it stays


def test_a_study_tries_a_law_of_ones_own(study: Path) -> None:
    def force(d: float, v: float, k: float) -> float:
        return k * d**3

    register("test_own_cube", force, {"k": ("N/m^3", 1e9)})
    try:
        run = fe.diagnose_study(study, laws="default,test_own_cube")
    finally:
        CATALOGUE.pop("test_own_cube")
    assert run.result["findings"][0]["physics"] == "support_stiffness"
    assert run.result["verdict"] == "missing-physics"


def test_the_command_passes_the_names_on(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = ["diagnose", str(study), "--out", str(out), "--quiet", "--laws"]
    done = CliRunner().invoke(main, [*command, "support_stiffness,viscous_damper"])
    assert done.exit_code == 0, done.stderr
    run = json.loads((out / "run.json").read_text(encoding="utf-8"))
    assert run["settings"]["laws"] == ["support_stiffness", "viscous_damper"]
    done = CliRunner().invoke(main, [*command, "support_stifness"])
    assert done.exit_code == 2
    assert "nearest is 'support_stiffness'" in done.stderr


def test_a_study_in_stages_refuses_them(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_run, "is_staged", lambda study: True)
    with pytest.raises(StudyError, match=r"laws were chosen \(cubic_stiffness\)"):
        fe.diagnose_study(study, laws="cubic_stiffness")
    with pytest.raises(StudyError, match=r"time limit was set \(9 s\).*leave out the limit and the choice of laws$"):
        fe.diagnose_study(study, laws="cubic_stiffness", time_limit=9.0)
