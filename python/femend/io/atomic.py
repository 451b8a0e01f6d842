"""Output that is there completely or not at all: everything is written beside its place and moved at the end."""

from __future__ import annotations

import fnmatch
import os
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

__all__ = [
    "RESULT_NAMES",
    "OutputDirectory",
    "atomic_path",
    "refuse_unwritable",
    "refuse_unwritable_file",
    "write_atomic",
]

# What a diagnosis writes. Entries of these names are replaced as a whole; everything else in the folder is the user's.
RESULT_NAMES = ("result.json", "report.html", "run.json", "predictions", "model.updated.*")


# by any of these a folder shows that an earlier run wrote to it
MARKS = ("run.json", "result.json", "updating.json", "correlation.json", "pretest.json", "population.json")


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path beside `path` to write to; moved to `path` at the end, removed where the body raises.

    Raises FileNotFoundError where the folder of `path` does not exist.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path} cannot be written: there is no folder {path.parent}")
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".partial", dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes files for the owner alone; a result has the rights any other new file would have.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_atomic(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Writes `content` (text as UTF-8) to `path`: the old file stands until the new one is complete."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


def refuse_unwritable(path: str | os.PathLike[str], *, owned: tuple[str, ...] = RESULT_NAMES) -> None:
    """Raises the OSError that writing results to the folder `path` would end in, before the work for them is begun, and
    FileExistsError where entries named as results (`owned` patterns) stand there that no earlier run left.

    Nothing is left behind: folders that do not exist are not made, and what is tried out is taken away again.
    """
    out = OutputDirectory(path, owned=owned).path
    if out.exists() and not any((out / name).is_file() for name in MARKS):
        users = sorted(e.name for e in out.iterdir() if any(fnmatch.fnmatchcase(e.name, p) for p in owned))
        if users:
            raise FileExistsError(
                f"{out} holds {', '.join(users)}, where results of these names would go, and no earlier run of femend "
                "left them there; name another folder for the results, or move them away"
            )
    there = _there(out.parent)
    # beside the folder everything is written, into it the entries are moved
    for folder in dict.fromkeys((there, out) if out.exists() else (there,)):
        try:
            os.rmdir(tempfile.mkdtemp(prefix=".femend.", suffix=".partial", dir=folder))
        except OSError as error:
            raise type(error)(
                f"no results can be written to {out}: {folder} does not take new files "
                f"({error.strerror or error}); name another folder for the results, or change its rights"
            ) from error


def refuse_unwritable_file(path: str | os.PathLike[str]) -> None:
    """Raises the OSError that writing the file `path` would end in, before the work for it is begun, IsADirectoryError
    where it is a folder. Nothing is left behind, and a folder that does not exist is not made yet."""
    path = Path(path).absolute()
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder; give the name of a file in it")
    there = _there(path.parent)
    try:
        os.rmdir(tempfile.mkdtemp(prefix=".femend.", suffix=".partial", dir=there))
    except OSError as error:
        raise type(error)(
            f"{path} cannot be written: {there} does not take new files ({error.strerror or error}); name another "
            "file, or change the rights of the folder"
        ) from error


def _there(folder: Path) -> Path:
    """`folder`, or the nearest one above it that exists."""
    while not folder.exists():
        folder = folder.parent
    return folder


class OutputDirectory:
    """A folder of results that changes only when all of them are there.

    `with OutputDirectory("out") as folder:` gives a temporary folder beside ``out``. At the end of the body its
    entries are moved to ``out``, where entries named in `owned` (patterns) from an earlier run go and everything else
    stays. Where the body raises, or is interrupted, ``out`` is as it was and the temporary folder is removed; where
    moving fails half-way, the earlier results are put back.

    Raises NotADirectoryError where `path` is a file.
    """

    def __init__(self, path: str | os.PathLike[str], *, owned: tuple[str, ...] = RESULT_NAMES) -> None:
        self.path = Path(path).absolute()
        self.owned = owned
        self.temporary: Path | None = None
        if self.path.exists() and not self.path.is_dir():
            raise NotADirectoryError(f"{self.path} is a file; give a folder for the results")

    @property
    def _prefix(self) -> str:
        return f".{self.path.name}.partial-{socket.gethostname()}-"

    def __enter__(self) -> Path:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._remove_leftovers()
        self.temporary = Path(tempfile.mkdtemp(prefix=f"{self._prefix}{os.getpid()}-", dir=self.path.parent))
        return self.temporary

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self.temporary is not None
        try:
            if kind is None:
                self._move(self.temporary)
        finally:
            shutil.rmtree(self.temporary, ignore_errors=True)

    def _remove_leftovers(self) -> None:
        """Removes temporary folders of runs on this machine that were killed."""
        for old in self.path.parent.glob(f"{self._prefix}*"):
            pid = old.name.removeprefix(self._prefix).split("-")[0]
            if pid.isdigit() and not _alive(int(pid)) and not (old / ".earlier").exists():
                shutil.rmtree(old, ignore_errors=True)

    def _move(self, temporary: Path) -> None:
        new = sorted(entry for entry in temporary.iterdir())
        if not self.path.exists():
            umask = os.umask(0)
            os.umask(umask)
            temporary.chmod(0o777 & ~umask)
            os.rename(temporary, self.path)
            return
        earlier = temporary / ".earlier"
        earlier.mkdir()
        written = {entry.name for entry in new}
        replaced = [
            entry
            for entry in self.path.iterdir()
            if entry.name in written or any(fnmatch.fnmatchcase(entry.name, pattern) for pattern in self.owned)
        ]
        undo: list[tuple[Path, Path]] = []
        try:
            for entry in replaced:
                undo.append((earlier / entry.name, entry))
                os.rename(entry, earlier / entry.name)
            for entry in new:
                undo.append((self.path / entry.name, temporary / entry.name))
                os.rename(entry, self.path / entry.name)
        except BaseException:
            for now, before in reversed(undo):
                if now.exists() and not before.exists():
                    os.rename(now, before)
            raise


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
