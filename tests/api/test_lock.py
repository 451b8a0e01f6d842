"""The pins fit what the package asks for, so that an installation from either works the same."""

from __future__ import annotations

import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name


def pins(project_root: Path) -> dict[str, str]:
    lines = (project_root / "requirements" / "lock.txt").read_text(encoding="utf-8").splitlines()
    pairs = (line.split("==") for line in lines if line and not line.startswith("#"))
    return {canonicalize_name(name): version for name, version in pairs}


def test_the_lock_covers_the_requirements(project_root: Path) -> None:
    pyproject = tomllib.loads((project_root / "pyproject.toml").read_text(encoding="utf-8"))
    project = pyproject["project"]
    extras = project["optional-dependencies"]
    asked = [*pyproject["build-system"]["requires"], *project["dependencies"], *extras["test"], *extras["dev"]]
    pinned = pins(project_root)
    wanted = [Requirement(text) for text in asked]
    unmet = [str(one) for one in wanted if not one.specifier.contains(pinned.get(canonicalize_name(one.name), "0"))]
    assert unmet == []
