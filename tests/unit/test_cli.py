"""The command line: what it says, what it writes, and how it ends."""

from __future__ import annotations

import io
import json
import shutil
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner, Result

from femend import __version__
from femend.app.progress import BarProgress, LineProgress, SilentProgress, progress_for
from femend.cli import main
from femend.cli.summary import summary
from femend.demo import STUDY, concealed, held_out_errors
from femend.errors import DeckError, RecordingError
from femend.io import OutputDirectory

RESULT = {
    "format": "femend-diagnosis/1",
    "verdict": "missing-physics",
    "findings": [
        {
            "physics": "added_mass",
            "probability": 0.97,
            "location": {"nodes": [6], "to": "ground", "direction": "Z", "also_possible": [[7]]},
            "parameters": {"m": {"value": 0.052, "sd": 0.003, "unit": "kg"}},
            "alternatives": [],
        }
    ],
    "parameters": {"E_root_half": {"factor": 1.02, "sd": 0.01}},
    "fit": [
        {"recording": "high", "role": "fit", "noise_floor": 0.01, "nominal": 0.6, "parameters": 0.2, "final": 0.03}
    ],
    "status": "not-converged",
    "advice": "Repeat with more periods.",
    "warnings": ["recording 'high': channel 6:+Z stays at its largest value"],
}


def run(*args: str) -> Result:
    return CliRunner().invoke(main, list(args))


@pytest.fixture
def diagnosis(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[..., Any]], None]:
    """Puts a function in the place of `femend.study.run.diagnose`; what it gets and does is the test's business."""

    def install(function: Callable[..., Any]) -> None:
        module = types.ModuleType("femend.study.run")
        module.diagnose = function  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "femend.study.run", module)

    return install


def write_result(study_path: Path, out: Path, progress: Any, seed: int, **chosen: Any) -> None:
    progress.start("update parameters", 3)
    progress.advance(3)
    with OutputDirectory(out) as stage:
        (stage / "result.json").write_text(json.dumps(RESULT))
        (stage / "seen.json").write_text(json.dumps([str(study_path), seed]))


def test_version_and_help() -> None:
    assert run("--version").output == f"femend {__version__}\n"
    text = run("--help").output
    assert all(name in text for name in ("diagnose", "demo", "inspect"))


@pytest.mark.parametrize(
    ("wanted", "said"),
    [("run", "there is no command 'run'; 'diagnose' runs a study"), ("diagnos", "did you mean 'diagnose'?")],
)
def test_a_command_that_does_not_exist_names_those_that_do(wanted: str, said: str) -> None:
    done = run(wanted, "study.toml")
    assert done.exit_code == 2
    assert said in done.stderr
    assert "The commands are correlate, demo, diagnose, inspect" in done.stderr


def test_diagnose_says_what_the_report_says(diagnosis: Callable[..., None], tmp_path: Path) -> None:
    diagnosis(write_result)
    (tmp_path / "study.toml").write_text("")
    done = run("diagnose", str(tmp_path), "--out", str(tmp_path / "out"), "--seed", "5")
    assert done.exit_code == 0, done.output
    for fact in (
        "Missing: added mass at node 6 in Z, mass 52 g",
        "97 % among the hypotheses tried",
        "mass 52 ± 3 g",
        "not told apart from node 7",
        "updated   E_root_half +2.0 %",
        "status    not-converged",
        "high       fit         0.010      0.60        0.20  0.030",
        "\nwarning   recording 'high': channel 6:+Z stays at its largest value",
        "advice    Repeat with more periods.",
        f"report    {tmp_path / 'out' / 'report.html'}",
    ):
        assert fact in done.output, done.output
    assert json.loads((tmp_path / "out" / "seen.json").read_text()) == [str(tmp_path / "study.toml"), 5]
    assert "update parameters: 0.0 s, 3 done" in done.stderr


def test_of_several_findings_each_is_named_above_its_values() -> None:
    other = {"physics": "viscous_damper", "location": {"nodes": [9], "to": "ground"}, "parameters": {}}
    said = summary({**RESULT, "findings": [*RESULT["findings"], other]}).splitlines()
    at = said.index("finding   added mass at node 6 in Z")
    assert "mass 52 ± 3 g" in said[at + 2]
    assert "finding   viscous damper at node 9, to ground" in said[at + 3 :]
    assert not any(line.startswith("finding") for line in summary(RESULT).splitlines())


@pytest.mark.parametrize(("status", "told"), [("stalled", True), ("interrupted", False), ("converged", False)])
def test_a_fit_that_stalled_is_explained(status: str, told: bool) -> None:
    said = summary({**RESULT, "status": status})
    assert ("status    stalled: the last fit ended before it came to its minimum" in said) is told
    assert ("a smaller prior_sd" in said) is told
    assert ("status    " in said) is (status != "converged")


