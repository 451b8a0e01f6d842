"""The generator on the import path, and small cases that several files look at."""

from __future__ import annotations

import os
import pathlib
import sys
from collections.abc import Iterator

import pytest

os.environ.setdefault("NUMBA_DISABLE_JIT", "1")  # short runs: compiling would take longer than interpreting
sys.path.insert(0, str(pathlib.Path(__file__).parent))

from blindgen import case, setting


@pytest.fixture(scope="module")
def short() -> Iterator[None]:
    """Recordings of a fifth of a second, so that a whole case is quick."""
    with pytest.MonkeyPatch.context() as patch:
        for name in setting.SECONDS:
            patch.setitem(setting.SECONDS, name, 0.2)
        yield


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory, short: None) -> tuple[pathlib.Path, dict]:
    """One small control case on disk."""
    folder = tmp_path_factory.mktemp("set") / "b0001"
    return folder, case.write_case(folder, 7, 0, "cantilever", "none:parameters")
