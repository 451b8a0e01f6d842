"""A diagnosis that is given a time: what is settled then is written, and told as that."""

from __future__ import annotations

import json
import signal
import sys
import time
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import femend as fe
from femend.cli import main
from femend.diagnose import diagnosis as steps
from femend.diagnose.naming import name
from femend.errors import StudyError, TimeLimitError
from femend.study import run as study_run
from femend.study.result.study_run import StudyRun
from femend.study.time_limit import TimeLimit

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

SPRING = small_study.Truth((7.3e10, 6.8e10), ("CELAS2,900,3e4,7,3",))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_study.write_study(tmp_path_factory.mktemp("study"), SPRING)


def wait_in(monkeypatch: pytest.MonkeyPatch, module: Any, function: str) -> list[float]:
    """`function` of `module` is not at an end before it is interrupted; when it was called."""
    called = []

    def never(*args: Any, **kwargs: Any) -> Any:
        called.append(time.monotonic())
        while time.monotonic() < called[0] + 60:
            time.sleep(0.01)
        pytest.fail("it was not interrupted")

    monkeypatch.setattr(module, function, never)
    return called


def test_the_likeliest_law_is_told_when_the_time_is_over(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    called = wait_in(monkeypatch, name, "masses_from_afar")  # all laws on the ground are judged then
    begun = time.monotonic()
    run = fe.diagnose_study(study, tmp_path / "out", time_limit=20.0)
    assert called
    assert called[0] - begun < 20.0, "the machine was too slow for this test"
    assert isinstance(run, StudyRun)
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert (result["verdict"], result["status"]) == ("located-not-named", "interrupted")
    assert [(f["physics"], f["location"]["nodes"]) for f in result["findings"]] == [("support_stiffness", [7])]
    assert result["advice"].startswith('the time limit of 20 s was reached in the step "name it"')
    told = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))
    assert told["settings"] == {"time_limit": 20.0}


def test_a_time_that_is_enough_changes_nothing(study: Path, tmp_path: Path) -> None:
    command = ["diagnose", str(study), "--out", str(tmp_path / "out"), "--time-limit", "3600"]
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 0, done.stderr
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert (result["verdict"], result["status"]) == ("missing-physics", "converged")


def test_a_time_that_is_too_short_is_an_error(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wait_in(monkeypatch, steps, "update_model")
    with pytest.raises(TimeLimitError, match=r"time limit of 0.5 s was reached .* before the parameters were updated"):
        fe.diagnose_study(study, tmp_path / "out", time_limit=0.5)
    done = CliRunner().invoke(main, ["diagnose", str(study), "--out", str(tmp_path / "out"), "--time-limit", "0.5"])
    assert done.exit_code == 2
    assert "give it more time" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("step", ["doubts_found", "corrections_of"])
def test_a_time_that_ends_before_the_update_begins_is_kept_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    """Sensors that look mistaken are tried on updates of their own, which take as long as a diagnosis."""
    recording = small_study.recording

    def reversed_sensor(name: str, u: small_study.Array, y: small_study.Array | None) -> fe.TimeData:
        return recording(name, u, y if y is None else np.where(np.arange(len(y)) == 1, -1.0, 1.0)[:, None] * y)

    monkeypatch.setattr(small_study, "recording", reversed_sensor)
    path = small_study.write_study(tmp_path, SPRING)
    called = wait_in(monkeypatch, study_run, step)
    with pytest.raises(TimeLimitError, match=r"was reached .* before the parameters were updated") as error:
        fe.diagnose_study(path, tmp_path / "out", time_limit=5.0)
    assert called
    assert error.value.step in ("read the deck and the recordings", "try corrections")
    assert not (tmp_path / "out").exists()


def test_responses_alone_that_turn_out_to_need_stages_go_through_them_and_say_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = small_study.write_study(tmp_path, SPRING)
    path.write_text(path.read_text().replace('role = "fit"', 'role = "fit"\nexcitation = "unknown"'))
    staged: list[list[str]] = []
    monkeypatch.setattr(study_run, "diagnose_responses", lambda *args, **kwargs: None)
    monkeypatch.setattr(study_run, "diagnose_staged", lambda *args: staged.append(args[-1]))
    fe.diagnose_study(path, time_limit=60.0, laws="support_stiffness")
    no_one_force, limit, laws = staged[0]
    assert "no one force" in no_one_force
    assert limit.startswith("a time limit was set (60 s)")
    assert laws.startswith("laws were chosen (support_stiffness)")


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf")])
def test_no_time_is_an_error(seconds: float) -> None:
    with pytest.raises(StudyError, match="give a positive number of seconds"):
        TimeLimit(seconds)


def test_another_thread_cannot_have_a_limit(study: Path) -> None:
    raised: list[BaseException] = []

    def run() -> None:
        try:
            fe.diagnose_study(study, time_limit=10.0)
        except StudyError as error:
            raised.append(error)

    thread = Thread(target=run)
    thread.start()
    thread.join()
    assert "main thread" in str(raised[0])


def test_a_job_in_the_background_has_a_limit_too() -> None:
    """One that ignores Ctrl-C; what SIGTERM does is as before once the block is left."""
    ours, terms = signal.signal(signal.SIGINT, signal.SIG_IGN), signal.getsignal(signal.SIGTERM)
    try:
        with pytest.raises(KeyboardInterrupt), TimeLimit(0.05):
            time.sleep(10)
    finally:
        signal.signal(signal.SIGINT, ours)
    assert signal.getsignal(signal.SIGTERM) == terms


def test_nothing_is_interrupted_once_the_block_is_left() -> None:
    limit = TimeLimit(0.05)
    with limit:
        pass
    time.sleep(0.2)
    assert not limit.reached
    # and what was over before it is entered is over at once
    with pytest.raises(KeyboardInterrupt), limit:
        time.sleep(10)
    assert limit.reached