def test_quiet_says_nothing(diagnosis: Callable[..., None], tmp_path: Path) -> None:
    diagnosis(write_result)
    (tmp_path / "s.toml").write_text("")
    done = run("diagnose", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"), "--quiet")
    assert (done.exit_code, done.output) == (0, "")
    assert (tmp_path / "out" / "result.json").is_file()


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (RecordingError("recording 'low': NaN at 3 s"), "error: recording 'low': NaN at 3 s\n"),
        (DeckError("card CFOO is not known", file="a.bdf", line=12), "error: a.bdf:12: card CFOO is not known\n"),
        (DeckError("a.bdf, line 12: no", file="a.bdf", line=12), "error: a.bdf, line 12: no\n"),
        (PermissionError(13, "Permission denied", "/x/result.json"), "error: Permission denied: /x/result.json\n"),
    ],
)
def test_broken_input_is_one_message_and_exit_code_2(
    diagnosis: Callable[..., None], tmp_path: Path, error: Exception, message: str
) -> None:
    def fail(study_path: Path, **_: Any) -> None:
        raise error

    diagnosis(fail)
    (tmp_path / "s.toml").write_text("")
    done = run("diagnose", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"))
    assert (done.exit_code, done.stderr) == (2, message)


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, click.Abort])
def test_an_interrupted_run_leaves_nothing_and_exits_130(
    diagnosis: Callable[..., None], tmp_path: Path, interruption: type[BaseException]
) -> None:
    def interrupted(study_path: Path, out: Path, **_: Any) -> None:
        with OutputDirectory(out) as stage:
            (stage / "result.json").write_text("{")
            raise interruption

    diagnosis(interrupted)
    (tmp_path / "s.toml").write_text("")
    done = run("diagnose", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"))
    assert done.exit_code == 130
    assert done.stderr.strip() == "interrupted; no result was written"
    assert [p.name for p in tmp_path.iterdir()] == ["s.toml"]


def test_a_fault_of_the_program_keeps_its_traceback(diagnosis: Callable[..., None], tmp_path: Path) -> None:
    def faulty(study_path: Path, **_: Any) -> None:
        raise ZeroDivisionError

    diagnosis(faulty)
    (tmp_path / "s.toml").write_text("")
    done = run("diagnose", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"))
    assert isinstance(done.exception, ZeroDivisionError)


def test_a_study_that_is_not_there(tmp_path: Path) -> None:
    done = run("diagnose", str(tmp_path), "--out", str(tmp_path / "out"))
    assert done.exit_code == 2
    assert f"the folder {tmp_path} holds no study.toml" in done.stderr
    done = run("diagnose", str(tmp_path / "no.toml"), "--out", str(tmp_path / "out"))
    assert done.exit_code == 2
    assert "there is no study" in done.stderr
    assert run("diagnose", "study.toml").exit_code == 2
    assert run("diagnos").exit_code == 2


def test_demo_ends_with_what_was_missing_and_where_the_report_lies(
    diagnosis: Callable[..., None], tmp_path: Path
) -> None:
    diagnosis(write_result)
    done = run("demo", "--out", str(tmp_path / "demo"))
    assert done.exit_code == 0, done.output
    assert "Missing: added mass at node 6" in done.stdout
    assert done.stdout.rstrip().endswith(str(tmp_path / "demo" / "report.html"))
    assert json.loads((tmp_path / "demo" / "seen.json").read_text()) == [str(STUDY), 0]


def test_held_out_recordings_are_scored_as_the_contract_says(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    held_out, stage = tmp_path / "held_out", tmp_path / "out" / "predictions" / "final"
    held_out.mkdir()
    stage.mkdir(parents=True)
    (tmp_path / "out" / "predictions" / "parameters").mkdir()
    shutil.copy(STUDY.parent / "high.uff", held_out / "high.uff")
    shutil.copy(STUDY.parent / "mid.uff", stage / "high.uff")
    shutil.copy(STUDY.parent / "high.uff", tmp_path / "out" / "predictions" / "parameters" / "high.uff")

    def records(name: str) -> np.ndarray:
        sets = pyuff.UFF(str(STUDY.parent / name)).read_sets()
        return np.concatenate([s["data"] for s in sets if s["ordinate_spec_data_type"] == 12])

    expected = np.linalg.norm(records("mid.uff") - records("high.uff")) / np.linalg.norm(records("high.uff"))
    (score,) = held_out_errors(tmp_path / "out", held_out)
    assert (score.recording, score.nominal, score.parameters) == ("high", None, 0.0)
    assert score.final == pytest.approx(expected, rel=1e-12)


def test_what_was_concealed_is_told_in_words(tmp_path: Path) -> None:
    assert concealed(tmp_path) is None
    (tmp_path / "truth.json").write_text('{"effect": "added_mass", "nodes": [6], "direction": "Z"}')
    assert concealed(tmp_path) == "added mass at node 6 in Z"


def test_inspect_tells_channels_and_rates() -> None:
    done = run("inspect", str(STUDY.parent / "high.uff"))
    assert done.exit_code == 0, done.output
    assert "5 channels, 6144 samples at 1024 Hz, 6 s" in done.output
    assert "force" in done.output
    assert "7:+Z  acceleration" in done.output


def test_inspect_of_a_deck_counts_cards_and_says_the_size() -> None:
    done = run("inspect", str(STUDY.parent / "model.bdf"))
    assert done.exit_code == 0, done.output
    text = (STUDY.parent / "model.bdf").read_text()
    n_grid, n_bar = (sum(line.startswith(f"{card},") for line in text.splitlines()) for card in ("GRID", "CBAR"))
    assert f"{n_grid} nodes" in done.output
    assert f"CBAR {n_bar:>7}" in done.output
    assert "0.726114 by 0 by 0 along X, Y, Z" in done.output
    assert "COUPMASS 1" in done.output


def test_inspect_of_a_broken_deck_names_file_line_and_card(tmp_path: Path) -> None:
    (tmp_path / "m.bdf").write_text("BEGIN BULK\nGRID,1,,0.,0.,0.\nCFOO,7,1,1\nENDDATA\n")
    done = run("inspect", str(tmp_path / "m.bdf"))
    assert done.exit_code == 2
    assert "m.bdf" in done.stderr
    assert "CFOO" in done.stderr
    assert "3" in done.stderr.replace(str(tmp_path), "")


def test_inspect_of_a_damaged_file_names_it(tmp_path: Path) -> None:
    whole = (STUDY.parent / "high.uff").read_bytes()
    (tmp_path / "cut.uff").write_bytes(whole[: len(whole) // 2])
    done = run("inspect", str(tmp_path / "cut.uff"))
    assert done.exit_code == 2
    assert "cut.uff" in done.stderr
    assert done.stderr.count("\n") == 1


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_is_a_bar_on_a_terminal_and_lines_elsewhere() -> None:
    assert isinstance(progress_for(io.StringIO(), quiet=True), SilentProgress)
    assert isinstance(progress_for(io.StringIO()), LineProgress)
    terminal = Terminal()
    bar = progress_for(terminal)
    assert isinstance(bar, BarProgress)
    bar.start("locate", 4)
    bar.advance(4)
    bar.start("name")
    bar.advance()
    bar.done()
    bar.done()
    assert "4/4" in terminal.getvalue()
    assert "name" in terminal.getvalue()


def test_plain_progress_is_one_line_per_step() -> None:
    stream = io.StringIO()
    lines = progress_for(stream)
    lines.start("read")
    lines.start("locate", 12)
    lines.advance(12)
    lines.done()
    lines.done()
    assert stream.getvalue().splitlines() == ["read: 0.0 s", "locate: 0.0 s, 12 done"]


def test_inspect_shows_the_columns_of_a_table(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time;kraft;oben\n" + "".join(f"{i / 100:g};{i % 3:g};{-2 * (i % 2):g}\n" for i in range(50)))
    done = CliRunner().invoke(main, ["inspect", str(path)])
    assert done.exit_code == 0, done.output
    assert "table, 3 columns; 50 rows at 100 Hz, 0.5 s" in done.output
    assert any(line.split()[:3] == ["2", "oben", "50"] for line in done.output.splitlines())
    assert "[[recording.channel]]" in done.output
    other = path.rename(tmp_path / "run.dat")
    assert "table, 3 columns" in CliRunner().invoke(main, ["inspect", str(other)]).output


def test_inspect_takes_no_force_called_f_for_frequencies(tmp_path: Path) -> None:
    """The first sample and the last one of the force were told as the band."""
    import h5py
    from scipy.io import savemat

    force, top, freq = np.cos(np.arange(50.0)), np.sin(np.arange(50.0)), np.linspace(0.0, 98.0, 50)
    time = np.arange(50) / 100

    def said(path: Path) -> str:
        return CliRunner().invoke(main, ["inspect", str(path)]).output.splitlines()[0].split("; ")[-1]

    def text(**columns: np.ndarray) -> Path:
        rows = zip(*columns.values(), strict=True)
        (tmp_path / "run.csv").write_text("\n".join([",".join(columns), *(",".join(map(str, r)) for r in rows)]))
        return tmp_path / "run.csv"

    assert said(text(time=time, F=force, top=top)) == "50 rows at 100 Hz, 0.5 s"
    # a force that only increases, as of a slow test, is none either where there is a time
    assert said(text(time=time, F=freq, top=top)) == "50 rows at 100 Hz, 0.5 s"
    assert said(text(f=freq, top=top)) == "50 lines from 0 to 98 Hz"
    assert said(text(F=force, freq=freq, top_re=top, top_im=force)) == "50 lines from 0 to 98 Hz"
    savemat(tmp_path / "run.mat", {"fs": 100.0, "F": force, "top": top})
    assert said(tmp_path / "run.mat") == "50 rows at 100 Hz, 0.5 s"
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.attrs["fs"] = 100.0
        file["F"], file["top"] = force, top
    assert said(tmp_path / "run.h5") == "50 rows at 100 Hz, 0.5 s"


def test_inspect_says_what_a_study_is_for(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text("")
    done = CliRunner().invoke(main, ["inspect", str(tmp_path / "study.toml")])
    assert done.exit_code == 2
    assert "is a study, not a deck or a recording; femend diagnose reads it" in done.stderr
