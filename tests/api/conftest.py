"""The package as the rules see it: its source files, and its public modules."""

from __future__ import annotations

import importlib
import pkgutil
import shutil
import subprocess
from pathlib import Path
from types import ModuleType

import pytest

PUBLIC_NAME_START = "_"


@pytest.fixture(scope="session")
def package_root(project_root: Path) -> Path:
    """The folder of the package's sources."""
    return project_root / "python" / "femend"


@pytest.fixture(scope="session")
def tree_files(project_root: Path) -> list[Path]:
    """The files of the project as git knows them (tracked, or new and not ignored)."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed: the tree's files are not known")
    listing = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
        cwd=project_root,
        capture_output=True,
        text=True,
    )
    if listing.returncode != 0:
        pytest.skip("not a git checkout: the tree's files are not known")
    paths = (project_root / name for name in listing.stdout.split("\0") if name)
    return sorted(path for path in paths if path.is_file())


@pytest.fixture(scope="session")
def public_modules() -> list[ModuleType]:
    """`femend` and every module below it that no part of the name marks as private."""
    import femend

    modules = [femend]
    for found in pkgutil.walk_packages(femend.__path__, "femend."):
        if not any(part.startswith(PUBLIC_NAME_START) for part in found.name.split(".")):
            modules.append(importlib.import_module(found.name))
    return modules
