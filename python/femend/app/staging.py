"""Output that is written whole or not at all: into a temporary folder beside the target, moved when it is complete."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["staged_output"]


@contextmanager
def staged_output(out: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary folder whose files take their place in `out` when the body ends without an exception.

    An interrupted or failed body leaves `out` as it was. Files of the same name in `out` are replaced, all others stay.
    The temporary folder lies beside `out`, so that every move is a rename on one file system.

    Raises:
        NotADirectoryError: `out` is a file.
        OSError: the folder above `out` cannot be written.
    """
    out = Path(out)
    if out.exists() and not out.is_dir():
        raise NotADirectoryError(f"{out} is a file; give a folder to write the results to")
    parent = out.absolute().parent
    parent.mkdir(parents=True, exist_ok=True)
    stage = Path(tempfile.mkdtemp(prefix=f".{out.name}-", dir=parent))
    try:
        yield stage
        _move_into(stage, out)
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def _move_into(stage: Path, out: Path) -> None:
    if not out.exists():
        stage.chmod(0o755)  # mkdtemp closes its folder to others; a result is not a secret
        stage.rename(out)
        return
    for source in sorted(stage.rglob("*")):
        target = out / source.relative_to(stage)
        if source.is_dir():
            target.mkdir(exist_ok=True)
        else:
            os.replace(source, target)
