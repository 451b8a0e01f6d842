"""Results are there completely or not at all, and what is the user's stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from femend.io import OutputDirectory, refuse_unwritable, write_atomic


def tree(folder: Path) -> dict[str, str]:
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


def fill(folder: Path, text: str) -> None:
    (folder / "result.json").write_text(text)
    (folder / "predictions" / "final").mkdir(parents=True)
    (folder / "predictions" / "final" / f"{text}.uff").write_text(text)


def test_a_new_folder_appears_at_the_end(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    with OutputDirectory(out) as folder:
        fill(folder, "a")
        assert not out.exists()
    assert tree(out) == {"result.json": "a", "predictions/final/a.uff": "a"}
    assert list(out.parent.iterdir()) == [out]
    umask = os.umask(0)
    os.umask(umask)
    assert out.stat().st_mode & 0o777 == 0o777 & ~umask


def test_earlier_results_go_and_the_users_files_stay(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    fill(out, "old")
    (out / "model.updated.bdf").write_text("old")
    (out / "notes.txt").write_text("mine")
    (out / "study.toml").write_text("mine")
    with OutputDirectory(out) as folder:
        fill(folder, "new")
    assert tree(out) == {
        "notes.txt": "mine",
        "study.toml": "mine",
        "result.json": "new",
        "predictions/final/new.uff": "new",
    }
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_an_exception_leaves_everything_as_it_was(tmp_path: Path, error: type[BaseException]) -> None:
    out = tmp_path / "out"
    out.mkdir()
    fill(out, "old")
    before = tree(out)

    def interrupted() -> None:
        with OutputDirectory(out) as folder:
            fill(folder, "new")
            raise error

    with pytest.raises(error):
        interrupted()
    assert tree(out) == before
    assert list(tmp_path.iterdir()) == [out]


def test_moving_that_fails_half_way_puts_things_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    out.mkdir()
    fill(out, "old")
    before = tree(out)
    real, calls = os.rename, []

    def rename(a: Path, b: Path) -> None:
        calls.append(a)
        if len(calls) == 4:  # two old entries are out of the way, one new one is in its place
            raise OSError("disk full")
        real(a, b)

    monkeypatch.setattr(os, "rename", rename)
    with pytest.raises(OSError, match="disk full"), OutputDirectory(out) as folder:
        fill(folder, "new")
    assert tree(out) == before
    assert list(tmp_path.iterdir()) == [out]


def test_a_killed_run_leaves_no_trace_after_the_next(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    fill(out, "old")
    before = tree(out)
    code = textwrap.dedent(
        """
        import os, signal, sys
        from femend.io import OutputDirectory
        with OutputDirectory(sys.argv[1]) as folder:
            (folder / "result.json").write_text("half")
            os.kill(os.getpid(), signal.SIGKILL)
        """
    )
    done = subprocess.run([sys.executable, "-c", code, str(out)], timeout=60)
    assert done.returncode == -signal.SIGKILL
    assert tree(out) == before
    assert len(list(tmp_path.iterdir())) == 2
    with OutputDirectory(out) as folder:
        fill(folder, "new")
    assert list(tmp_path.iterdir()) == [out]


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    with pytest.raises(NotADirectoryError, match="out is a file; give a folder"):
        OutputDirectory(tmp_path / "out")


def test_single_files(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_atomic(path, "Träger")
    assert path.read_bytes() == "Träger".encode()
    write_atomic(path, b"\x00\x01")
    assert path.read_bytes() == b"\x00\x01"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        write_atomic(tmp_path / "gone" / "a.txt", "x")


def test_a_place_that_takes_no_results_is_told_before_the_work(tmp_path: Path) -> None:
    file = tmp_path / "taken"
    file.write_text("mine")
    with pytest.raises(NotADirectoryError, match="taken is a file; give a folder"):
        refuse_unwritable(file)
    with pytest.raises(NotADirectoryError, match=r"no results can be written to .*out: .*taken .*name another folder"):
        refuse_unwritable(file / "deep" / "out")
    assert file.read_text() == "mine"


def test_a_place_that_takes_results_stays_as_it_is(tmp_path: Path) -> None:
    refuse_unwritable(tmp_path / "deep" / "out")
    (tmp_path / "out").mkdir()
    refuse_unwritable(tmp_path / "out")
    assert [p.name for p in tmp_path.rglob("*")] == ["out"]


def test_what_is_the_users_and_called_like_a_result_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "predictions").mkdir()
    (tmp_path / "predictions" / "mine.csv").write_text("mine")
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(FileExistsError, match=r"holds predictions, .* no earlier run of femend left them there"):
        refuse_unwritable(tmp_path)
    (tmp_path / "run.json").write_text("{}")  # of an earlier run, as the predictions are then
    refuse_unwritable(tmp_path)
    assert (tmp_path / "predictions" / "mine.csv").read_text() == "mine"
