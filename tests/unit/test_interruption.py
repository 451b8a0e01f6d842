"""A study that is stopped by hand: what is settled is written, whole or not at all."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import sleep
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from click.testing import CliRunner

from femend import read_model
from femend.cli import main
from femend.demo import STUDY
from femend.diagnose import diagnosis as steps
from femend.diagnose.deciding.interrupted import undecided
from femend.diagnose.deciding.so_far import SoFar
from femend.diagnose.recordings.low_cut import LowCut
from femend.report.vocabulary import PHYSICS
from femend.study import StudyInterrupted
from femend.study import run as study_run
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

E = (7.3e10, 6.8e10)
SPRING = small_study.Truth(E, ("CELAS2,900,3e4,7,3",))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_study.write_study(tmp_path_factory.mktemp("study"), SPRING)


def stop_at(monkeypatch: pytest.MonkeyPatch, module: Any, name: str, after: int = 0) -> None:
    """Ctrl-C when `name` of `module` is called for the time number `after` + 1."""
    plain: Callable[..., Any] = getattr(module, name)
    calls = []

    def stopped(*args: Any, **kwargs: Any) -> Any:
        calls.append(name)
        if len(calls) == after + 1:
            raise KeyboardInterrupt
        return plain(*args, **kwargs)

    monkeypatch.setattr(module, name, stopped)


def stopped_run(study: Path, out: Path | None) -> StudyInterrupted:
    with pytest.raises(StudyInterrupted) as stopped:
        diagnose(study, out)
    return stopped.value


def read(out: Path) -> dict[str, Any]:
    return json.loads((out / "result.json").read_text(encoding="utf-8"))


def folders(parent: Path) -> list[str]:
    return sorted(p.name for p in parent.iterdir())


def test_stopped_while_places_are_sought_the_updated_parameters_stand(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop_at(monkeypatch, steps, "locate")
    stop = stopped_run(study, tmp_path / "out")
    result = read(tmp_path / "out")
    assert (result["verdict"], result["status"], result["findings"]) == ("undetermined", "interrupted", [])
    assert "locate what is missing" in result["advice"]
    assert "no place was looked at" in result["advice"]
    assert all(p["factor"] != 1.0 and p["sd"] > 0 for p in result["parameters"].values())
    for row in result["fit"]:
        assert row["final"] == row["parameters"] < row["nominal"]
    assert {row["recording"] for row in result["fit"]} == {"low", "high", "held"}
    assert stop.run.diagnosis.interrupted
    assert stop.out == tmp_path / "out"
    assert "run the same again" in str(stop)


@dataclass(frozen=True)
class _OneEffect:
    """What is looked at of a diagnosis with one effect."""

    advice: str = ""
    off: LowCut | None = None
    driven: None = None
    interrupted: bool = False


def test_what_recordings_are_off_by_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    """The updated model is that of the corrected recordings: predictions are made of corrected forces, too."""
    off, start = (
        LowCut(2.0),
        SimpleNamespace(problem=SimpleNamespace(band=(1.0, 9.0)), null=None, reduced=SimpleNamespace(model=None)),
    )
    for name, made in (
        ("update_model", start), ("find_places", []), ("bed_places", []), ("sensed_places", []), ("locate", []),
        ("quieter_records", None), ("with_pairs_between", ([], [])), ("put_right", (off, start, [])),
        ("as_sensors_are", (start, [])),
    ):  # fmt: skip
        monkeypatch.setattr(steps, name, lambda *a, made=made: made)
    stop_at(monkeypatch, steps, "nearer")
    so_far = SoFar()
    with pytest.raises(KeyboardInterrupt):
        steps.diagnose_records(cast(Any, None), [], 0.01, so_far=so_far)
    assert so_far.off is off
    so_far.decided = cast(Any, _OneEffect())
    told = undecided(so_far, "look for more")
    assert told is not None
    assert told.off is off
    assert told.interrupted


def test_before_one_effect_is_decided_they_do_too(tmp_path: Path) -> None:
    off = LowCut(2.0)
    told = undecided(SoFar(start=small_study.updated(tmp_path, SPRING), off=off), "name it")
    assert told is not None
    assert told.off is off


def test_everything_of_a_result_is_there(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stop_at(monkeypatch, steps, "try_loads")
    stopped_run(study, tmp_path / "out")
    wanted = {"result.json", "run.json", "report.html", "model.updated.bdf", "predictions"}
    assert set(folders(tmp_path / "out")) == wanted
    assert folders(tmp_path) == ["out"]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Interrupted before it was decided" in page
    assert "What is settled, and what is not" in page
    assert "Would the recorded force" not in page  # that was not asked yet
    before, after = read_model(study.parent / "model.bdf"), read_model(tmp_path / "out" / "model.updated.bdf")
    assert len(after.fe.elements()) == len(before.fe.elements())  # nothing added
    assert not np.array_equal(before.matrices()[0].data, after.matrices()[0].data)
    assert list((tmp_path / "out" / "predictions" / "final").glob("*.uff"))


def test_places_ranked_so_far_are_told(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stop_at(monkeypatch, steps, "try_loads")
    stop = stopped_run(study, tmp_path / "out")
    result = read(tmp_path / "out")
    assert "node 7 to ground, Z (" in result["advice"]
    assert "no law was judged" in result["advice"]
    # one force there explains the recordings, whatever it is
    assert (result["verdict"], result["status"]) == ("located-not-named", "interrupted")
    (finding,) = result["findings"]
    assert finding["location"]["nodes"] == [7]
    assert finding["physics"] not in PHYSICS
    assert "by which law is not decided" in result["advice"]
    assert all(row["final"] == row["parameters"] for row in result["fit"])
    assert "ranked places" in str(stop)
    assert "Why there" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_the_best_law_judged_so_far_is_told_as_the_likeliest(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from femend.diagnose.naming import name

    stop_at(monkeypatch, name, "masses_from_afar")
    stop = stopped_run(study, tmp_path / "out")
    d = stop.run.diagnosis
    assert len(d.ranked) > 3
    assert d.ranked[0].candidate.chosen < d.null_chosen.chosen
    advice = read(tmp_path / "out")["advice"]
    assert d.ranked[0].candidate.name == "support_stiffness"
    assert f"of {len(d.ranked)} laws judged so far support stiffness" in advice
    result = read(tmp_path / "out")
    assert (result["verdict"], result["status"]) == ("located-not-named", "interrupted")
    (finding,) = result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("support_stiffness", [7])
    assert finding["parameters"]["k"]["value"] == pytest.approx(3e4, rel=0.05)
    assert (finding["probability"], finding["alternatives"]) == (None, [])
    assert "in the final model as the likeliest so far" in result["advice"]
    assert all(row["final"] < row["parameters"] for row in result["fit"])
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "likeliest so far: elastic support" in page
    assert "not decided" in page
    assert "stopped before all laws were tried" in page
    # no probability is given among a part of the laws
    assert all(row.probability is None for row in study_run.report_content(stop.run, {}).laws)


def test_stopped_before_the_update_nothing_is_written(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop_at(monkeypatch, steps, "update_model")
    with pytest.raises(KeyboardInterrupt, match="before the parameters were updated") as stopped:
        diagnose(study, tmp_path / "out")
    assert not isinstance(stopped.value, StudyInterrupted)
    assert folders(tmp_path) == []


@pytest.mark.parametrize("at", ["predict_all", "render"])
def test_stopped_again_while_it_writes_nothing_is_written(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: str
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "result.json").write_text("{}")
    stop_at(monkeypatch, steps, "locate")
    stop_at(monkeypatch, study_run, at)
    with pytest.raises(KeyboardInterrupt) as stopped:
        diagnose(study, out)
    assert not isinstance(stopped.value, StudyInterrupted)
    assert folders(tmp_path) == ["out"]
    assert folders(out) == ["result.json"]
    assert (out / "result.json").read_text() == "{}"


def test_stopped_when_the_diagnosis_is_complete_all_of_it_is_written(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop_at(monkeypatch, study_run, "predict_all")
    stop = stopped_run(study, tmp_path / "out")
    result = read(tmp_path / "out")
    assert (result["verdict"], result["status"]) == ("missing-physics", "converged")
    assert result["findings"][0]["location"]["nodes"] == [7]
    assert "complete" in str(stop)


def test_without_a_folder_the_exception_has_what_is_settled(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stop_at(monkeypatch, steps, "locate")
    stop = stopped_run(study, None)
    assert stop.out is None
    assert stop.run.result["status"] == "interrupted"


def test_the_command_says_what_was_written(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stop_at(monkeypatch, steps, "try_loads")
    done = CliRunner().invoke(main, ["diagnose", str(study), "--out", str(tmp_path / "out"), "--quiet"])
    assert done.exit_code == 130
    assert "Traceback" not in done.stderr
    said = done.stderr.strip().splitlines()[-1]
    assert said.startswith('interrupted in the step "try loads"; written to')
    assert str(tmp_path / "out") in said
    stop_at(monkeypatch, steps, "update_model")
    done = CliRunner().invoke(main, ["diagnose", str(study), "--out", str(tmp_path / "none"), "--quiet"])
    assert done.exit_code == 130
    assert "no result was written" in done.stderr
    assert not (tmp_path / "none").exists()


def test_stopped_while_more_is_looked_for_what_was_found_is_told(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop_at(monkeypatch, steps, "look_further")
    stopped_run(study, tmp_path / "out")
    result = read(tmp_path / "out")
    assert (result["verdict"], result["status"]) == ("missing-physics", "interrupted")
    (finding,) = result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("support_stiffness", [7])
    assert "whether two effects explain it better is not decided" in result["advice"]
    assert all(row["final"] < row["parameters"] for row in result["fit"])


def test_a_model_that_explains_the_recordings_is_said_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = small_study.write_study(tmp_path / "study", small_study.Truth(E))
    stop_at(monkeypatch, steps, "try_loads")
    result = stopped_run(study, None).run.result
    assert (result["verdict"], result["findings"]) == ("undetermined", [])
    assert "the updated model explains the recordings, the ones that choose too" in result["advice"]


def test_a_law_that_brings_too_little_is_not_told(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor is one that could be followed in the beginning of the recordings alone."""
    from femend.diagnose.naming import name

    stop_at(monkeypatch, name, "masses_from_afar")
    monkeypatch.setattr("femend.diagnose.deciding.interrupted.accepted", lambda found, best: False)
    stop = stopped_run(study, None)
    (finding,) = stop.run.result["findings"]
    assert finding["physics"] not in PHYSICS
    assert stop.run.diagnosis.best is None  # the final model is the updated one


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.parametrize("told", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_a_process(tmp_path: Path, told: signal.Signals) -> None:
    """A real Ctrl-C, and the end of a job's time, once the run has said that the parameters are updated, of the bundled
    case, which goes on for tens of seconds from there. Told twice at once, as a shell's `timeout` tells a process and
    its group, it is told once."""
    command = [sys.executable, "-m", "femend", "diagnose", str(STUDY), "--out", str(tmp_path / "out")]
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
        # whoever runs the tests in the background may have left the signal ignored, which is inherited
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    try:
        assert process.stderr is not None
        for line in process.stderr:  # a line is written when its step has ended
            if line.startswith("update the parameters:"):
                process.send_signal(told)
                sleep(0.05)
                process.send_signal(told)
                break
        _, said = process.communicate(timeout=120)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "interrupted in the step" in said
    assert "Traceback" not in said
    assert read(tmp_path / "out")["status"] == "interrupted"
    assert folders(tmp_path) == ["out"]


# sends a signal to itself when a module is imported, while a text is executed, as dataclasses do
SIGNALLED = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
class Stop:
    def find_spec(self, name, path=None, target=None):
        if name == {when!r}:
            exec("os.kill(os.getpid(), signal.SIGINT)")
sys.meta_path.insert(0, Stop())
sys.argv = ["femend", "inspect", {file!r}]
from femend.__main__ import main
main()
"""


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.parametrize("when", ["femend.cli.group", "femend.io.uff.scan"])
def test_a_signal_while_something_is_imported_is_told_like_any_other(tmp_path: Path, when: str) -> None:
    """It was a traceback of whatever was being imported, before the command had begun; later on the interpreter ended
    as one that had not heeded the signal, where it came while a text was executed."""
    (tmp_path / "signalled.py").write_text(SIGNALLED.format(when=when, file=str(STUDY.parent / "low.uff")))
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "signalled"],
        capture_output=True, text=True, timeout=120, env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "\ninterrupted; no result was written\n")
