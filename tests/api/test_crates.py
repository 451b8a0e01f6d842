"""The Rust floors: a crate depends on lower ones only; one crate names faer and one names pyo3."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

FLOORS = ("linalg", "fem", "dynamics", "py")
ONLY_IN = {"faer": "linalg", "pyo3": "py", "numpy": "py", "ndarray": "py"}


def dependencies(project_root: Path, crate: str) -> set[str]:
    manifest = tomllib.loads((project_root / "rust" / crate / "Cargo.toml").read_text(encoding="utf-8"))
    tables = [manifest, *manifest.get("target", {}).values()]
    kinds = ("dependencies", "dev-dependencies", "build-dependencies")
    return {name for table in tables for kind in kinds for name in table.get(kind, {})}


def test_every_crate_has_a_floor(project_root: Path) -> None:
    workspace = tomllib.loads((project_root / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]
    assert sorted(workspace["members"]) == sorted(f"rust/{crate}" for crate in FLOORS)


@pytest.mark.parametrize("crate", FLOORS)
def test_crates_depend_downwards(project_root: Path, crate: str) -> None:
    lower = {f"femend-{name}" for name in FLOORS[: FLOORS.index(crate)]}
    own = {name for name in dependencies(project_root, crate) if name.startswith("femend-")}
    assert own <= lower


@pytest.mark.parametrize(("package", "home"), ONLY_IN.items())
def test_one_crate_names_it(project_root: Path, package: str, home: str) -> None:
    assert {crate for crate in FLOORS if package in dependencies(project_root, crate)} <= {home}


@pytest.mark.parametrize("crate", FLOORS)
def test_crates_share_the_workspace_lints(project_root: Path, crate: str) -> None:
    manifest = tomllib.loads((project_root / "rust" / crate / "Cargo.toml").read_text(encoding="utf-8"))
    assert manifest["lints"] == {"workspace": True}


def test_no_algorithm_needs_the_interpreter(project_root: Path) -> None:
    naming = [
        str(path.relative_to(project_root))
        for crate in FLOORS[:-1]
        for path in (project_root / "rust" / crate).rglob("*.rs")
        if re.search(r"\bpyo3::", path.read_text(encoding="utf-8"))
    ]
    assert naming == []
