"""What every test may ask for: the shared recordings and cases, and programs that are not everywhere."""

from __future__ import annotations

import importlib
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

PROJECT = Path(__file__).resolve().parents[1]


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--without-diagnoses`: for a second run on another Python, in a part of the time."""
    parser.addoption("--without-diagnoses", action="store_true", help="skip tests that diagnose whole studies")


def pytest_configure(config: pytest.Config) -> None:
    """With `--without-diagnoses`, whatever comes to diagnose a study is skipped there, its fixtures' tests as well."""
    if config.getoption("--without-diagnoses"):
        from femend.study import run

        def skipped(*args: object, **kwargs: object) -> None:
            pytest.skip("whole studies are not diagnosed in this run")

        for name in ("diagnose_records", "diagnose_responses"):
            setattr(run, name, skipped)


@pytest.fixture(scope="session")
def project_root() -> Path:
    """The folder that holds `pyproject.toml`."""
    return PROJECT


@pytest.fixture(scope="session")
def shared_root() -> Path:
    """The folder of shared data: `FEMEND_SHARED`, else `../shared` beside the project; skips where there is none.

    A `FEMEND_SHARED` that does not exist fails: somebody asked for these tests and would not get them.
    """
    named = os.environ.get("FEMEND_SHARED")
    if named:
        if not Path(named).is_dir():
            pytest.fail(f"FEMEND_SHARED names {named}, which is no folder", pytrace=False)
        return Path(named).resolve()
    beside = PROJECT.parent / "shared"
    if not beside.is_dir():
        pytest.skip("no shared data: ../shared is absent and FEMEND_SHARED is not set")
    return beside


@pytest.fixture(scope="session")
def shared(shared_root: Path) -> Callable[[str], Path]:
    """`shared("data/three_storey")` is that file or folder; skips if absent, and refuses the sealed answers."""

    def find(name: str) -> Path:
        if "sealed" in Path(name).parts:
            pytest.fail(f"{name} holds sealed answers; only the scorer reads them", pytrace=False)
        path = shared_root / name
        if not path.exists():
            pytest.skip(f"no {name} in the shared data")
        return path

    return find


@pytest.fixture(scope="session")
def program() -> Callable[[str], str]:
    """`program("ccx")` is the path of an installed program; skips with the Debian package to install."""
    packages = {"ccx": "calculix-ccx", "chromium": "chromium"}

    def find(name: str) -> str:
        path = shutil.which(name)
        if path is None:
            pytest.skip(f"{name} is not installed (Debian package {packages.get(name, name)})")
        return path

    return find


@pytest.fixture(scope="session")
def optional_module() -> Callable[[str], ModuleType]:
    """`optional_module("openseespy.opensees")` imports it, or skips and says why (see requirements/optional.txt)."""

    def find(name: str) -> ModuleType:
        try:
            return importlib.import_module(name)
        except (ImportError, RuntimeError) as error:  # OpenSeesPy turns a missing system library into RuntimeError
            pytest.skip(f"{name} cannot be imported: {error}")

    return find


@pytest.fixture(scope="session")
def pynastran_python() -> Path:
    """The interpreter of the environment that holds pyNastran (it needs numpy < 2); skips where it was not made."""
    python = PROJECT / ".venv-pynastran" / "bin" / "python"
    if not python.is_file():
        pytest.skip("no environment with pyNastran; `make pynastran` makes it where numpy < 2 can be installed")
    return python
